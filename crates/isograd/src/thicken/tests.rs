use super::*;
use crate::neighbors::tests::Random;
use crate::splat::SampleCotangent;
use crate::vector::{add, norm, scale, sub};

type Cloud = (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<f64>);

/// Samples of both faces of a disk of radius 1 that is `thickness` thick, and bent a little.
fn plate(count: usize, thickness: f64, seed: u64) -> Cloud {
    disk(count, |_| thickness, seed)
}

/// A disk that is thinner than the widths of the tests on one side, and much thicker on the other.
fn wedge(count: usize, seed: u64) -> Cloud {
    disk(count, |x| 0.3 + 0.3 * x, seed)
}

fn disk(count: usize, thickness: impl Fn(f64) -> f64, seed: u64) -> Cloud {
    let mut random = Random::new(seed);
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    while points.len() < count {
        let [x, y] = [0, 1].map(|_| 2.0 * random.uniform() - 1.0);
        if x * x + y * y > 1.0 {
            continue;
        }
        let side = if points.len() % 2 == 0 { 0.5 } else { -0.5 };
        let up = [-0.4 * x, 0.2 * y, 1.0];
        let up = scale(up, 1.0 / norm(up));
        let middle = [x, y, 0.2 * x * x - 0.1 * y * y];
        points.push(add(middle, scale(up, side * thickness(x))));
        normals.push(scale(up, 2.0 * side));
    }
    let areas = (0..count).map(|_| 4.0 * (0.5 + random.uniform()) / count as f64);
    (points, normals, areas.collect())
}

/// Thickness that is given, in widths.
const T: f64 = 1.2;

/// Runs `run` with the samples, their tree, a width and a least thickness.
fn with<R>(
    (points, normals, areas): &Cloud,
    width: f64,
    least: f64,
    run: impl FnOnce(Inputs<'_, f64>) -> R,
) -> R {
    let index = CellIndex::new(points);
    let samples = Samples {
        points,
        normals,
        areas,
    };
    run(Inputs {
        index: &index,
        samples,
        width,
        least,
    })
}

fn thickened(cloud: &Cloud, width: f64) -> Thickened<f64> {
    thickened_to(cloud, width, T)
}

fn thickened_to(cloud: &Cloud, width: f64, least: f64) -> Thickened<f64> {
    let mut out = Thickened::default();
    with(cloud, width, least, |inputs| forward(inputs, &mut out));
    assert_eq!(out.points.len(), out.sums.len());
    if out.points.is_empty() {
        out.points.clone_from(&cloud.0);
    }
    out
}

/// The formulas of the module, for all pairs.
fn oracle((points, normals, areas): &Cloud, l: f64) -> Vec<[f64; 3]> {
    let r = REACH * l;
    let one = |i: usize| {
        let (mut own, mut weights, mut depths) = (0.0, 0.0, 0.0);
        for j in 0..points.len() {
            let d = sub(points[i], points[j]);
            let (u, z, q) = (
                dot(normals[i], normals[j]),
                dot(normals[i], d) / l,
                dot(d, d) / (r * r),
            );
            if q >= 1.0 || u.abs() <= 0.5 {
                continue;
            }
            let weight = areas[j] * (2.0 * u.abs() - 1.0).powi(2) * (1.0 - q).powi(2);
            if u > 0.0 {
                own += weight;
                continue;
            }
            let v: f64 = (1.0 + 4.0 * z).clamp(0.0, 1.0);
            let weight = weight * v * v * (3.0 - 2.0 * v);
            weights += weight;
            depths += weight * z;
        }
        if weights == 0.0 {
            return points[i];
        }
        let (t, s): (f64, f64) = (depths / weights, (weights / own).min(1.0));
        let f = match t {
            t if t < T - 0.4 => T - t,
            t if t < T + 0.4 => (T + 0.4 - t).powi(2) / 1.6,
            _ => 0.0,
        };
        add(points[i], scale(normals[i], 0.5 * l * f * s * (2.0 - s)))
    };
    (0..points.len()).map(one).collect()
}

#[test]
fn points_are_those_of_all_pairs() {
    let plates = [(1, 0.0), (2, 0.03), (3, 0.09), (4, 0.14), (5, 0.3)];
    let plates = plates.map(|(seed, thickness)| (thickness, plate(700, thickness, seed)));
    for (thickness, cloud) in plates.into_iter().chain([(0.6, wedge(900, 6))]) {
        let (fast, slow) = (thickened(&cloud, 0.1), oracle(&cloud, 0.1));
        for (fast, slow) in fast.points.iter().zip(&slow) {
            assert!(norm(sub(*fast, *slow)) < 1e-13, "{thickness}");
        }
    }
}

#[test]
fn only_samples_near_the_other_face_are_looked_at() {
    let cloud = wedge(4000, 13);
    let near = with(&cloud, 0.1, T, forward::near_others);
    // Within 2.5 widths of 0.1.
    for (x, is_near) in cloud.0.iter().map(|p| p[0]).zip(near) {
        assert!(is_near == (x < -0.3) || x.abs() < 0.3, "{x}");
    }
}

#[test]
fn thin_plates_become_thicker_and_thick_ones_stay() {
    let width = 0.1;
    for thickness in [0.0, 0.01, 0.05, 0.2, 0.5] {
        let cloud = plate(4000, thickness, 5);
        let found = thickened(&cloud, width);
        let (mut sum, mut count) = (0.0, 0.0);
        for (i, (new, old)) in found.points.iter().zip(&cloud.0).enumerate() {
            let by = dot(sub(*new, *old), cloud.1[i]);
            let wanted = match thickness {
                t if t <= 0.05 => 0.5 * (T * width - t),
                _ => 0.0,
            };
            // Depths are those of a bent plate, and areas are random: the other face may seem smaller.
            assert!(
                (by - wanted).abs() < 0.3 * width,
                "{thickness}: {by} {wanted}"
            );
            (sum, count) = (sum + by - wanted, count + 1.0);
        }
        let mean: f64 = sum / count;
        assert!(mean.abs() < 0.03 * width, "{thickness}: {mean}");
    }
}

#[test]
fn samples_across_a_gap_stay() {
    // The faces look at each other.
    let (points, normals, areas) = plate(2000, 0.06, 6);
    let normals = normals.iter().map(|n| scale(*n, -1.0)).collect();
    let cloud = (points, normals, areas);
    let found = thickened(&cloud, 0.1);
    assert_eq!(found.points, cloud.0);
}

/// Random vectors from −1 to 1.
fn random_vectors(n: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let one = |_| std::array::from_fn(|_| 2.0 * random.uniform() - 1.0);
    (0..n).map(one).collect()
}

fn dot_all(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(*a, *b)).sum()
}

#[test]
fn cotangents_are_the_transpose_of_differences() {
    let plates = [(7, 0.0), (8, 0.02), (9, 0.07), (10, 0.11), (11, 0.15)];
    let plates = plates.map(|(seed, thickness)| (seed, thickness, plate(400, thickness, seed)));
    for (seed, thickness, cloud) in plates.into_iter().chain([(12, 0.6, wedge(400, 12))]) {
        let (width, n) = (0.1, 400);
        let mut random = Random::new(seed + 100);
        let [dx, dn, da, bar] = [0; 4].map(|_| random_vectors(n, &mut random));
        let loss = |e: f64| {
            let along = |(x, d): (&[f64; 3], &[f64; 3])| add(*x, scale(*d, e * 0.05));
            let points = cloud.0.iter().zip(&dx).map(along).collect();
            let normals = cloud.1.iter().zip(&dn).map(along).collect();
            let areas = cloud.2.iter().zip(&da).map(|(a, d)| a + e * 0.01 * d[0]);
            let moved = (points, normals, areas.collect());
            let found = thickened_to(&moved, width * (1.0 + 0.1 * e), T + 0.1 * e);
            dot_all(&found.points, &bar)
        };
        let e = 1e-6;
        let differences = (loss(e) - loss(-e)) / (2.0 * e);
        let sums = thickened(&cloud, width).sums;
        let mut bars = SampleCotangent {
            points: vec![[0.0; 3]; n],
            normals: vec![[0.0; 3]; n],
            areas: vec![0.0; n],
            ..Default::default()
        };
        let [of_width, of_least] = with(&cloud, width, T, |inputs| {
            pullback(inputs, &sums, &bar, &mut bars)
        });
        let of_areas = bars.areas.iter().zip(&da).map(|(a, d)| 0.01 * a * d[0]);
        let of_areas: f64 = of_areas.sum();
        let of_vectors = 0.05 * (dot_all(&bars.points, &dx) + dot_all(&bars.normals, &dn));
        let pulled = of_vectors + of_areas + 0.1 * (width * of_width + of_least);
        // Of sums of some hundred random terms, with kinks of second derivatives between.
        let error = (pulled - differences).abs();
        assert!(error < 1e-5, "{thickness}: {pulled} {differences}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let cloud = plate(3000, 0.02, 12);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| thickened(&cloud, 0.1)).points
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn samples_without_area_have_finite_cotangents() {
    let mut cloud = plate(400, 0.05, 3);
    cloud.2.iter_mut().step_by(2).for_each(|area| *area = 0.0);
    let width = 0.1;
    let found = thickened(&cloud, width);
    assert_ne!(found.points, cloud.0);
    let mut bars = SampleCotangent {
        points: vec![[0.0; 3]; 400],
        normals: vec![[0.0; 3]; 400],
        areas: vec![0.0; 400],
        ..Default::default()
    };
    let [of_width, _] = with(&cloud, width, T, |inputs| {
        pullback(inputs, &found.sums, &[[1.0; 3]; 400], &mut bars)
    });
    assert!(of_width.is_finite() && bars.areas.iter().all(|x| x.is_finite()));
    let vectors = bars.points.iter().chain(&bars.normals);
    assert!(vectors.flatten().all(|x| x.is_finite()));
}

#[test]
fn the_least_thickness_is_a_width_and_enough_cells() {
    let step = 1e-6;
    for width in [0.4, 0.87, 1.4, 1.6, 3.0] {
        let [of, slope] = least(width);
        assert!(of * width >= width.max(1.5) - 1e-12, "{width}");
        let difference = (least(width + step)[0] - least(width - step)[0]) / (2.0 * step);
        assert!((slope - difference).abs() < 1e-6, "{width}");
    }
}
