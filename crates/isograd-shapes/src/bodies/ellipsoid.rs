//! Ellipsoid with three different half-axes.

use std::f64::consts::PI;

use isograd_element::vector::norm;

use super::sphere::unit_sphere;
use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters};
use crate::surface::Surface;

/// Ellipsoid centered at the origin.
pub(crate) const KIND: Kind = Kind {
    name: "ellipsoid",
    summary: "ellipsoid centered at the origin; exact distance by a bracketed root, area by quadrature",
    parameters: &parameters! {
        "a" = 0.8 in POSITIVE, UNIT_OF_LENGTH, "half-axis along x";
        "b" = 0.5 in POSITIVE, UNIT_OF_LENGTH, "half-axis along y";
        "c" = 0.3 in POSITIVE, UNIT_OF_LENGTH, "half-axis along z";
    },
    time: None,
    build: |p| {
        let axes = [p[0], p[1], p[2]];
        Ok(Box::new(Ellipsoid { axes }))
    },
};

#[derive(Debug)]
struct Ellipsoid {
    axes: [Jet; 3],
}

impl Surface for Ellipsoid {
    fn patches(&self) -> usize {
        1
    }

    fn map(&self, _patch: usize, u: Jet, v: Jet) -> JetVector {
        let x = unit_sphere(u, v);
        std::array::from_fn(|k| x[k] * self.axes[k])
    }

    fn distance(&self, point: [f64; 3]) -> Option<f64> {
        Some(distance(self.axes.map(|a| a.value), point))
    }

    fn volume(&self) -> Option<f64> {
        let [a, b, c] = self.axes.map(|a| a.value);
        Some(4.0 / 3.0 * PI * a * b * c)
    }
}

/// Signed distance to the ellipsoid with half-axes `axes`, to rounding.
///
/// The closest point to `q` is `a_k² q_k/(t + a_k²)` with `t` the largest root of
/// `Σ (a_k q_k/(t + a_k²))² = 1`, a decreasing function right of its last pole (D. Eberly, "Distance
/// from a point to an ellipse, an ellipsoid, or a hyperellipsoid"). Bisection down to neighboring
/// floating-point numbers always converges.
fn distance(axes: [f64; 3], point: [f64; 3]) -> f64 {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| axes[j].total_cmp(&axes[i]));
    // Largest half-axis first, first octant, in units of the smallest half-axis.
    let smallest = axes[order[2]];
    let a = order.map(|k| axes[k] / smallest);
    let q = order.map(|k| point[k].abs() / smallest);
    let closest = closest_point(a, q);
    let inside = (0..3).map(|k| (q[k] / a[k]).powi(2)).sum::<f64>() < 1.0;
    let d = norm([q[0] - closest[0], q[1] - closest[1], q[2] - closest[2]]) * smallest;
    if inside { -d } else { d }
}

/// Closest point in the first octant; `a[0] ≥ a[1] ≥ a[2] = 1`.
fn closest_point(a: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    // t = s − 1, so that the last pole is at s = 0 and nothing cancels next to it.
    let gap = a.map(|x| x * x - 1.0);
    let term = |s: f64, k: usize| match q[k] {
        0.0 => 0.0,
        _ => a[k] * q[k] / (s + gap[k]),
    };
    let excess = |s: f64| (0..3).map(|k| term(s, k).powi(2)).sum::<f64>() - 1.0;
    // Bracket: the last term alone is 1 at `low`, and the sum is at most 1 at `high`.
    let (mut low, mut high) = (q[2], norm([a[0] * q[0], a[1] * q[1], a[2] * q[2]]));
    if q[2] == 0.0 && !(excess(0.0) > 0.0) {
        return on_the_medial_disc(a, gap, q);
    }
    loop {
        let middle = 0.5 * (low + high);
        if !(middle > low && middle < high) {
            break;
        }
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let s = 0.5 * (low + high);
    std::array::from_fn(|k| match q[k] {
        0.0 => 0.0,
        _ => a[k] * a[k] * q[k] / (s + gap[k]),
    })
}

/// Closest point for a point in the plane of the two larger axes and near the center, where the closest
/// point is not in that plane.
fn on_the_medial_disc(a: [f64; 3], gap: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    let mut closest = [0.0; 3];
    let mut rest = 1.0;
    for k in 0..2 {
        // Where gap is 0 the axes are equal and q must be 0 here: any direction is as close.
        if gap[k] > 0.0 {
            closest[k] = a[k] * a[k] * q[k] / gap[k];
            rest -= (closest[k] / a[k]).powi(2);
        }
    }
    closest[2] = rest.max(0.0).sqrt();
    closest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Distance by a fine scan of the surface.
    fn scanned(axes: [f64; 3], p: [f64; 3]) -> f64 {
        let n = 400;
        let mut best = f64::INFINITY;
        for i in 0..=n {
            for j in 0..2 * n {
                let (st, ct) = (PI * i as f64 / n as f64).sin_cos();
                let (sf, cf) = (PI * j as f64 / n as f64).sin_cos();
                let x = [axes[0] * st * cf, axes[1] * st * sf, axes[2] * ct];
                best = best.min(norm([x[0] - p[0], x[1] - p[1], x[2] - p[2]]));
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn distance_is_the_least_over_the_surface(
            axes in prop::array::uniform3(0.2f64..2.0),
            p in prop::array::uniform3(-2.5f64..2.5),
        ) {
            let d = distance(axes, p).abs();
            let seen = scanned(axes, p);
            // A scan can only overestimate, by a half step of 2·π/400 of arc.
            prop_assert!(d <= seen + 1e-12 && seen - d < 0.02, "{} {}", d, seen);
        }

        #[test]
        fn a_step_along_the_normal_is_the_distance(
            axes in prop::array::uniform3(0.2f64..2.0),
            x in prop::array::uniform3(-1.0f64..1.0),
            step in -0.9f64..3.0,
        ) {
            prop_assume!(norm(x) > 0.1);
            let unit = x.map(|c| c / norm(x));
            let foot: [f64; 3] = std::array::from_fn(|k| axes[k] * unit[k]);
            let slope: [f64; 3] = std::array::from_fn(|k| unit[k] / axes[k]);
            // Inside, a step below the least radius of curvature stays short of the medial axis.
            let (min, max) = axes.iter().fold((9.0f64, 0.0f64), |m, &a| (m.0.min(a), m.1.max(a)));
            let step = if step < 0.0 { step * min * min / max } else { step };
            let p: [f64; 3] = std::array::from_fn(|k| foot[k] + step * slope[k] / norm(slope));
            prop_assert!((distance(axes, p) - step).abs() < 1e-13 * (1.0 + max), "{} {}", distance(axes, p), step);
        }
    }

    #[test]
    fn distance_of_the_center_is_the_smallest_half_axis() {
        assert_eq!(distance([0.8, 0.5, 0.3], [0.0; 3]), -0.3);
        assert_eq!(distance([0.5; 3], [0.0; 3]), -0.5);
        // By hand: the closest point to (0.1, 0, 0) is at x = 0.25·0.1/0.16, out of the plane z = 0.
        assert!((distance([0.5, 0.5, 0.3], [0.1, 0.0, 0.0]) + 0.290_474).abs() < 1e-6);
        assert_eq!(distance([1.0; 3], [3.0, 0.0, 0.0]), 2.0);
    }
}
