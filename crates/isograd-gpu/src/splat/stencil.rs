//! Contribution of one sample to one cell.

use cubecl::prelude::*;

use crate::element::stencil::{Triple, bspline, hat};
use crate::spread::Spread;
use crate::vector::Vector3;

/// Cells between the cell of a sample and the outermost that it reaches.
pub(super) const REACH: u32 = 2;

/// Cells along each axis that it reaches.
pub(super) const WIDTH: u32 = 5;

/// Numbers of a sample in the form that is spread: offset `f` from the center of its cell, −½ to ½ cells, and
/// the vector `a n / h²`.
pub(super) const NUMBERS: usize = 6;

/// The central cell alone.
#[cube]
pub(super) fn central<F: Float>() -> Triple<F> {
    Triple::<F> {
        below: F::new(0.0),
        center: F::new(1.0),
        above: F::new(0.0),
    }
}

#[cube]
pub(super) fn sum<F: Float>(w: Triple<F>) -> F {
    w.below + w.center + w.above
}

/// Weights `w` under the mass, `M = (1, 4, 1)/6`, and under the derivative, `(D u)_p = (u_{p−1} − u_{p+1})/2`,
/// in one of the 5 cells.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Along<F: Float> {
    pub mass: F,
    pub slope: F,
}

#[cube]
pub(super) fn along<F: Float>(w: Triple<F>, cell: u32) -> Along<F> {
    let low = pick::<F>(w, cell);
    let here = pick::<F>(w, cell + 1u32);
    let high = pick::<F>(w, cell + 2u32);
    let sixth = F::new(1.0) / F::new(6.0);
    Along::<F> {
        mass: sixth * (low + high) + F::new(4.0) / F::new(6.0) * here,
        slope: F::new(0.5) * (low - high),
    }
}

/// The number of the cell `at − 3` cells from the central one: 0 beyond the three.
#[cube]
pub(crate) fn pick<F: Float>(w: Triple<F>, at: u32) -> F {
    let zero = F::new(0.0);
    let last = select(at == 4u32, w.above, zero);
    select(at == 2u32, w.below, select(at == 3u32, w.center, last))
}

/// The vector of sample `s`, spread by a product of weights, in the cell `(x, y, z) − 2` cells from its own.
#[cube]
fn term<F: Float>(
    samples: &Array<F>,
    s: usize,
    wx: Triple<F>,
    wy: Triple<F>,
    wz: Triple<F>,
    x: u32,
    y: u32,
    z: u32,
) -> F {
    let (x, y, z) = (along::<F>(wx, x), along::<F>(wy, y), along::<F>(wz, z));
    let at = s * NUMBERS + 3;
    let flat = samples[at] * x.slope * y.mass + samples[at + 1] * x.mass * y.slope;
    let steep = samples[at + 2] * x.mass * y.mass;
    flat * z.mass + steep * z.slope
}

/// By the quadratic B-spline.
pub(super) struct BSpline;

#[cube]
impl Spread for BSpline {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let f = Vector3::<F>::load(samples, s * NUMBERS);
        let (wx, wy, wz) = (bspline::<F>(f.x), bspline::<F>(f.y), bspline::<F>(f.z));
        term::<F>(samples, s, wx, wy, wz, x, y, z)
    }
}

/// By the paper's weights: a product, but for ½ in the central cell. The vector is over their sum.
pub(super) struct Paper;

#[cube]
impl Spread for Paper {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let f = Vector3::<F>::load(samples, s * NUMBERS);
        let (wx, wy, wz) = (hat::<F>(f.x), hat::<F>(f.y), hat::<F>(f.z));
        let product = term::<F>(samples, s, wx, wy, wz, x, y, z);
        let one = central::<F>();
        let center = term::<F>(samples, s, one, one, one, x, y, z);
        product + extra::<F>(wx, wy, wz) * center
    }
}

/// Excess of the central cell over the product of the paper's weights.
#[cube]
pub(super) fn extra<F: Float>(x: Triple<F>, y: Triple<F>, z: Triple<F>) -> F {
    F::new(0.5) - x.center * y.center * z.center
}

/// The sum of the paper's 27 weights.
#[cube]
pub(super) fn total<F: Float>(x: Triple<F>, y: Triple<F>, z: Triple<F>) -> F {
    sum::<F>(x) * sum::<F>(y) * sum::<F>(z) + extra::<F>(x, y, z)
}
