//! Thickening: samples on the two faces of a thin part, moved apart along their normals until it shows in the indicator.
//!
//! # Map
//! A part much thinner than a cell hardly shows in the indicator, for the steps of its two faces cancel; a lattice misses
//! it here and there, and it is in pieces that come and go as it moves. Its samples know how thick it is. With `ℓ` the
//! [width](crate::isosurface::local_level::Step) of the step of the indicator, `d = x_i − x_j`, `z = n_i·d` the depth of
//! sample `j` below the face of `i`, `r =` [`REACH`]` ℓ`, `|d| < r`, and areas `a_j`:
//! ```text
//! v_ij = a_j e(n_i·n_j) k(|d|²/r²)             samples of the face of i
//! w_ij = a_j e(−n_i·n_j) k(|d|²/r²) g(z/ℓ)     samples of the other face
//! t_i  = Σ_j w_ij z / Σ_j w_ij                 thickness of the part at sample i
//! s_i  = Σ_j w_ij / Σ_j v_ij                   how much there is of the other face
//! x'_i = x_i + ½ ℓ f(t_i/ℓ) c(s_i) n_i
//! ```
//! - `e(u) = (2u − 1)²` for `u > ½`, else 0: normals within 60° of the face's own, or of the opposite one;
//! - `k(q) = (1 − q)²`, as in the [areas](crate::splat::area);
//! - `g` rises smoothly from 0 at `z = −ℓ/4` to 1 at `z = 0`: what lies further outside is another part, across a gap;
//! - `f(t) = T − t` up to `T − B`, then `(T + B − t)²/4B`, and 0 from `T + B` on, with `B =` [`BLEND`] and `T =` [`least`];
//! - `c(s) = s(2 − s)`, and 1 from `s = 1` on.
//!
//! Each of them has a continuous derivative. At a rim half of either face is missing, and `s` stays about 1: the part is as
//! thick there as elsewhere, and its edge is blunt. A knife's edge would be where χ is flat, and its place would depend on
//! how it lies on the grid.
//!
//! # Residual
//! [`Sums`] of each sample.
//!
//! # Pullback
//! With `b = x̄'`, `p = ½ b·n`: `f̄ = ℓ p c`, `c̄ = ℓ p f`; from these `t̄`, `s̄`, and the cotangents `σ`, `ζ`, `υ` of `Σ w`,
//! `Σ w z`, `Σ v`. A pair of opposite faces has `w̄ = σ + ζ z`, one of the same face `w̄ = υ`, and
//! ```text
//! z̄ = ζ w + w̄ ∂w/∂z      ū = w̄ ∂w/∂u      d̄ = z̄ n_i + 2 w̄ ∂w/∂|d|² d
//! x̄_i += d̄   x̄_j −= d̄   n̄_i += z̄ d + ū n_j   n̄_j += ū n_i   ā_j += w̄ w/a_j
//! ```
//! and `x̄_i += b`, `n̄_i += ½ ℓ f c b`. The map is homogeneous in lengths, so `ℓ ℓ̄ = Σ b·(x' − x) − Σ d̄·d − 2 Σ ā a`.
//! [`pullback`] gathers: a sample adds its own pairs and those in which it is the other one. `T̄ = −Σ f̄ f'`, since `f` depends
//! on `T − t`.
//!
//! # Not differentiable
//! Nothing; second derivatives jump.

mod forward;
mod pair;
mod pullback;
#[cfg(test)]
mod tests;

pub(crate) use forward::{Thickened, forward};
pub(crate) use pullback::pullback;

use crate::neighbors::{Candidates, CellIndex, LANES};
use crate::splat::Samples;
use crate::vector::{dot, to_f64};
use crate::{Real, parallel, simd};

/// Radius within which the other face is sought, in widths.
const REACH: f64 = 2.5;

/// Thickness, in widths, that thinner parts are given.
const LEAST: f64 = 1.0;

/// Least thickness of any part, in cells of the lattice that the surface is marched on. Thinner plates, tilted against the
/// lattice and with noise of a twentieth of a cell, have holes: a layer of lattice points is connected in every direction from
/// √3 cells on, and from less where the indicator is smooth.
const LEAST_CELLS: f64 = 1.5;

/// Half of the range of thicknesses over which parts begin to be thickened, in widths.
const BLEND: f64 = 0.4;

/// Distance between samples, in widths, below which they stay where they are: with more than a thousand pairs a sample,
/// this stage would take longer than all others.
pub(crate) const LEAST_SPACING: f64 = 1.0 / 6.0;

/// Samples in input order, with the index of their points.
#[derive(Clone, Copy)]
pub(crate) struct Inputs<'a, T> {
    pub index: &'a CellIndex<T>,
    pub samples: Samples<'a, T>,
    /// `ℓ`, in the unit of the points.
    pub width: f64,
    /// `T`, in widths.
    pub least: f64,
}

/// `T` for a step of this width, in cells that the surface is marched on, and its derivative.
pub(crate) fn least(width: f64) -> [f64; 2] {
    match LEAST * width < LEAST_CELLS {
        true => [LEAST_CELLS / width, -LEAST_CELLS / width.powi(2)],
        false => [LEAST, 0.0],
    }
}

/// Sums over the pairs of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// `Σ w`, in the unit of the areas.
    pub weight: f64,
    /// `Σ w z`.
    pub depth: f64,
    /// `Σ v`, with the sample itself, for which `v = a`.
    pub own: f64,
}

impl<T: Real> Inputs<'_, T> {
    fn sample(&self, i: usize) -> pair::Sample {
        pair::Sample {
            point: to_f64(self.samples.points[i]),
            normal: to_f64(self.samples.normals[i]),
            area: self.samples.areas[i].f64(),
        }
    }

    /// `(N,)` whether any sample within reach of each has such values, `test(position of the sample, values)`; positions and
    /// `values` are in sorted order. Much faster than to visit them.
    fn any_near<const M: usize>(
        &self,
        values: [&[T]; M],
        test: &(impl Fn(usize, [T; M]) -> bool + Sync),
    ) -> Vec<bool> {
        let (reach, arch) = (T::of(REACH * self.width), pulp::Arch::new());
        let mut found = vec![false; self.index.len()];
        self.index
            .for_each_cell(reach, values, &mut found, &|cell, candidates, found| {
                for (position, found) in cell.zip(found) {
                    let point = self.index.point(position);
                    *found = simd::vectorized!(
                        arch,
                        any_of(
                            candidates,
                            point,
                            reach,
                            #[inline(always)]
                            |values| test(position, values),
                        )
                    );
                }
            });
        let mut in_order = vec![false; found.len()];
        for (&i, found) in self.index.order().iter().zip(found) {
            in_order[i as usize] = found;
        }
        in_order
    }

    /// Values of all samples, in sorted order.
    fn sorted(&self, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let order = self.index.order();
        parallel::map(order.len(), |position| value(order[position] as usize))
    }

    /// Calls `visit` for the other samples within reach of sample `i` whose normals are within 60° of its own, or of the
    /// opposite one.
    fn for_each_near(&self, i: usize, mut visit: impl FnMut(usize)) {
        let reach = T::of(REACH * self.width);
        let Samples {
            points, normals, ..
        } = self.samples;
        let limit = T::of(0.5);
        self.index.for_each_within(points[i], reach, |j, _| {
            if j != i && dot(normals[i], normals[j]).abs() > limit {
                visit(j);
            }
        });
    }
}

/// Whether any candidate within a radius has such values.
#[inline(always)]
fn any_of<T: Real, const M: usize>(
    candidates: &Candidates<T, M>,
    point: [T; 3],
    radius: T,
    test: impl Fn([T; M]) -> bool,
) -> bool {
    let mut any = [false; LANES];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            for (l, any) in any.iter_mut().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - point[a]);
                let is_near = x * x + y * y + z * z <= lanes.limit[l];
                *any |= is_near & test(lanes.values.map(|values| values[l]));
            }
        },
    );
    any.contains(&true)
}
