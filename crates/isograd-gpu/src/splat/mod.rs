//! The splat: oriented samples → right-hand side `b` of the Poisson equation, as [`isograd::splat`].
//!
//! # Map
//! `V_o = Σ_i α_{o,i} a_i n_i / h²` over the 3×3×3 cells around each sample and `b = Σ_d D_d V_d`, in index space
//! (no unit); `χ` rises outward. `V` is never stored: a cell of `b` adds up what the samples at most 2 cells
//! away along each axis have for it. Samples are sorted by cell first, so that those of a row of cells follow
//! each other and each sum has one order.
//!
//! # Residual
//! The order of the samples and the weights. The inputs are not copied: the pullback takes them again.
//!
//! # Pullback
//! A gather per sample from the 5×5×5 values of `b̄` around it: `n̄_i = Σ_o α V̄_o a_i/h²`,
//! `ā_i = Σ_o α V̄_o·n_i/h²`, `x̄_i = Σ_o ∇α (V̄_o·n_i) a_i/h³`, with `V̄_d = D_dᵀ b̄`; and of the grid, on which
//! `x̂ = (x − lower)/h` and `a/h²` depend.
//!
//! # Bad samples
//! The CPU refuses a cloud with a sample that is less than 2 cells inside the grid, or not finite. Here
//! such samples are left out, as a check would wait for the device; [`Residual::refused`] reports them.
//!
//! # Not differentiable
//! As on the CPU: nothing with [`Weights::BSpline`]; with [`Weights::Paper`], `b` jumps where a sample
//! crosses a cell face.

pub mod area;
mod cotangent;
mod forward;
mod order;
mod pullback;
mod stencil;

pub(crate) use crate::element::stencil::{bspline, bspline_slope};
pub use cotangent::SampleCotangent;
pub(crate) use cotangent::{CotangentArrays, subtract_from_grid};
pub use forward::forward;
pub use isograd::splat::Weights;
pub use order::{Refused, SampleOrder};
pub use pullback::pullback;
pub(crate) use stencil::pick;

use crate::device::{argument, check_length};
use crate::{Buffer, Device, Error, Scalar};
use cubecl::prelude::*;

/// Oriented samples.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a, T> {
    /// `(N, 3)` points, in the user's unit.
    pub points: &'a Buffer<T>,
    /// `(N, 3)` outward unit normals.
    pub normals: &'a Buffer<T>,
    /// `(N,)` areas, in that unit squared.
    pub areas: &'a Buffer<T>,
}

impl<T: Scalar> Samples<'_, T> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// There must be a point and a normal an area.
    pub(crate) fn check(&self) -> Result<(), Error> {
        check_length("the array of points", self.points, 3 * self.len())?;
        check_length("the array of normals", self.normals, 3 * self.len())
    }
}

/// [`Samples`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct SampleArrays<F: Float + CubeElement> {
    pub points: Array<F>,
    pub normals: Array<F>,
    pub areas: Array<F>,
    pub count: u32,
}

argument!(
    Samples<'_, T> => SampleArraysLaunch<T, R>:
    |of| of.points.arg(), of.normals.arg(), of.areas.arg(), of.len() as u32
);

/// Residual of [`forward`]; the pullback takes the inputs again.
#[derive(Clone, Debug)]
pub struct Residual<T> {
    /// The grid of `b`.
    pub grid: isograd::Grid<T>,
    /// The weights that were used.
    pub weights: Weights,
    /// The samples by cell.
    pub order: SampleOrder,
}

impl<T: Scalar> Residual<T> {
    /// The samples that were left out, if any. Waits for the device.
    pub fn refused<R: Runtime>(&self, device: &Device<R>) -> Result<Option<Refused>, Error> {
        self.order.refused(device)
    }
}
