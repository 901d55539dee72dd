//! The linear fit at one vertex: small pure functions in double precision.

use crate::element::fit;
use crate::vector::{add, dot, norm_squared, scale, sub};

/// Linear fit at one vertex; see [`extend`](super).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fit {
    /// `R_v`, in the unit of the points.
    pub radius: f64,
    /// `W`, in the unit of the areas.
    pub weight: f64,
    /// `m`: the weighted mean of the samples, seen from the vertex, in the unit of the points.
    pub mean: [f64; 3],
    /// `s`, in 1 over the unit of the points.
    pub tilt: [f64; 3],
}

/// A sample within the radius of a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbor {
    /// Its index.
    pub sample: u32,
    /// `d_j / R_v`.
    pub offset: [f64; 3],
    /// `w_j`, and once the fit is made `p_j`.
    pub weight: f64,
    /// `p_j t_j − p_j`, once the fit is made.
    pub correction: f64,
}

/// Fits a linear function to the samples around a vertex, and writes the weight of each.
pub(super) fn fit(radius: f64, neighbors: &mut [Neighbor]) -> Fit {
    let (mut weight, mut mean) = (0.0, [0.0; 3]);
    for n in &*neighbors {
        weight += n.weight;
        mean = add(mean, scale(n.offset, n.weight));
    }
    let mean = scale(mean, 1.0 / weight);
    for n in &mut *neighbors {
        n.weight /= weight;
        n.offset = sub(n.offset, mean);
    }
    let tilt = regularized(covariance(neighbors), mean, mean).unwrap_or_default();
    for n in neighbors {
        n.correction = -n.weight * dot(tilt, n.offset);
    }
    Fit {
        radius,
        weight,
        mean: scale(mean, radius),
        tilt: scale(tilt, 1.0 / radius),
    }
}

/// `C` as `xx, yy, zz, yz, xz, xy`, of neighbors with weights `p_j` and offsets `e_j`.
pub(super) fn covariance(neighbors: &[Neighbor]) -> [f64; 6] {
    let mut covariance = [0.0; 6];
    for n in neighbors {
        let [x, y, z] = n.offset;
        let products = [x * x, y * y, z * z, y * z, x * z, x * y];
        for k in 0..6 {
            covariance[k] += n.weight * products[k];
        }
    }
    covariance
}

/// `(C + ε I)⁻¹ b`, with the `ε` of `C` and `m`; none where all samples coincide.
pub(super) fn regularized(mut c: [f64; 6], m: [f64; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    let trace = c[0] + c[1] + c[2];
    let ridge = fit::ridge(trace, norm_squared(m) / trace);
    if !(ridge > 0.0) || !ridge.is_finite() {
        return None;
    }
    for k in 0..3 {
        c[k] += ridge;
    }
    Some(solve(c, b))
}

/// Solves `A x = b` for a symmetric positive definite `A`.
fn solve([xx, yy, zz, yz, xz, xy]: [f64; 6], b: [f64; 3]) -> [f64; 3] {
    let factors = fit::factors(xx, yy, zz, yz, xz, xy);
    fit::solved(factors, b.into()).into()
}
