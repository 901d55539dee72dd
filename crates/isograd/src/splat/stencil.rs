//! Contribution of one sample to the cells around it: small pure functions.
//!
//! Along each axis, weights on 3 cells become 5 numbers under the mass `M` and 5 under the derivative
//! `D`; the sample's part of `b` is made of products of those. Backwards, the same products gather.

use super::Weights;
use crate::Real;
use crate::element::stencil::{bspline, bspline_slope, hat, hat_slope};
use crate::vector::dot;

/// Cells along each axis to which one sample contributes.
pub(super) const WIDTH: usize = 5;

/// Cells between the central cell of a sample and the outermost to which it contributes.
pub(super) const REACH: usize = 2;

/// A vector spread over 3³ cells by a product of weights, as `b` sees it.
pub(super) struct Term<T> {
    vector: [T; 3],
    mass: [[T; WIDTH]; 3],
    slope: [[T; WIDTH]; 3],
}

impl<T: Real> Term<T> {
    #[inline(always)]
    fn new(vector: [T; 3], weights: [[T; 3]; 3]) -> Self {
        Self {
            vector,
            mass: weights.map(mass),
            slope: weights.map(slope),
        }
    }

    /// Contribution to the 5 cells along z of row `(i, j)` of the 5³ cells.
    #[inline(always)]
    pub(super) fn row(&self, i: usize, j: usize) -> [T; WIDTH] {
        let (mx, my, mz) = (self.mass[0][i], self.mass[1][j], &self.mass[2]);
        let (dx, dy, dz) = (self.slope[0][i], self.slope[1][j], &self.slope[2]);
        let [x, y, z] = self.vector;
        let (flat, steep) = (x * dx * my + y * mx * dy, z * mx * my);
        std::array::from_fn(|k| flat * mz[k] + steep * dz[k])
    }
}

/// Hands over the terms of a sample: `vector = a n / h²` at offset `f` from the center of its central
/// cell, in cells, −½ to ½.
#[inline(always)]
pub(super) fn for_each_term<T: Real>(
    weights: Weights,
    vector: [T; 3],
    f: [T; 3],
    mut visit: impl FnMut(Term<T>),
) {
    match weights {
        Weights::BSpline => visit(Term::new(vector, bspline_weights(f))),
        Weights::Paper => {
            // The weights as printed are a product, but for ½ in the central cell: a product, and a
            // second one that is zero elsewhere.
            let weights = hat_weights(f);
            let product = weights[0][1] * weights[1][1] * weights[2][1];
            let extra = T::of(0.5) - product;
            let total = weights
                .iter()
                .fold(T::one(), |p, w| p * (w[0] + w[1] + w[2]))
                + extra;
            let vector = vector.map(|v| v / total);
            let center = [T::zero(), T::one(), T::zero()];
            visit(Term::new(vector, weights));
            visit(Term::new(vector.map(|v| v * extra), [center; 3]));
        }
    }
}

/// 5³ cells around the central cell of a sample.
pub(super) type Block<T> = [[[T; WIDTH]; WIDTH]; WIDTH];

/// Values of the cells around a sample for it, in index space.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gathered<T> {
    /// Cotangent of the vector that was spread.
    pub spread: [T; 3],
    /// Cotangent of the sample's index coordinates.
    pub gradient: [T; 3],
}

/// The pullback of [`for_each_term`], summed over the cells: from their cotangents to those of the vector
/// and the offset.
#[inline(always)]
pub(super) fn gather<T: Real>(
    weights: Weights,
    vector: [T; 3],
    f: [T; 3],
    block: &Block<T>,
) -> Gathered<T> {
    match weights {
        Weights::BSpline => gather_product(vector, bspline_weights(f), bspline_slopes(f), block),
        Weights::Paper => gather_paper(vector, f, block),
    }
}

/// `(P + extra · C)/total`, by the rule of quotients: `P` spreads by the product of hats, `C` into the
/// central cell.
#[inline(always)]
fn gather_paper<T: Real>(vector: [T; 3], f: [T; 3], block: &Block<T>) -> Gathered<T> {
    let (weights, slopes) = (hat_weights(f), hat_slopes(f));
    let sum = |w: [T; 3]| w[0] + w[1] + w[2];
    let (sums, sum_slopes) = (weights.map(sum), slopes.map(sum));
    let extra = T::of(0.5) - weights[0][1] * weights[1][1] * weights[2][1];
    let total = sums[0] * sums[1] * sums[2] + extra;
    let center = [T::zero(), T::one(), T::zero()];
    let product = gather_product(vector, weights, slopes, block);
    let central = gather_product(vector, [center; 3], [[T::zero(); 3]; 3], block);
    let spread: [T; 3] =
        std::array::from_fn(|d| (product.spread[d] + extra * central.spread[d]) / total);
    let (whole, of_center) = (dot(vector, spread), dot(vector, central.spread));
    let gradient = std::array::from_fn(|a| {
        let others = |values: [T; 3]| values[(a + 1) % 3] * values[(a + 2) % 3];
        let extra_slope = -slopes[a][1] * others(weights.map(|w| w[1]));
        let total_slope = sum_slopes[a] * others(sums) + extra_slope;
        (product.gradient[a] + extra_slope * of_center - whole * total_slope) / total
    });
    Gathered { spread, gradient }
}

/// [`Gathered`] of weights that are a product, with these slopes.
#[inline(always)]
fn gather_product<T: Real>(
    v: [T; 3],
    weights: [[T; 3]; 3],
    slopes: [[T; 3]; 3],
    block: &Block<T>,
) -> Gathered<T> {
    // Under the mass and under the derivative: the weights, and their slopes in the offset.
    let (m, s) = (weights.map(mass), weights.map(slope));
    let (dm, ds) = (slopes.map(mass), slopes.map(slope));
    let mut out = Gathered::default();
    for i in 0..WIDTH {
        // Sums over z and y, named by the factors along y and z.
        let [mut mm, mut sm, mut ms] = [T::zero(); 3];
        let [mut dm_m, mut ds_m, mut dm_s] = [T::zero(); 3];
        let [mut m_dm, mut s_dm, mut m_ds] = [T::zero(); 3];
        for j in 0..WIDTH {
            let row = &block[i][j];
            let (zm, zs) = (along(row, &m[2]), along(row, &s[2]));
            let (zdm, zds) = (along(row, &dm[2]), along(row, &ds[2]));
            mm += m[1][j] * zm;
            sm += s[1][j] * zm;
            ms += m[1][j] * zs;
            dm_m += dm[1][j] * zm;
            ds_m += ds[1][j] * zm;
            dm_s += dm[1][j] * zs;
            m_dm += m[1][j] * zdm;
            s_dm += s[1][j] * zdm;
            m_ds += m[1][j] * zds;
        }
        let (mi, si, dmi, dsi) = (m[0][i], s[0][i], dm[0][i], ds[0][i]);
        out.spread[0] += si * mm;
        out.spread[1] += mi * sm;
        out.spread[2] += mi * ms;
        out.gradient[0] += v[0] * dsi * mm + dmi * (v[1] * sm + v[2] * ms);
        out.gradient[1] += v[0] * si * dm_m + mi * (v[1] * ds_m + v[2] * dm_s);
        out.gradient[2] += v[0] * si * m_dm + mi * (v[1] * s_dm + v[2] * m_ds);
    }
    out
}

/// `Σ_k row_k weight_k`.
#[inline(always)]
fn along<T: Real>(row: &[T; WIDTH], weight: &[T; WIDTH]) -> T {
    let mut sum = T::zero();
    for k in 0..WIDTH {
        sum += row[k] * weight[k];
    }
    sum
}

/// Weights of the quadratic B-spline on the cells below, at and above that of a sample, along each axis. By name: mapped
/// over an array, it is not inlined.
#[inline(always)]
pub(crate) fn bspline_weights<T: Real>([x, y, z]: [T; 3]) -> [[T; 3]; 3] {
    [bspline(x).into(), bspline(y).into(), bspline(z).into()]
}

/// Derivatives of [`bspline_weights`].
#[inline(always)]
pub(crate) fn bspline_slopes<T: Real>([x, y, z]: [T; 3]) -> [[T; 3]; 3] {
    [
        bspline_slope(x).into(),
        bspline_slope(y).into(),
        bspline_slope(z).into(),
    ]
}

/// The paper's weights on those cells, not normalized, along each axis.
#[inline(always)]
fn hat_weights<T: Real>(f: [T; 3]) -> [[T; 3]; 3] {
    f.map(|f| hat(f).into())
}

/// Derivatives of [`hat_weights`].
#[inline(always)]
fn hat_slopes<T: Real>(f: [T; 3]) -> [[T; 3]; 3] {
    f.map(|f| hat_slope(f).into())
}

/// `M u`, with `M = (1, 4, 1)/6`.
#[inline(always)]
fn mass<T: Real>([a, b, c]: [T; 3]) -> [T; WIDTH] {
    let (side, center) = (T::of(1.0 / 6.0), T::of(4.0 / 6.0));
    [
        side * a,
        center * a + side * b,
        side * (a + c) + center * b,
        side * b + center * c,
        side * c,
    ]
}

/// `D u`, with `(D u)_p = (u_{p−1} − u_{p+1})/2`.
#[inline(always)]
fn slope<T: Real>([a, b, c]: [T; 3]) -> [T; WIDTH] {
    let half = T::of(0.5);
    [-half * a, -half * b, half * (a - c), half * b, half * c]
}
