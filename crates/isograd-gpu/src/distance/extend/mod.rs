//! Closest-point extension on the device: what is known at the samples, at the surface point closest to every cell
//! of a band. What it computes, and why, is on the page of [`isograd::distance::extend`].
//!
//! # Map
//! Attribute `v_i` per sample → value at every vertex of the surface → value at every cell of the band: as printed
//! there, by walks over the tree of the samples. `R_v` is found from exact distances, by the same rule. The list of
//! the cells is ascending.
//!
//! The CPU fits in double precision, whatever the number type; here all is in that of the arrays. `d_j` and `e_j`
//! are in units of `R_v`; attributes are taken relative to one of those at hand, which changes nothing as
//! `Σ_j p_j t_j = 1`; and `C` is summed twice: the second time in the frame of the eigenvectors of the first sum, where
//! the direction across the surface, in which samples hardly differ, keeps its digits.
//!
//! # Residual
//! [`Residual`]: the fits, `a₀`, and `β` of every cell in the band. Besides it the pullback takes the inputs again, and
//! what came out.
//!
//! # Pullback
//! As printed there, each sum in a fixed order: cells → faces (sorted, in pieces) → vertices → samples, which gather
//! over a tree of the vertices whose radii reach them. No atomics.
//!
//! # Not differentiable
//! As there. [`Cotangent::guarded`] counts the same: cells and vertices where a bounded derivative was taken, and numbers
//! that are not finite, for which 0 stands.

mod adjoint;
mod cells;
mod cells_pullback;
mod checks;
mod fits;
mod forward;
mod neighbor;
mod pullback;
mod samples;

pub use forward::forward;
pub use pullback::{Cotangent, pullback};

use cubecl::prelude::*;
use isograd::distance::extend as cpu;

use super::Mesh;
use crate::device::argument;
use crate::neighbors::Neighborhoods;
use crate::{Buffer, Scalar};

/// Components of an attribute that one kernel takes at a time.
const WIDTH: usize = 4;

/// Numbers of a fit; see [`Residual::fits`].
pub const FIT: usize = 8;

/// The samples whose attribute is extended.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a, T> {
    /// Their tree, which holds the points; the radii in it are not used.
    pub neighborhoods: &'a Neighborhoods<T>,
    /// Least radius `R` of the samples that a vertex takes its value from, in the unit of the points.
    pub radius: T,
    /// `(N,)` area of each, not negative; any common factor makes no difference.
    pub areas: &'a Buffer<T>,
}

/// A value per sample, with a fixed number of components.
#[derive(Clone, Copy, Debug)]
pub struct Attribute<'a, T> {
    /// `(N, components)`, row by row, in the order in which the points were given.
    pub values: &'a Buffer<T>,
    /// Number of components per sample, at least 1.
    pub components: usize,
}

/// The surface, and the grid around it.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a, T> {
    /// The surface itself.
    pub mesh: &'a Mesh<T>,
    /// The grid of φ.
    pub grid: &'a isograd::Grid<T>,
    /// `(nx, ny, nz)` signed distance to the surface.
    pub phi: &'a Buffer<T>,
    /// `(cells,)` closest face of each cell, or [`NO_TRIANGLE`](super::NO_TRIANGLE).
    pub closest: &'a Buffer<u32>,
}

/// An attribute at the vertices of a surface and at the cells around it: [`isograd::distance::extend::Extension`].
#[derive(Clone, Debug)]
pub struct Extension<T> {
    /// Components per value.
    pub components: usize,
    /// `(V, components)` at the vertices of the mesh, row by row.
    pub vertices: Buffer<T>,
    /// `(B,)` places in memory of the cells in the band, ascending.
    pub cells: Buffer<u32>,
    /// `(B, components)` at those cells, row by row.
    pub values: Buffer<T>,
}

/// [`Extension`] in kernels, but for the values at the cells.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct ExtensionArrays<F: Float + CubeElement> {
    pub vertices: Array<F>,
    pub cells: Array<u32>,
    pub components: u32,
}

argument!(
    Extension<T> => ExtensionArraysLaunch<T, R>:
    |of| of.vertices.arg(), of.cells.arg(), of.components as u32
);

/// Residual of the pullback, besides the inputs and the extension: [`isograd::distance::extend::Residual`].
#[derive(Clone, Debug)]
pub struct Residual<T> {
    /// `(V, 8)` the fit at each vertex: `R_v`, `W`, `m` and `s`, in the units of
    /// [`Fit`](isograd::distance::extend::Fit).
    pub fits: Buffer<T>,
    /// `(1,)` `a₀`, in the unit of the areas.
    pub smallest_area: Buffer<T>,
    /// `(B, 3)` barycentric coordinates of the closest point of each cell in the band.
    pub barycentric: Buffer<T>,
}

/// Errors of the extension.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Invalid input.
    #[error(transparent)]
    Refused(#[from] cpu::Error),
    /// The device can't, or fails.
    #[error(transparent)]
    Device(#[from] crate::Error),
}

impl<T: Scalar> Surface<'_, T> {
    fn faces(&self) -> usize {
        self.mesh.faces.len() / 3
    }

    fn vertices(&self) -> usize {
        self.mesh.vertices.len() / 3
    }
}

/// The columns that one kernel after the other takes: the first of them, and how many.
fn columns(components: usize) -> impl Iterator<Item = (usize, usize)> {
    let first = (0..components).step_by(WIDTH);
    first.map(move |first| (first, WIDTH.min(components - first)))
}
