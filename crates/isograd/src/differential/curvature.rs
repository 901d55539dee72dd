//! Mean curvature at every cell.

use pulp::Arch;

use super::mean_curvature as element;
use super::rows::{self, Order, Rows, Stencil};
use crate::data::Field;
use crate::{Real, parallel};

/// How curvature is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Passes of `(1, 2, 1)/4` along each axis before `φ` is differenced; `m` passes are a Gaussian of
    /// `√(m/2)` cells. Default 2, one cell: what the distance to a triangle mesh needs. 0 suits a `φ` that
    /// is smooth by itself, such as a closed form.
    pub smoothing: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { smoothing: 2 }
    }
}

/// Memory of [`mean_curvature`], kept between calls: two values a cell where there is smoothing.
#[derive(Debug, Default)]
pub struct Scratch<T> {
    pub(super) smooth: Vec<T>,
    pub(super) other: Vec<T>,
}

/// `κ = div(∇φ/|∇φ|)` at every cell, per unit length, in memory order: the sum of the principal curvatures,
/// `+2/r` on a sphere of radius `r`. Within `±2/h`; 0 where the gradient is 0. Overwrites `out`, whose
/// memory is used again.
pub fn mean_curvature<T: Real>(
    phi: &Field<T>,
    options: &Options,
    scratch: &mut Scratch<T>,
    out: &mut Vec<T>,
) {
    let rows = if options.smoothing == 0 {
        Rows::of(phi)
    } else {
        smooth(phi, options.smoothing, scratch);
        Rows::new(&scratch.smooth, phi)
    };
    let [_, ny, nz] = rows.shape;
    let per_length = phi.grid().spacing().recip();
    out.resize(phi.values().len(), T::zero());
    parallel::each(out.chunks_exact_mut(ny * nz), |i, plane| {
        let mut buffers = Buffers::new(nz);
        crate::simd::vectorized!(Arch::new(), {
            for (j, out) in plane.chunks_exact_mut(nz).enumerate() {
                buffers.fill(&rows, [i, j]);
                for k in 0..nz {
                    out[k] = per_length * curvature(buffers.gradient(k), buffers.hessian(k));
                }
            }
        });
    });
}

/// `div(g/|g|)` from the gradient and the Hessian `[xx, yy, zz, xy, xz, yz]`, within ±2 (a sphere of radius
/// 1); 0 where the gradient is 0.
#[inline(always)]
pub(super) fn curvature<T: Real>(g: [T; 3], h: [T; 6]) -> T {
    let two = T::one() + T::one();
    let squared = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    if !(squared > T::zero()) || !squared.is_finite() {
        return T::zero();
    }
    let length = squared.sqrt();
    let n = [g[0] / length, g[1] / length, g[2] / length];
    let plain = element::plain(h[0], h[1], h[2], n[0], n[1], n[2]);
    let mixed = element::mixed(h[3], h[4], h[5], n[0], n[1], n[2]);
    element::curvature(plain, mixed, length).max(-two).min(two)
}

/// Derivatives of one row. The second ones are times `h`.
pub(super) struct Buffers<T> {
    first: [Vec<T>; 3],
    second: [Vec<T>; 6],
    /// `∂φ/∂y` on the rows that a difference along x needs.
    side: [Vec<T>; 3],
}

impl<T: Real> Buffers<T> {
    pub(super) fn new(n: usize) -> Self {
        Self {
            first: rows::buffers(n),
            second: rows::buffers(n),
            side: rows::buffers(n),
        }
    }

    #[inline(always)]
    pub(super) fn gradient(&self, k: usize) -> [T; 3] {
        [self.first[0][k], self.first[1][k], self.first[2][k]]
    }

    #[inline(always)]
    pub(super) fn hessian(&self, k: usize) -> [T; 6] {
        let s = &self.second;
        [s[0][k], s[1][k], s[2][k], s[3][k], s[4][k], s[5][k]]
    }

    #[inline(always)]
    pub(super) fn fill(&mut self, rows: &Rows<T>, at: [usize; 2]) {
        rows.gradient(at, &mut self.first);
        let [xx, yy, zz, xy, xz, yz] = &mut self.second;
        rows.across(Order::Second, 0, at, xx);
        rows.across(Order::Second, 1, at, yy);
        rows.along(Order::Second, at, zz);
        let stencil = Stencil::<T>::new(Order::First, rows.shape[0], at[0]);
        for (place, side) in stencil.at.into_iter().zip(&mut self.side) {
            rows.across(Order::First, 1, [place, at[1]], side);
        }
        let side = self.side.each_ref().map(|s| &s[..]);
        rows::combine(&self.first[1], side, stencil.weight, xy);
        rows::along(Order::First, &self.first[0], T::one(), xz);
        rows::along(Order::First, &self.first[1], T::one(), yz);
    }
}

/// Smooths `φ` into `scratch.smooth`: `u + ¼ δ²u` along each axis, `passes` times. At the walls the second
/// difference is the one-sided one, so that linear functions pass unchanged and nothing is bent there.
pub(super) fn smooth<T: Real>(phi: &Field<T>, passes: usize, scratch: &mut Scratch<T>) {
    let Scratch { smooth, other } = scratch;
    smooth.clear();
    smooth.extend_from_slice(phi.values());
    other.resize(smooth.len(), T::zero());
    let shape = phi.grid().shape();
    for axis in (0..passes).flat_map(|_| 0..3) {
        sweep(smooth, other, shape, axis);
        std::mem::swap(smooth, other);
    }
}

/// One pass along one axis.
fn sweep<T: Real>(values: &[T], out: &mut [T], shape: [usize; 3], axis: usize) {
    let quarter = T::of(0.25);
    let [_, ny, nz] = shape;
    parallel::each(out.chunks_exact_mut(ny * nz), |i, plane| {
        crate::simd::vectorized!(Arch::new(), {
            for (j, out) in plane.chunks_exact_mut(nz).enumerate() {
                let row = |i: usize, j: usize| &values[(i * ny + j) * nz..][..nz];
                let own = row(i, j);
                if axis == 2 {
                    rows::along(Order::Second, own, quarter, out);
                } else {
                    let at = [i, j][axis];
                    let stencil = Stencil::new(Order::Second, shape[axis], at);
                    let beside = |p: usize| if axis == 0 { row(p, j) } else { row(i, p) };
                    let weight = stencil.weight.map(|w: T| w * quarter);
                    rows::combine(own, stencil.at.map(beside), weight, out);
                }
                for k in 0..nz {
                    out[k] += own[k];
                }
            }
        });
    });
}
