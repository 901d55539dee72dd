//! Spread forms of the samples, and updates of fields cell by cell.

use cubecl::prelude::*;

use super::sample::{lowest, mean};
use crate::element::plate::least_area;
use crate::primitives::reduce::{BLOCK, sum_of_group};
use crate::splat::{bspline, bspline_slope, pick};
use crate::spread::Spread;
use crate::trilinear::tent;

/// Cells between that of a sample and the outermost that it reaches.
pub(super) const REACH: u32 = 1;

/// Numbers of a sample that is spread as a bump: offset from the center of its cell, and how much.
pub(super) const BUMP: usize = 4;

/// Numbers of a sample in the form that is spread back: offset; `m̄`; `w̄ n`; and for the 2³ cell centers around it
/// `y`, and `−y v`.
pub(super) const FORM: usize = 23;
pub(super) const OTHERS: usize = 7;
pub(super) const TAKEN: usize = 15;

/// By the product of quadratic B-splines.
pub(super) struct Bump;

#[cube]
impl Spread for Bump {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let at = s * BUMP;
        let wx = pick::<F>(bspline::<F>(samples[at]), x + 2u32);
        let wy = pick::<F>(bspline::<F>(samples[at + 1]), y + 2u32);
        let wz = pick::<F>(bspline::<F>(samples[at + 2]), z + 2u32);
        samples[at + 3] * wx * wy * wz
    }
}

/// `m̄ T + w̄ n·∇B`, with `T` the weights of linear interpolation.
pub(super) struct Tilt;

#[cube]
impl Spread for Tilt {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let at = s * FORM;
        let (fx, fy, fz) = (samples[at], samples[at + 1], samples[at + 2]);
        let level = tent::<F>(fx, x) * tent::<F>(fy, y) * tent::<F>(fz, z);
        let wx = pick::<F>(bspline::<F>(fx), x + 2u32);
        let wy = pick::<F>(bspline::<F>(fy), y + 2u32);
        let wz = pick::<F>(bspline::<F>(fz), z + 2u32);
        let sx = pick::<F>(bspline_slope::<F>(fx), x + 2u32);
        let sy = pick::<F>(bspline_slope::<F>(fy), y + 2u32);
        let sz = pick::<F>(bspline_slope::<F>(fz), z + 2u32);
        let flat = samples[at + 4] * sx * wy + samples[at + 5] * wx * sy;
        samples[at + 3] * level + flat * wz + samples[at + 6] * wx * wy * sz
    }
}

/// `y`.
pub(super) struct Others;

#[cube]
impl Spread for Others {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        of_side::<F>(samples, s * FORM, OTHERS, x, y, z)
    }
}

/// `−y v`.
pub(super) struct Taken;

#[cube]
impl Spread for Taken {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        of_side::<F>(samples, s * FORM, TAKEN, x, y, z)
    }
}

/// The number that a sample has for one of the 2³ cell centers around it, at `first` and after; 0 for the other
/// cells of the 3³.
#[cube]
fn of_side<F: Float>(
    samples: &Array<F>,
    at: usize,
    #[comptime] first: usize,
    x: u32,
    y: u32,
    z: u32,
) -> F {
    let (px, py, pz) = (
        lowest::<F>(samples[at]),
        lowest::<F>(samples[at + 1]),
        lowest::<F>(samples[at + 2]),
    );
    let mut part = F::new(0.0);
    let low = x >= px && y >= py && z >= pz;
    if low && x < px + 2u32 && y < py + 2u32 && z < pz + 2u32 {
        let side = ((x - px) * 2u32 + (y - py)) * 2u32 + (z - pz);
        part = samples[at + first + side as usize];
    }
    part
}

/// `χ − λ e`, into `out`; what it is taken off is `chi`, or what is in `out`.
#[cube(launch)]
pub(super) fn take_means<F: Float + CubeElement>(
    chi: &Array<F>,
    areas: &Array<F>,
    sums: &Array<F>,
    out: &mut Array<F>,
    gain: F,
    #[comptime] first: bool,
) {
    let at = ABSOLUTE_POS;
    if at < out.len() {
        let mut before = chi[at];
        if comptime!(!first) {
            before = out[at];
        }
        out[at] = before - gain * mean::<F>(sums, areas, at);
    }
}

/// `χ + λ e`, into `out`, and `Σ Ē_o e_o` a group at a time, with `Ē = −χ̄`, in the last places of `partial`.
#[cube(launch)]
pub(super) fn put_means_back<F: Float + CubeElement>(
    chi: &Array<F>,
    areas: &Array<F>,
    sums: &Array<F>,
    chi_bar: &Array<F>,
    out: &mut Array<F>,
    partial: &mut Array<F>,
    gain: F,
    #[comptime] first: bool,
) {
    let at = ABSOLUTE_POS;
    let mut product = F::new(0.0);
    if at < out.len() {
        let mut before = chi[at];
        if comptime!(!first) {
            before = out[at];
        }
        let e = mean::<F>(sums, areas, at);
        out[at] = before + gain * e;
        product = -(chi_bar[at] * e);
    }
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let total = sum_of_group::<F>(product, &mut shared);
    let own = CUBE_POS + partial.len() - (out.len() - 1) / BLOCK - 1;
    if UNIT_POS == 0 && own < partial.len() {
        partial[own] = total;
    }
}

/// From `ē`, but for what `χ̄` has for it, in `bars`: `ē/D` there, and `−e ē/D` in the place of `M`.
#[cube(launch)]
pub(super) fn pull_means<F: Float + CubeElement>(
    areas: &Array<F>,
    chi_bar: &Array<F>,
    bars: &mut Array<F>,
    sums: &mut Array<F>,
    gain: F,
) {
    let at = ABSOLUTE_POS;
    if at < bars.len() {
        let area = areas[at] + least_area::<F>();
        let bar = (bars[at] - gain * chi_bar[at]) / area;
        bars[at] = bar;
        sums[at] = -(bar * sums[at] / area);
    }
}
