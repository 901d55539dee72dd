//! The screened Poisson equation: [`isograd::poisson::screened`] on a device.
//!
//! # Map
//! `x₀ → χ`, from the solution of the plain equation to that which is drawn to one value at the samples, by
//! conjugate gradients over the samples as printed there, with one direct solve an iteration. Numbers of samples
//! are in the order of the cells that hold them. One number is downloaded an iteration: what is left of the
//! residual.
//!
//! # Residual, pullback
//! As printed there: the residual of the iso-value of `χ`, and a second solve.
//!
//! # Not differentiable
//! `∇χ` jumps where a sample crosses a plane through cell centers. `α` is held.

mod forward;
mod gradients;
mod pullback;

pub use forward::forward;
pub use pullback::{pullback, smoothing_pullback};

use isograd::poisson::screened;

use super::Solver;
use crate::Scalar;
use crate::splat::{self, Samples};

/// The equation, but for its right-hand side.
#[derive(Clone, Copy)]
pub struct Equation<'a, T: Scalar> {
    /// The direct solve.
    pub solver: &'a Solver<T>,
    /// Samples; their normals are not used.
    pub samples: Samples<'a, T>,
    /// Whether areas count in cells², or each sample as 1.
    pub area_weights: bool,
    /// The samples by cell, and the grid.
    pub splat: &'a splat::Residual<T>,
    /// `α`: 0 or more.
    pub screening: f64,
}

/// Why there is no solution.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The device.
    #[error(transparent)]
    Device(#[from] crate::Error),
    /// Conjugate gradients did not end.
    #[error(transparent)]
    Screened(#[from] screened::Error),
}

impl<T: Scalar> Equation<'_, T> {
    /// One over the area, in the user's unit, that counts as 1.
    fn per_area(&self) -> T {
        let one = T::of(1.0);
        match self.area_weights {
            true => one / self.splat.grid.spacing() / self.splat.grid.spacing(),
            false => one,
        }
    }
}
