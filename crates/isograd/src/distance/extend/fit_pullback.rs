//! The pullback of the linear fit at one vertex, in double precision.
//!
//! All lengths are in units of `R_v`, as in [`fit`]: the formulas at the head of [`extend`](super) hold in any
//! unit.

use super::fit::{self, Neighbor};
use super::rule::{MARGIN, REACH};
use crate::element::fit as element;
use crate::vector::{add, dot, norm_squared, scale};

/// Cotangents of one sample from the fit at one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Share {
    /// `p_j t_j`: factor of `ū_v` in the cotangent of the sample's value.
    pub value: f64,
    /// `d̄_j`, times `R_v`.
    pub offset: [f64; 3],
    /// `w̄_j K(r_j)`.
    pub area: f64,
}

/// Adjoint of the fit at a vertex, from neighbors with weights `w_j`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Adjoint {
    /// `W`, `m` and `s`.
    weight: f64,
    mean: [f64; 3],
    tilt: [f64; 3],
    /// `g`.
    slope: [f64; 3],
    /// `4 ε₁ τ` and `ε₀ − ε₁ τ²`, both times `g·s`.
    ridge: [f64; 2],
    /// `Σ p_k D_k`.
    mean_pull: f64,
    /// Whether the fit has no slope because all samples coincide.
    pub degenerate: bool,
}

impl Adjoint {
    /// Makes the fit, which turns the weights of the neighbors into `p_j`, and its adjoint. `contracted` holds
    /// `ū_v v_j` for each of them, and then `q_j`.
    pub(super) fn new(radius: f64, neighbors: &mut [Neighbor], contracted: &mut [f64]) -> Self {
        let made = fit::fit(radius, neighbors);
        let (mean, tilt) = (scale(made.mean, 1.0 / radius), scale(made.tilt, radius));
        let samples = || neighbors.iter().zip(&*contracted);
        let middle: f64 = samples().map(|(n, v)| n.weight * v).sum();
        for q in &mut *contracted {
            *q -= middle;
        }
        let samples = || neighbors.iter().zip(&*contracted);
        let (mut trace, mut moment) = (0.0, [0.0; 3]);
        for (n, q) in samples() {
            trace += n.weight * norm_squared(n.offset);
            moment = add(moment, scale(n.offset, n.weight * q));
        }
        let slope = fit::regularized(fit::covariance(neighbors), mean, moment);
        let tau = norm_squared(mean) / trace;
        let along = slope.map_or(0.0, |g| dot(g, tilt));
        let ridge = match slope {
            Some(_) => [
                element::ridge_of_mean(tau, along),
                element::ridge_of_offset(tau, along),
            ],
            None => [0.0; 2],
        };
        let mut adjoint = Self {
            weight: made.weight,
            mean,
            tilt,
            slope: slope.unwrap_or_default(),
            ridge,
            mean_pull: 0.0,
            degenerate: slope.is_none(),
        };
        adjoint.mean_pull = samples().map(|(n, &q)| n.weight * adjoint.pull(n, q)).sum();
        adjoint
    }

    /// `D_j`.
    #[inline(always)]
    fn pull(&self, n: &Neighbor, q: f64) -> f64 {
        let e = n.offset;
        let (t, rho) = (1.0 - dot(self.tilt, e), q - dot(self.slope, e));
        let [of_mean, of_offset] = self.ridge;
        element::pull(
            rho,
            t,
            norm_squared(e),
            dot(self.mean, e),
            of_offset,
            of_mean,
        )
    }

    /// `d_j / R_v`.
    pub(super) fn offset(&self, n: &Neighbor) -> [f64; 3] {
        add(n.offset, self.mean)
    }

    /// The sample whose distance a radius that has grown is a multiple of, and its `d_k / R_v`.
    pub(super) fn last_within(&self, neighbors: &[Neighbor]) -> Option<(u32, [f64; 3])> {
        let error = |offset: &[f64; 3]| {
            let length = norm_squared(*offset).sqrt();
            let [by_reach, by_margin] = [REACH, MARGIN].map(|factor| (factor * length - 1.0).abs());
            by_reach.min(by_margin)
        };
        let offsets = neighbors.iter().map(|n| (n.sample, self.offset(n)));
        let found = offsets.min_by(|(_, a), (_, b)| error(a).total_cmp(&error(b)))?;
        (norm_squared(found.1) > 0.0).then_some(found)
    }

    /// Cotangents of a neighbor: `q` is its `q_j`, `area` is `a_j + a₀`.
    #[inline(always)]
    pub(super) fn share(&self, n: &Neighbor, q: f64, area: f64) -> Share {
        let e = n.offset;
        let (t, rho) = (1.0 - dot(self.tilt, e), q - dot(self.slope, e));
        let w_bar = (self.pull(n, q) - self.mean_pull) / self.weight;
        let [of_mean, of_offset] = self.ridge;
        let through_fit: [f64; 3] = std::array::from_fn(|k| {
            let of_ridge = element::ridge_bar(self.mean[k], of_mean, e[k], of_offset);
            element::fit_bar(self.slope[k], t, self.tilt[k], rho, of_ridge)
        });
        let d = self.offset(n);
        let rest = element::rest(norm_squared(d));
        Share {
            value: n.weight + n.correction,
            offset: add(
                scale(through_fit, n.weight),
                scale(d, element::radial(w_bar, area, rest)),
            ),
            area: w_bar * rest * rest,
        }
    }
}
