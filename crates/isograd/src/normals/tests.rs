//! Oracles: plain sums over all points, closed forms, and finite differences.

use rayon::ThreadPoolBuilder;

use super::forward::EPSILON;
use super::{Residual, forward, forward_with_neighborhoods};
use crate::element::eigen::eigen;
use crate::neighbors::tests::{Random, even_sphere, torus, ugly_clouds};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::{Real, vector};

fn axes<T: Real>(points: &[[T; 3]]) -> (Neighborhoods<T>, Residual<T>) {
    let (mut neighborhoods, mut residual) = Default::default();
    neighbors::forward(points, Radius::Auto, &mut neighborhoods).expect("a valid cloud");
    forward(&neighborhoods, &mut residual);
    (neighborhoods, residual)
}

/// Members of a neighborhood, relative to its center.
fn members<T: Real>(points: &[[T; 3]], i: usize, radius: T) -> Vec<(usize, [f64; 3])> {
    let offsets = points
        .iter()
        .map(|&p| vector::sub(p, points[i]))
        .enumerate();
    let within = offsets.filter(|&(_, d)| vector::norm_squared(d) <= radius * radius);
    within.map(|(j, d)| (j, vector::to_f64(d))).collect()
}

/// `w` and `−dw/dr` as the module's page prints them.
fn weight(r: f64, radius: f64) -> (f64, f64) {
    let t = (5.0 * (1.0 - r / radius)).clamp(0.0, 1.0);
    let (s, fall) = (t * t * (3.0 - 2.0 * t), 30.0 * t * (1.0 - t) / radius);
    let w = 1.0 / (r + EPSILON * radius);
    (s * w, fall * w + s * w * w)
}

/// `W`, `m` and `C` as the module's page prints them.
fn covariance(members: &[(usize, [f64; 3])], radius: f64) -> (f64, [f64; 3], [f64; 6]) {
    let weighted = || {
        members
            .iter()
            .map(|&(_, d)| (weight(vector::norm(d), radius).0, d))
    };
    let total: f64 = weighted().map(|(w, _)| w).sum();
    let m = [0, 1, 2].map(|a| weighted().map(|(w, d)| w * d[a]).sum::<f64>() / total);
    let element = |a: usize, b: usize| {
        weighted()
            .map(|(w, d)| w * (d[a] - m[a]) * (d[b] - m[b]))
            .sum::<f64>()
            / total
    };
    let c = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(a, b)| element(a, b));
    (total, m, c)
}

fn planes_agree_with_plain_sums<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let found = axes(&points).1;
        for (i, plane) in found.planes.iter().enumerate() {
            let radius = found.radius[i].f64();
            let (weight, m, c) = covariance(&members(&points, i, found.radius[i]), radius);
            // Sums of up to a few hundred terms, each rounded a few times.
            let tolerance = 300.0 * T::epsilon().f64();
            let size = tolerance * radius * radius;
            assert!(
                (plane.weight.f64() / weight - 1.0).abs() < tolerance,
                "{name}, point {i}"
            );
            let [l1, l2, l3] = vector::to_f64(plane.eigenvalues);
            let n = vector::to_f64(found.normals[i]);
            let [v2, v3] = plane.tangents.map(vector::to_f64);
            for (k, (a, b)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
                .into_iter()
                .enumerate()
            {
                let rebuilt = l1 * n[a] * n[b] + l2 * v2[a] * v2[b] + l3 * v3[a] * v3[b];
                assert!(
                    (rebuilt - c[k]).abs() < size,
                    "{name}, point {i}: {rebuilt} for {}",
                    c[k]
                );
            }
            for a in 0..3 {
                assert!(
                    (plane.centroid[a].f64() - m[a]).abs() < tolerance * radius,
                    "{name}, point {i}"
                );
            }
        }
    }
}

#[test]
fn planes_agree_with_plain_sums_in_f32_and_f64() {
    planes_agree_with_plain_sums::<f32>();
    planes_agree_with_plain_sums::<f64>();
}

#[test]
fn normals_are_unit_with_their_largest_component_positive() {
    for (name, points) in ugly_clouds::<f32>() {
        for (i, &n) in axes(&points).1.normals.iter().enumerate() {
            assert!(
                (vector::norm(n) - 1.0).abs() < 1e-6,
                "{name}, point {i}: {n:?}"
            );
            let largest = n
                .into_iter()
                .fold(0.0, |m: f32, x| if x.abs() > m.abs() { x } else { m });
            assert!(largest > 0.0, "{name}, point {i}: {n:?}");
        }
    }
}

#[test]
fn one_walk_gives_the_bits_that_two_give() {
    for (name, points) in ugly_clouds::<f32>() {
        let (two, residual) = axes(&points);
        let (mut one, mut found) = <(Neighborhoods<f32>, Residual<f32>)>::default();
        forward_with_neighborhoods(&points, Radius::Auto, &mut one, &mut found).expect(name);
        assert_eq!(found.normals, residual.normals, "{name}");
        assert_eq!(found.planes, residual.planes, "{name}");
        assert_eq!((one.radius, one.count), (two.radius, two.count), "{name}");
    }
}

/// Mean angle in degrees between axes and true normals.
fn mean_angle(found: &[[f32; 3]], truth: &[[f64; 3]]) -> f64 {
    let angle = |(&n, &t): (&[f32; 3], &[f64; 3])| {
        let sine = vector::norm(vector::cross(vector::to_f64(n), t));
        sine.min(1.0).asin().to_degrees()
    };
    found.iter().zip(truth).map(angle).sum::<f64>() / found.len() as f64
}

#[test]
fn torus_normals_are_right_at_even_and_at_ten_to_one_density() {
    let all = torus(40_000, 1);
    let mut random = Random::new(2);
    let mut thinned = all.clone();
    // Density 10 at one end, 1 at the other.
    thinned.retain(|(p, _)| random.uniform() < 0.1 + 0.9 * (p[0] + 0.95) / 1.9);
    for (name, samples, bound) in [("even", all, 0.8), ("10:1", thinned, 1.1)] {
        let points: Vec<[f32; 3]> = samples.iter().map(|s| vector::of_f64(s.0)).collect();
        let truth: Vec<[f64; 3]> = samples.iter().map(|s| s.1).collect();
        // What a plane through 24 random samples of a curved surface leaves: 0.68 and 0.92 when written.
        let error = mean_angle(&axes(&points).1.normals, &truth);
        assert!(error < bound, "{name}: {error} degrees");
    }
}

#[test]
fn normals_of_a_plane_without_noise_are_right_to_rounding() {
    let mut random = Random::new(4);
    let normal = [2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0];
    let points: Vec<[f64; 3]> = (0..500)
        .map(|_| {
            let p = [0; 3].map(|_| random.uniform());
            vector::sub(p, vector::scale(normal, vector::dot(p, normal)))
        })
        .collect();
    for n in axes(&points).1.normals {
        // Rounding of coordinates of size 1 over a radius of 0.1.
        assert!(vector::norm(vector::cross(n, normal)) < 1e-14, "{n:?}");
    }
}

#[test]
fn moving_a_cloud_far_from_the_origin_changes_no_bit() {
    // Multiples of 1/8 below 64, so that f32 holds them exactly at 2²⁰ as well.
    let round = |x: f64| ((x + 1.0) * 250.0).round() as f32 / 8.0;
    let near: Vec<[f32; 3]> = torus(3000, 6).iter().map(|s| s.0.map(round)).collect();
    let far: Vec<[f32; 3]> = near.iter().map(|p| p.map(|x| x + 1_048_576.0)).collect();
    let (near, far) = (axes(&near).1, axes(&far).1);
    assert_eq!(near.normals, far.normals);
    assert_eq!(near.planes, far.planes);
}

#[test]
fn points_on_a_line_are_guarded_and_those_of_a_sphere_are_not() {
    let line: Vec<[f32; 3]> = (0..100).map(|i| [i as f32, 2.0 * i as f32, 0.0]).collect();
    assert_eq!(axes(&line).1.guarded(), 100);
    let tiny: Vec<[f32; 3]> = (0..100)
        .map(|i| [(i == 0) as u8 as f32, 1e-21 * i as f32, 0.0])
        .collect();
    let found = axes(&tiny).1;
    let finite = |n: &[f32; 3]| (vector::norm(*n) - 1.0).abs() < 1e-6;
    assert!(found.normals.iter().all(finite) && found.planes.iter().all(|p| p.weight.is_finite()));
    let sphere: Vec<[f32; 3]> = even_sphere(2000)
        .iter()
        .map(|&p| vector::of_f64(p))
        .collect();
    assert_eq!(axes(&sphere).1.guarded(), 0);
}

#[test]
fn same_bits_for_any_number_of_threads_and_in_used_memory() {
    let points: Vec<[f32; 3]> = torus(9000, 8).iter().map(|s| vector::of_f64(s.0)).collect();
    let (neighborhoods, mut reused) = axes(&points);
    let run = |threads: usize, out: &mut Residual<f32>| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| forward(&neighborhoods, out));
        (out.normals.clone(), out.planes.clone(), out.radius.clone())
    };
    let one = run(1, &mut Residual::default());
    assert_eq!(one, run(2, &mut reused));
    assert_eq!(one, run(5, &mut reused));
}

/// The pullback as the module's page prints it, from the residual alone.
fn pullback(
    members: &[(usize, [f64; 3])],
    radius: f64,
    (normal, plane): ([f64; 3], super::Plane<f64>),
    normal_bar: [f64; 3],
) -> Vec<[f64; 3]> {
    let [first, others @ ..] = plane.eigenvalues;
    let mut g = [0.0; 3];
    for (value, v) in others.into_iter().zip(plane.tangents) {
        g = vector::add(
            g,
            vector::scale(v, vector::dot(v, normal_bar) / (first - value)),
        );
    }
    let b = |x: [f64; 3]| {
        let (along, across) = (vector::dot(normal, x), vector::dot(g, x));
        vector::scale(
            vector::add(vector::scale(g, along), vector::scale(normal, across)),
            0.5,
        )
    };
    let cotangent = |&(_, d): &(usize, [f64; 3])| {
        let (r, from_mean) = (vector::norm(d), vector::sub(d, plane.centroid));
        if r == 0.0 {
            return [0.0; 3];
        }
        let (w, fall) = weight(r, radius);
        let image = b(from_mean);
        let radial = fall / plane.weight * vector::dot(from_mean, image) / r;
        vector::sub(
            vector::scale(image, 2.0 * w / plane.weight),
            vector::scale(d, radial),
        )
    };
    members.iter().map(cotangent).collect()
}

#[test]
fn the_residual_holds_all_that_the_pullback_needs() {
    let points: Vec<[f64; 3]> = torus(3000, 9).iter().map(|s| s.0).collect();
    let found = axes(&points).1;
    let mut random = Random::new(10);
    for i in (0..points.len()).step_by(300) {
        let radius = found.radius[i];
        let members = members(&points, i, radius);
        let normal_bar = [0; 3].map(|_| random.uniform() - 0.5);
        let direction: Vec<[f64; 3]> = members
            .iter()
            .map(|_| [0; 3].map(|_| random.uniform() - 0.5))
            .collect();
        let bar = pullback(
            &members,
            radius,
            (found.normals[i], found.planes[i]),
            normal_bar,
        );
        let analytic: f64 = bar
            .iter()
            .zip(&direction)
            .map(|(&b, &d)| vector::dot(b, d))
            .sum();
        let step = 1e-5 * radius;
        let value = |s: f64| {
            let moved: Vec<_> = members
                .iter()
                .zip(&direction)
                .map(|(&(j, d), &v)| {
                    (
                        j,
                        if j == i {
                            d
                        } else {
                            vector::add(d, vector::scale(v, s))
                        },
                    )
                })
                .collect();
            let n = eigen(covariance(&moved, radius).2.into()).first.into();
            vector::dot(n, normal_bar) * vector::dot(n, found.normals[i]).signum()
        };
        let numeric = (value(step) - value(-step)) / (2.0 * step);
        // Truncation is of order 1e-10, rounding of order 1e-16/1e-5.
        let tolerance = 1e-7 * bar.iter().map(|&b| vector::norm(b)).sum::<f64>();
        assert!(
            (numeric - analytic).abs() < tolerance,
            "point {i}: {numeric}, not {analytic}"
        );
    }
}
