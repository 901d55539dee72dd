//! The splat: oriented samples → right-hand side of the Poisson equation.
//!
//! # Map
//! Each sample `i` of area `a_i` and outward unit normal `n_i` is spread over the 3×3×3 cells around it,
//! `V_o = Σ_i α_{o,i} a_i n_i / h²` (paper, eq. `V_field`), and `b = Σ_d D_d V_d` (eq. `rhs_discrete`):
//! `(D u)_p = (u_{p−1} − u_{p+1})/2` along `d`, mass `(1, 4, 1)/6` along the other two axes. `V` is never
//! stored: per axis the 3 weights become 5 numbers under the mass and 5 under the derivative, and the
//! sample's part of `b` on 5×5×5 cells is made of their products. Samples keep 2 cells off every wall, so
//! the operators' rows at the walls are never met. `Σ b = 0`, so the equation has a solution.
//!
//! `b` and `V` are in index space (no unit). The solution `χ` rises outward, by 1 where the areas are
//! right.
//!
//! # Residual
//! The order in which samples were visited (sorted by row of the grid), and the weights used. The inputs
//! are not copied: the pullback takes them again.
//!
//! # Pullback
//! `V̄_d = D_dᵀ b̄`, then a gather per sample: `n̄_i = Σ_o α V̄_o a_i/h²`, `ā_i = Σ_o α V̄_o·n_i/h²`,
//! `x̂̄_i = Σ_o ∇α (V̄_o·n_i) a_i/h²` in index coordinates `x̂ = (x − lower)/h`. As in the forward map, `V̄` is
//! never stored: [`pullback`] gathers from 5×5×5 cells of `b̄`.
//!
//! # Not differentiable
//! With [`Weights::BSpline`], nothing: `b` is continuously differentiable in the points. With
//! [`Weights::Paper`], `b` jumps where a sample crosses a cell face, and the derivative on its side
//! misses the jumps.

pub mod area;
mod blocks;
mod order;
mod pullback;
mod stencil;
#[cfg(test)]
mod tests;

use pulp::Arch;

use crate::{Field, Grid, Real, parallel, simd, vector};
pub(crate) use blocks::{blocks_near, forward_in_blocks};
pub use order::Scratch;
pub(crate) use order::central_cell;
pub(crate) use pullback::pullback_on;
pub use pullback::{PullbackScratch, SampleCotangent, pullback};
use stencil::{REACH, Term, WIDTH};
pub(crate) use stencil::{bspline_slopes, bspline_weights};

/// Planes across x that one task owns.
const SLAB: usize = 8;

/// How a sample is spread over the 3×3×3 cells around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weights {
    /// Product of quadratic B-splines: continuously differentiable in the point.
    #[default]
    BSpline,
    /// The paper's weights, exactly as printed (eqs. `alpha_normalized`, `alpha_product`): ½ for the
    /// central cell, `Π ½ max(0, 1 − |Δ|/2h)` for the others, over their sum. They jump when a point
    /// crosses a cell face.
    Paper,
}

/// Values that the pullback needs besides the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual {
    /// Indices of the samples, sorted by row of the grid.
    pub order: Vec<u32>,
    /// The weights that were used.
    pub weights: Weights,
}

/// Errors of the splat.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Points, normals and areas differ in number.
    #[error("{normals} normals and {areas} areas for {points} points; give one of each per point")]
    Count {
        /// Number of points.
        points: usize,
        /// Number of normals.
        normals: usize,
        /// Number of areas.
        areas: usize,
    },
    /// A sample is outside the grid or too close to a wall.
    #[error(
        "point {index} is at {position:.2?} cells from the low corner of the surface's grid of {shape:?} cells; every sample must be at least 2 cells inside: use more padding or larger bounds, smaller cells of the surface, or remove the point"
    )]
    Outside {
        /// Index of the point, from 0.
        index: usize,
        /// Its index coordinates.
        position: [f64; 3],
        /// Cells along each axis.
        shape: [usize; 3],
    },
    /// A normal or an area is NaN or infinite.
    #[error(
        "the normal or the area of point {index} is not finite; correct it, or remove the point"
    )]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
}

/// Oriented samples.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a, T> {
    /// `(N, 3)` points, in the user's unit.
    pub points: &'a [[T; 3]],
    /// `(N, 3)` outward unit normals.
    pub normals: &'a [[T; 3]],
    /// `(N,)` areas, in that unit squared.
    pub areas: &'a [T],
}

/// Splatted samples with the order in which they were visited, as the stages after the splat take them.
#[derive(Clone, Copy, Debug)]
pub struct SortedSamples<'a, T> {
    /// The samples, in input order.
    pub samples: Samples<'a, T>,
    /// The residual of [`forward`].
    pub order: &'a Residual,
}

/// Writes `b` on the grid of `b`, whose old values are lost. Areas are all 1 for no area weights: `χ` is then
/// scaled, not changed in shape, where the samples are even.
///
/// # Errors
/// As [`Error`] lists; `b` is then left as it was.
pub fn forward<T: Real>(
    samples: Samples<'_, T>,
    weights: Weights,
    scratch: &mut Scratch,
    residual: &mut Residual,
    b: &mut Field<T>,
) -> Result<(), Error> {
    samples.check()?;
    let grid = *b.grid();
    residual.weights = weights;
    scratch.sort(samples.points, &grid, &mut residual.order)?;
    let [nx, ny, nz] = grid.shape();
    let (arch, scratch, residual) = (Arch::new(), &*scratch, &*residual);
    let slabs = b.values_mut().chunks_mut(SLAB * ny * nz);
    parallel::each(slabs, |task, slab| {
        slab.fill(T::zero());
        let from = task * SLAB;
        let to = from + slab.len() / (ny * nz);
        // Samples up to two planes away reach into the slab.
        let near = scratch.planes(from.saturating_sub(REACH), nx.min(to + REACH), ny);
        let near = &residual.order[near];
        simd::vectorized!(arch, {
            for &i in near {
                samples.add(i as usize, &grid, weights, from, slab);
            }
        });
    });
    Ok(())
}

impl<T: Real> Samples<'_, T> {
    fn check(&self) -> Result<(), Error> {
        let points = self.points.len();
        if self.normals.len() != points || self.areas.len() != points {
            return Err(Error::Count {
                points,
                normals: self.normals.len(),
                areas: self.areas.len(),
            });
        }
        let bad = |i: usize| !vector::is_finite(self.normals[i]) || !self.areas[i].is_finite();
        match parallel::first(points, bad) {
            Some(index) => Err(Error::NotFinite { index }),
            None => Ok(()),
        }
    }

    /// Adds the contribution of sample `i` to the planes of `slab`, the first of which is plane `from`.
    #[inline(always)]
    fn add(&self, i: usize, grid: &Grid<T>, weights: Weights, from: usize, slab: &mut [T]) {
        let x = grid.to_index(self.points[i]);
        let Some(cell) = central_cell(grid.shape(), x) else {
            return;
        };
        let h = grid.spacing();
        // One division after the other: h² may underflow where a/h² is fine.
        let vector = vector::scale(self.normals[i], self.areas[i] / h / h);
        let f = std::array::from_fn(|a| x[a] - T::of_usize(cell[a]) - T::of(0.5));
        stencil::for_each_term(weights, vector, f, |term| {
            add_term(&term, cell, grid.strides(), from, slab);
        });
    }
}

/// Adds a term to the planes that `slab` owns of the 5³ cells round `cell`.
#[inline(always)]
fn add_term<T: Real>(
    term: &Term<T>,
    cell: [usize; 3],
    [plane, row, _]: [usize; 3],
    from: usize,
    slab: &mut [T],
) {
    let to = from + slab.len() / plane;
    let [x, y, z] = cell.map(|c| c - REACH);
    for p in x.max(from)..to.min(x + WIDTH) {
        for j in 0..WIDTH {
            let start = (p - from) * plane + (y + j) * row + z;
            let added = term.row(p - x, j);
            for (value, part) in slab[start..start + WIDTH].iter_mut().zip(added) {
                *value += part;
            }
        }
    }
}
