//! Lines of samples are found, and radii reach them.

use super::super::tests::{Random, torus};
use super::super::{Neighborhoods, RadiiCotangent, Radius, forward, pullback, with_lines};
use super::*;

/// About 10,000 random samples of a torus on lines in parallel planes, and the distance of the planes, which is so many
/// times that of the samples on a line.
fn lines(ratio: f64) -> (Vec<[f64; 3]>, f64) {
    let across = [0.3, 0.5, 0.8].map(|x| x / 0.98f64.sqrt());
    let area = std::f64::consts::TAU.powi(2) * 0.7 * 0.25;
    let between = (area * ratio / 10_000.0).sqrt();
    let is_near = |point: [f64; 3]| {
        let place = vector::dot(point, across) / between;
        (place - place.round()).abs() < 0.008
    };
    let samples = torus(600_000, 5).into_iter().map(|(point, _)| point);
    (samples.filter(|&point| is_near(point)).collect(), between)
}

fn found(points: &[[f64; 3]]) -> Neighborhoods<f64> {
    let mut found = Neighborhoods::default();
    forward(points, Radius::Auto, &mut found).expect("a cloud");
    found
}

#[test]
fn radii_reach_the_next_lines() {
    for ratio in [6.0, 10.0, 20.0] {
        let (points, between) = lines(ratio);
        let found = found(&points);
        let reach = found.common_radius / between;
        assert!(found.neighbors() > AUTO_NEIGHBORS, "{ratio}");
        assert!((1.2..1.8).contains(&reach), "{ratio}: {reach}");
        // A line of samples as far apart as on a lattice with as many samples per area.
        let spacing = found.spacing() * ratio.sqrt() / between;
        assert!((0.8..1.2).contains(&spacing), "{ratio}: {spacing}");
    }
}

/// Sections of a flat elliptic cylinder as long as four of its chords, 200 samples each, which are closer at both ends of
/// the chord; and the distance of sections.
fn wing() -> (Vec<[f64; 3]>, f64) {
    let point = |k: usize, section: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 200.0;
        let across = [0.5 * angle.cos(), 0.06 * angle.sin()];
        [across[0], across[1], section as f64 * 0.1]
    };
    let sections = (0..40).flat_map(|section| (0..200).map(move |k| point(k, section)));
    (sections.collect(), 0.1)
}

#[test]
fn the_other_side_of_a_thin_body_is_not_the_next_line() {
    let (points, between) = wing();
    let reach = found(&points).common_radius / between;
    assert!((1.2..1.6).contains(&reach), "{reach}");
}

/// Rings of samples around the long axis of an ellipsoid, closer to each other toward its ends; and the normals.
fn rings(rings: usize, samples: usize) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let axes = [1.0, 0.35, 0.25];
    let point = |ring: usize, k: usize| {
        let angle = std::f64::consts::PI * (ring as f64 + 0.5) / rings as f64;
        let around = std::f64::consts::TAU * k as f64 / samples as f64;
        let on_sphere = [
            angle.cos(),
            angle.sin() * around.cos(),
            angle.sin() * around.sin(),
        ];
        let normal = [0, 1, 2].map(|a| on_sphere[a] / axes[a]);
        let normal = vector::normalized(normal).expect("not zero");
        ([0, 1, 2].map(|a| axes[a] * on_sphere[a]), normal)
    };
    (0..rings)
        .flat_map(|ring| (0..samples).map(move |k| point(ring, k)))
        .unzip()
}

#[test]
fn radii_grow_where_lines_are_farther_than_most() {
    for (along, around) in [(50, 200), (30, 400), (400, 30)] {
        let (points, truth) = rings(along, around);
        let (mut found, mut axes) = Default::default();
        crate::normals::forward_with_neighborhoods(&points, Radius::Auto, &mut found, &mut axes)
            .expect("a cloud");
        assert!(found.lines().is_some() && found.grown() > points.len() / 10);
        let pairs = axes.normals.iter().zip(&truth);
        let off = pairs
            .filter(|&(n, truth)| vector::dot(*n, *truth).abs() < 0.5)
            .count();
        assert!(off <= points.len() / 100, "{along} x {around}: {off}");
    }
}

#[test]
fn surfaces_have_the_usual_number() {
    let random = torus(10_000, 3).into_iter().map(|(point, _)| point);
    let lattice = |step: [f64; 2]| -> Vec<[f64; 3]> {
        let point = |i: usize, j: usize| [step[0] * i as f64, step[1] * j as f64, 0.0];
        (0..60)
            .flat_map(|i| (0..60).map(move |j| point(i, j)))
            .collect()
    };
    for points in [
        random.collect(),
        lattice([1.0, 1.0]),
        lattice([1.0, 1.5]),
        lattice([1.0, 3.0]),
    ] {
        assert_eq!(found(&points).neighbors(), AUTO_NEIGHBORS);
    }
    // One line has no next one; neither have equal points.
    let mut random = Random::new(7);
    let line: Vec<[f64; 3]> = (0..500).map(|_| [random.uniform(), 0.0, 0.0]).collect();
    assert_eq!(found(&line).neighbors(), AUTO_NEIGHBORS);
    let pairs: Vec<[f64; 3]> = line.iter().flat_map(|&x| [x; 30]).collect();
    assert_eq!(found(&pairs).neighbors(), AUTO_NEIGHBORS);
}

#[test]
fn the_number_is_that_of_the_points_in_any_order() {
    let (mut points, _) = lines(10.0);
    let before = found(&points);
    points.reverse();
    points.rotate_left(1234);
    let after = found(&points);
    assert_eq!(before.neighbors(), after.neighbors());
    assert_eq!(before.common_radius, after.common_radius);
}

#[test]
fn lines_beside_are_those_on_either_side() {
    let along = (1..=10).flat_map(|k| [0.1, -0.1].map(|step| [step * f64::from(k), 0.0, 0.0]));
    let mut offsets: Vec<[f64; 3]> = along.collect();
    offsets.push([0.1, 0.0, -1.2]);
    assert_eq!(beside(&offsets), None);
    offsets.extend([
        [0.1, 0.2, -1.4],
        [0.0, 2.0, 0.0],
        [0.2, -2.5, 0.1],
        [0.0, -3.0, 0.0],
    ]);
    let found = beside(&offsets).expect("lines on either side");
    assert_eq!(offsets[found], [0.2, -2.5, 0.1]);
}

#[test]
fn radii_have_their_derivatives_at_a_fixed_number() {
    for points in [lines(10.0).0, rings(30, 400).0] {
        let mut random = Random::new(9);
        let weights: Vec<f64> = points.iter().map(|_| 0.5 + random.uniform()).collect();
        let held = found(&points);
        let bars = held
            .radius
            .iter()
            .zip(&weights)
            .map(|(radius, weight)| radius * weight);
        let bar = RadiiCotangent::of(&held, &bars.collect::<Vec<_>>());
        let mut points_bar = vec![[0.0; 3]; points.len()];
        pullback(&held, &bar, &mut points_bar);
        let slopes = [1.0, 0.4, -0.3];
        let direction = |x: &[f64; 3]| [0, 1, 2].map(|a| slopes[a] * x[a]);
        let pairs = points_bar.iter().zip(&points);
        let slope: f64 = pairs.map(|(bar, x)| vector::dot(*bar, direction(x))).sum();
        let sum = |step: f64| -> f64 {
            let moved = points
                .iter()
                .map(|x| vector::add(*x, vector::scale(direction(x), step)));
            let mut found = Neighborhoods::default();
            with_lines(
                &moved.collect::<Vec<_>>(),
                Radius::Auto,
                held.lines(),
                &mut found,
            )
            .expect("a cloud");
            assert!(found.grown() > points.len() / 100);
            found
                .radius
                .iter()
                .zip(&weights)
                .map(|(radius, weight)| radius * weight)
                .sum()
        };
        let step = 1e-8;
        let difference = (sum(step) - sum(-step)) / (2.0 * step);
        assert!(
            (slope - difference).abs() < 1e-5 * difference.abs(),
            "{slope} {difference}"
        );
    }
}
