//! Formulas of single elements: small pure functions of numbers and vectors, apart from the loops that call them.
//!
//! They are compiled twice: here as plain Rust over [`Element`], and in `isograd-gpu` as parts of kernels, where the cfg
//! `cube` is set and CubeCL's `Float` takes the place of [`Element`]. So they keep to what both languages have: no early
//! return, no slices, and choices between values rather than branches where lanes should stay together.
//!
//! This crate belongs to the inside of `isograd`; its interface changes without notice.

pub mod crossing;
pub mod eigen;
pub mod fit;
pub mod linear;
pub mod plane;
pub mod plate;
pub mod quadric;
pub mod stencil;
pub mod turned;
#[cfg(not(cube))]
pub mod vector;
pub mod vector3;

#[cfg(cube)]
use cubecl::prelude::*;

#[cfg(cube)]
pub use cubecl::prelude::{Float as Element, select};

/// A number in a formula. In kernels CubeCL's `Float` takes its place.
#[cfg(not(cube))]
pub trait Element: num_traits::Float {
    /// A constant. Those that `f32` cannot hold are quotients of others.
    fn new(x: f32) -> Self;
}

#[cfg(not(cube))]
impl Element for f32 {
    #[inline(always)]
    fn new(x: f32) -> Self {
        x
    }
}

#[cfg(not(cube))]
impl Element for f64 {
    #[inline(always)]
    fn new(x: f32) -> Self {
        f64::from(x)
    }
}

/// `a` where the condition holds, else `b`; both are evaluated.
#[cfg(not(cube))]
#[inline(always)]
pub fn select<T>(condition: bool, a: T, b: T) -> T {
    if condition { a } else { b }
}

/// `x ≥ 0` with the sign of `sign`.
#[cfg(not(cube))]
#[inline(always)]
pub fn with_sign<F: Element>(x: F, sign: F) -> F {
    x.copysign(sign)
}

/// `x ≥ 0` with the sign of `sign`, positive for both zeros.
#[cfg(cube)]
#[cube]
pub fn with_sign<F: Element>(x: F, sign: F) -> F {
    select(sign < F::new(0.0), -x, x)
}

/// `√3`.
#[cfg(not(cube))]
#[inline(always)]
pub fn root_of_three<F: Element>() -> F {
    F::new(3.0).sqrt()
}

/// `√3` in single precision: WGSL has no root of a constant in double precision.
#[cfg(cube)]
#[cube]
pub fn root_of_three<F: Element>() -> F {
    F::new(1.732_050_8)
}
