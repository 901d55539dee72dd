//! What one sample adds to the cells round it: small pure functions.
//!
//! Along each axis, weights on 3 cells become 5 numbers under the mass `M` and 5 under the derivative
//! `D`; the sample's part of `b` is made of products of those.

use super::Weights;
use crate::Real;

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

    /// What is added to the 5 cells along z of row `(i, j)` of the 5³ cells.
    #[inline(always)]
    pub(super) fn row(&self, i: usize, j: usize) -> [T; WIDTH] {
        let (mx, my, mz) = (self.mass[0][i], self.mass[1][j], &self.mass[2]);
        let (dx, dy, dz) = (self.slope[0][i], self.slope[1][j], &self.slope[2]);
        let [x, y, z] = self.vector;
        let (flat, steep) = (x * dx * my + y * mx * dy, z * mx * my);
        std::array::from_fn(|k| flat * mz[k] + steep * dz[k])
    }
}

/// Hands over the terms of a sample: `vector = a n / h²` at offset `f` from the centre of its central
/// cell, in cells, −½ to ½.
#[inline(always)]
pub(super) fn for_each_term<T: Real>(
    weights: Weights,
    vector: [T; 3],
    f: [T; 3],
    mut visit: impl FnMut(Term<T>),
) {
    match weights {
        Weights::BSpline => visit(Term::new(vector, f.map(quadratic_bspline))),
        Weights::Paper => {
            // The weights as printed are a product, but for ½ in the central cell: a product, and a
            // second one that is zero elsewhere.
            let weights = f.map(hat);
            let product = weights[0][1] * weights[1][1] * weights[2][1];
            let extra = T::of(0.5) - product;
            let total = weights
                .iter()
                .fold(T::one(), |p, w| p * (w[0] + w[1] + w[2]))
                + extra;
            let vector = vector.map(|v| v / total);
            let centre = [T::zero(), T::one(), T::zero()];
            visit(Term::new(vector, weights));
            visit(Term::new(vector.map(|v| v * extra), [centre; 3]));
        }
    }
}

/// Weights of the quadratic B-spline on the cell below, the central cell and the cell above.
#[inline(always)]
pub(super) fn quadratic_bspline<T: Real>(f: T) -> [T; 3] {
    let half = T::of(0.5);
    let (below, above) = (half - f, half + f);
    [
        half * below * below,
        T::of(0.75) - f * f,
        half * above * above,
    ]
}

/// `½ max(0, 1 − |Δ|/2)` on the cell below, the central cell and the cell above (paper, eq.
/// `alpha_product`, not normalised); `Δ` is the distance to the cell's centre in cells.
#[inline(always)]
pub(super) fn hat<T: Real>(f: T) -> [T; 3] {
    let half = T::of(0.5);
    [-T::one(), T::zero(), T::one()]
        .map(|centre| half * (T::one() - half * (f - centre).abs()).max(T::zero()))
}

/// `M u`, with `M = (1, 4, 1)/6`.
#[inline(always)]
fn mass<T: Real>([a, b, c]: [T; 3]) -> [T; WIDTH] {
    let (side, centre) = (T::of(1.0 / 6.0), T::of(4.0 / 6.0));
    [
        side * a,
        centre * a + side * b,
        side * (a + c) + centre * b,
        side * b + centre * c,
        side * c,
    ]
}

/// `D u`, with `(D u)_p = (u_{p−1} − u_{p+1})/2`.
#[inline(always)]
fn slope<T: Real>([a, b, c]: [T; 3]) -> [T; WIDTH] {
    let half = T::of(0.5);
    [-half * a, -half * b, half * (a - c), half * b, half * c]
}
