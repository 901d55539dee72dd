//! The pullbacks of the fit and of the closest point against finite differences.

use super::super::fit::{self, Neighbor};
use super::super::fit_pullback::Adjoint;
use super::*;
use crate::distance::tangent::tangent;
use crate::distance::triangle::closest_point;
use crate::element::fit::kernel;
use crate::vector::{dot, norm_squared, scale, sub};

/// A vertex at `vertex`, samples around it with areas and one value each, and a radius held constant.
#[derive(Clone)]
struct Patch {
    points: Vec<[f64; 3]>,
    areas: Vec<f64>,
    values: Vec<f64>,
    vertex: [f64; 3],
}

const RADIUS: f64 = 1.3;

impl Patch {
    /// A curved patch; far from the vertex where `away` is large.
    fn new(seed: u64, away: f64) -> Self {
        let mut random = Random::new(seed);
        let mut signed = || 2.0 * random.uniform() - 1.0;
        let points = (0..12).map(|_| {
            let [x, y] = [0.6 * signed(), 0.6 * signed()];
            [x + away, y, 0.2 * x * x - 0.1 * x * y + 0.02 * signed()]
        });
        let points: Vec<_> = points.collect();
        let areas = points.iter().map(|_| 1.5 + signed()).collect();
        let values = points.iter().map(|_| signed()).collect();
        Self {
            points,
            areas,
            values,
            vertex: [0.05, -0.02, 0.03],
        }
    }

    fn neighbors(&self) -> Vec<Neighbor> {
        let samples = self.points.iter().zip(&self.areas).enumerate();
        let neighbor = |(j, (&x, area)): (usize, (&[f64; 3], &f64))| {
            let offset = scale(sub(x, self.vertex), 1.0 / RADIUS);
            let weight = area * kernel(norm_squared(offset));
            Neighbor {
                sample: j as u32,
                offset,
                weight,
                correction: 0.0,
            }
        };
        samples.map(neighbor).collect()
    }

    fn value(&self) -> f64 {
        let mut neighbors = self.neighbors();
        fit::fit(RADIUS, &mut neighbors);
        neighbors
            .iter()
            .map(|n| (n.weight + n.correction) * self.values[n.sample as usize])
            .sum()
    }

    /// `x̄_j`, `ā_j` and `v̄_j` for `ū = 1`.
    fn pullback(&self) -> Vec<([f64; 3], f64, f64)> {
        let (mut neighbors, mut contracted) = (self.neighbors(), self.values.clone());
        let adjoint = Adjoint::new(RADIUS, &mut neighbors, &mut contracted);
        let samples = neighbors.iter().zip(&contracted).zip(&self.areas);
        let shares = samples.map(|((n, &q), &area)| adjoint.share(n, q, area));
        let bars = shares.map(|s| (scale(s.offset, 1.0 / RADIUS), s.area, s.value));
        bars.collect()
    }
}

/// Central difference of `f` at 0.
fn slope_of(f: impl Fn(f64) -> f64) -> f64 {
    let step = 1e-5;
    (f(step) - f(-step)) / (2.0 * step)
}

#[test]
fn pullback_of_the_fit_agrees_with_finite_differences() {
    for (seed, away) in [(1, 0.0), (2, 0.2), (3, 0.5), (4, 0.8)] {
        let patch = Patch::new(seed, away);
        let mut of_vertex = [0.0; 3];
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-6 * (1.0 + b.abs()), "{a} {b}");
        for (j, (point, area, value)) in patch.pullback().into_iter().enumerate() {
            let changed = |change: &dyn Fn(&mut Patch, f64)| {
                slope_of(|t| {
                    let mut patch = patch.clone();
                    change(&mut patch, t);
                    patch.value()
                })
            };
            for a in 0..3 {
                close(point[a], changed(&|p, t| p.points[j][a] += t));
            }
            close(area, changed(&|p, t| p.areas[j] += t));
            close(value, changed(&|p, t| p.values[j] += t));
            of_vertex = sub(of_vertex, point);
        }
        for a in 0..3 {
            let moved = |t: f64| {
                let mut patch = patch.clone();
                patch.vertex[a] += t;
                patch.value()
            };
            close(of_vertex[a], slope_of(moved));
        }
    }
}

#[test]
fn samples_that_all_coincide_with_the_vertex_have_no_slope_to_differentiate() {
    let mut patch = Patch::new(1, 0.0);
    patch.points.fill(patch.vertex);
    let (mut neighbors, mut contracted) = (patch.neighbors(), patch.values.clone());
    let adjoint = Adjoint::new(RADIUS, &mut neighbors, &mut contracted);
    assert!(adjoint.degenerate);
    for (n, &q) in neighbors.iter().zip(&contracted) {
        let share = adjoint.share(n, q, patch.areas[n.sample as usize]);
        assert_eq!((share.offset, share.value), ([0.0; 3], n.weight));
        assert!(share.area.is_finite());
    }
}

/// Value at the point of a triangle that is closest to `q`.
fn blended(q: [f64; 3], corners: [[f64; 3]; 3], values: [f64; 3]) -> f64 {
    dot(closest_point(q, corners).barycentric, values)
}

#[test]
fn pullback_of_the_closest_point_agrees_with_finite_differences() {
    let mut random = Random::new(11);
    let mut signed = || 2.0 * random.uniform() - 1.0;
    let mut seen = [0; 3];
    for _ in 0..600 {
        let mut point = || [signed(), signed(), signed()];
        let (q, corners, u) = (scale(point(), 2.0), [point(), point(), point()], point());
        let closest = closest_point(q, corners);
        let clear = closest.barycentric.iter().all(|&b| b == 0.0 || b > 0.05);
        let area = crate::vector::cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        if !clear || norm_squared(area) < 0.1 {
            continue;
        }
        seen[closest.barycentric.iter().filter(|&&b| b > 0.0).count() - 1] += 1;
        let bar = tangent(&closest, corners, u, 0.0);
        for a in 0..3 {
            let moved = |t: f64| {
                let mut q = q;
                q[a] += t;
                blended(q, corners, u)
            };
            // Second differences of a few tens, times the step squared; a vertex region may end nearby.
            assert!((bar.query[a] - slope_of(moved)).abs() <= 1e-6);
            for k in 0..3 {
                let moved = |t: f64| {
                    let mut corners = corners;
                    corners[k][a] += t;
                    blended(q, corners, u)
                };
                assert!((bar.corners[k][a] - slope_of(moved)).abs() <= 1e-6);
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}
