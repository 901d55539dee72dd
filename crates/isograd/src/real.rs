//! The two number types of the library.

use std::fmt::{Debug, Display, LowerExp};
use std::iter::Sum;

use isograd_fourier::Fourier;
use num_traits::{Float, FloatConst, NumAssign};

use crate::element::Element;

/// `f32` or `f64`: the type of every coordinate and every field value. What comes in goes out.
///
/// Sealed: the error bounds of the stages are stated for these two alone.
pub trait Real:
    sealed::Sealed
    + Element
    + Float
    + FloatConst
    + NumAssign
    + Fourier
    + Sum
    + Default
    + Debug
    + Display
    + LowerExp
    + 'static
{
    /// The name of the type, `"f32"` or `"f64"`.
    const NAME: &'static str;

    /// The nearest value to `x`.
    fn of(x: f64) -> Self;

    /// This value in double precision (exact).
    fn f64(self) -> f64;

    /// The nearest value to the integer `n`.
    fn of_usize(n: usize) -> Self {
        Self::of(n as f64)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Real for f32 {
    const NAME: &'static str = "f32";

    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }

    #[inline(always)]
    fn f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const NAME: &'static str = "f64";

    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn f64(self) -> f64 {
        self
    }
}
