//! The formulas of the pullback that the head of the stage promises, against finite differences.

use super::super::fit::{self, Neighbor};
use super::super::fit_pullback::Adjoint;
use super::*;
use crate::distance::tangent::tangent;
use crate::distance::triangle::{Feature, closest_point};
use crate::element::fit::kernel;
use crate::vector::{add, dot, norm_squared, scale, sub};

/// A vertex at `vertex`, samples round it with areas and one value each, and a radius held constant.
#[derive(Clone)]
struct Patch {
    points: Vec<[f64; 3]>,
    areas: Vec<f64>,
    values: Vec<f64>,
    vertex: [f64; 3],
}

const RADIUS: f64 = 1.3;

/// `ε₀` and `ε₁`.
const NOISE: f64 = 1e-5;
const FADING: f64 = 1.0 / 256.0;

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

    /// `x̄_j`, `ā_j` and `v̄_j` for `ū = 1`, as printed.
    fn pullback(&self) -> Vec<([f64; 3], f64, f64)> {
        let mut neighbors = self.neighbors();
        let fit = fit::fit(RADIUS, &mut neighbors);
        let (m, s) = (fit.mean, fit.tilt);
        let e = |n: &Neighbor| scale(n.offset, RADIUS);
        let v = |n: &Neighbor| self.values[n.sample as usize];
        let mean: f64 = neighbors.iter().map(|n| n.weight * v(n)).sum();
        let trace: f64 = neighbors
            .iter()
            .map(|n| n.weight * norm_squared(e(n)))
            .sum();
        let tau = norm_squared(m) / trace;
        let g = self.slope(&neighbors, trace * (NOISE + FADING * tau * tau));
        let of_trace = NOISE - FADING * tau * tau;
        let (t, rho) = (
            |n: &Neighbor| 1.0 - dot(s, e(n)),
            |n: &Neighbor| v(n) - mean - dot(g, e(n)),
        );
        let d_of = |n: &Neighbor| {
            let ridge = of_trace * norm_squared(e(n)) + 4.0 * FADING * tau * dot(m, e(n));
            rho(n) * t(n) + dot(g, s) * ridge
        };
        let d_mean: f64 = neighbors.iter().map(|n| n.weight * d_of(n)).sum();
        let of_sample = |n: &Neighbor| {
            let w_bar = (d_of(n) - d_mean) / fit.weight;
            let ridge = add(scale(m, 4.0 * FADING * tau), scale(e(n), 2.0 * of_trace));
            let through_fit = add(
                add(scale(g, -t(n)), scale(s, -rho(n))),
                scale(ridge, dot(g, s)),
            );
            let d = add(e(n), m);
            let rest = (1.0 - norm_squared(d) / (RADIUS * RADIUS)).max(0.0);
            let area = self.areas[n.sample as usize];
            let through_weight = w_bar * area * 4.0 / (RADIUS * RADIUS) * rest;
            let point = sub(scale(through_fit, n.weight), scale(d, through_weight));
            (point, w_bar * rest * rest, n.weight * t(n))
        };
        neighbors.iter().map(of_sample).collect()
    }

    /// `(C + ε I)⁻¹ Σ p e q` by Cramer's rule.
    fn slope(&self, neighbors: &[Neighbor], ridge: f64) -> [f64; 3] {
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        let mean: f64 = neighbors
            .iter()
            .map(|n| n.weight * self.values[n.sample as usize])
            .sum();
        for n in neighbors {
            let (e, q) = (
                scale(n.offset, RADIUS),
                self.values[n.sample as usize] - mean,
            );
            for i in 0..3 {
                b[i] += n.weight * e[i] * q;
                for j in 0..3 {
                    a[i][j] += n.weight * e[i] * e[j];
                }
            }
        }
        for k in 0..3 {
            a[k][k] += ridge;
        }
        let determinant = |a: [[f64; 3]; 3]| dot(a[0], crate::vector::cross(a[1], a[2]));
        std::array::from_fn(|k| {
            let mut replaced = a;
            replaced[k] = b;
            determinant(replaced) / determinant(a)
        })
    }
}

/// Central difference of `f` at 0.
fn slope_of(f: impl Fn(f64) -> f64) -> f64 {
    let step = 1e-5;
    (f(step) - f(-step)) / (2.0 * step)
}

#[test]
fn printed_pullback_of_the_fit_agrees_with_finite_differences() {
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
fn fast_pullback_of_the_fit_is_the_printed_one() {
    for (seed, away) in [(1, 0.0), (2, 0.2), (3, 0.5), (4, 0.8), (5, 1.1)] {
        let patch = Patch::new(seed, away);
        let mut neighbors = patch.neighbors();
        let mut contracted = patch.values.clone();
        let adjoint = Adjoint::new(RADIUS, &mut neighbors, &mut contracted);
        for (n, (point, area, value)) in neighbors.iter().zip(patch.pullback()) {
            let j = n.sample as usize;
            let share = adjoint.share(n, contracted[j], patch.areas[j]);
            // The printed one solves by Cramer's rule, with a condition number of about 1e5.
            let close =
                |a: f64, b: f64| assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} {b}");
            close(share.value, value);
            close(share.area, area);
            for a in 0..3 {
                close(share.offset[a] / RADIUS, point[a]);
            }
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

/// `q̄` and `ȳ_k` as printed, for `ū = 1`.
fn blend_pullback(q: [f64; 3], corners: [[f64; 3]; 3], u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let closest = closest_point(q, corners);
    let (o, beta) = (closest.offset, closest.barycentric);
    let feature = match closest.feature {
        Feature::Face => vec![0, 1, 2],
        Feature::Edge(k) => vec![k, (k + 1) % 3],
        Feature::Vertex(k) => vec![k],
    };
    let (first, others) = (feature[0], &feature[1..]);
    let e: Vec<[f64; 3]> = others
        .iter()
        .map(|&k| sub(corners[k], corners[first]))
        .collect();
    let delta: Vec<f64> = others.iter().map(|&k| u[k] - u[first]).collect();
    let gamma = match e.len() {
        0 => vec![],
        1 => vec![delta[0] / norm_squared(e[0])],
        _ => {
            let (a, b, c) = (norm_squared(e[0]), dot(e[0], e[1]), norm_squared(e[1]));
            let det = a * c - b * b;
            vec![
                (c * delta[0] - b * delta[1]) / det,
                (a * delta[1] - b * delta[0]) / det,
            ]
        }
    };
    let gradient = e
        .iter()
        .zip(&gamma)
        .fold([0.0; 3], |sum, (&e, &g)| add(sum, scale(e, g)));
    let mut corner_bar = [[0.0; 3]; 3];
    for (&k, &g) in others.iter().zip(&gamma) {
        corner_bar[k] = sub(scale(o, g), scale(gradient, beta[k]));
    }
    let total: f64 = gamma.iter().sum();
    corner_bar[first] = scale(add(scale(o, total), scale(gradient, beta[first])), -1.0);
    (gradient, corner_bar)
}

#[test]
fn printed_pullback_of_the_closest_point_agrees_with_finite_differences() {
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
        let (q_bar, corner_bar) = blend_pullback(q, corners, u);
        let fast = tangent(&closest, corners, u, 0.0);
        for a in 0..3 {
            // Rounding, times the condition of the face.
            assert!((fast.query[a] - q_bar[a]).abs() <= 1e-11);
            for k in 0..3 {
                assert!((fast.corners[k][a] - corner_bar[k][a]).abs() <= 1e-11);
            }
        }
        for a in 0..3 {
            let moved = |t: f64| {
                let mut q = q;
                q[a] += t;
                blended(q, corners, u)
            };
            // Second differences of a few tens, times the step squared; a vertex region may end nearby.
            assert!((q_bar[a] - slope_of(moved)).abs() <= 1e-6);
            for k in 0..3 {
                let moved = |t: f64| {
                    let mut corners = corners;
                    corners[k][a] += t;
                    blended(q, corners, u)
                };
                assert!((corner_bar[k][a] - slope_of(moved)).abs() <= 1e-6);
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}
