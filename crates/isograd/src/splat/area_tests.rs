//! Oracles: plain sums, known areas, finite differences.

use super::forward;
use crate::neighbors::tests::{Random, even_sphere, torus, ugly_clouds};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::{Real, vector};

fn areas<T: Real>(points: &[[T; 3]]) -> (Neighborhoods<T>, Vec<T>) {
    let (mut neighborhoods, mut areas) = Default::default();
    neighbors::forward(points, Radius::Auto, &mut neighborhoods).expect("a valid cloud");
    forward(&neighborhoods, &mut areas);
    (neighborhoods, areas)
}

/// `a_i` as the module's page prints it.
fn plain_area(points: &[[f64; 3]], i: usize, radius: f64) -> f64 {
    let r2 = radius * radius;
    let squares = points
        .iter()
        .map(|&p| vector::norm_squared(vector::sub(p, points[i])));
    let kernel = |d2: f64| 3.0 / (std::f64::consts::PI * r2) * (1.0 - d2 / r2).powi(2);
    1.0 / squares.filter(|&d2| d2 <= r2).map(kernel).sum::<f64>()
}

fn areas_agree_with_plain_sums<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let exact: Vec<[f64; 3]> = points.iter().map(|&p| vector::to_f64(p)).collect();
        let (neighborhoods, found) = areas(&points);
        for (i, area) in found.iter().enumerate() {
            if neighborhoods.isolated[i] {
                assert_eq!(*area, T::zero(), "{name}, point {i}");
                continue;
            }
            let expected = plain_area(&exact, i, neighborhoods.radius[i].f64());
            // Sums of up to a few hundred terms of one sign, each rounded a few times.
            let tolerance = 100.0 * T::epsilon().f64();
            assert!(
                (area.f64() / expected - 1.0).abs() < tolerance,
                "{name}, point {i}: {area}, not {expected}"
            );
        }
    }
}

#[test]
fn areas_agree_with_plain_sums_in_f32_and_f64() {
    areas_agree_with_plain_sums::<f32>();
    areas_agree_with_plain_sums::<f64>();
}

#[test]
fn areas_add_up_to_the_area_of_the_surface() {
    let pi = std::f64::consts::PI;
    let sphere: f64 = areas(&even_sphere(4000)).1.iter().sum();
    // Even samples: the kernel sum is a good quadrature, on a chord instead of an arc.
    assert!(
        (sphere / (4.0 * pi) - 1.0).abs() < 0.01,
        "{}",
        sphere / (4.0 * pi)
    );
    let samples: Vec<[f64; 3]> = torus(20_000, 1).iter().map(|s| s.0).collect();
    let ratio = areas(&samples).1.iter().sum::<f64>() / (4.0 * pi * pi * 0.7 * 0.25);
    // Random ones: each sample adds itself to the density, 3/24 of it, and 1/mean is below mean(1/·).
    assert!((0.88..1.0).contains(&ratio), "{ratio}");
}

#[test]
fn areas_are_finite_where_squares_of_distances_nearly_vanish() {
    let mut random = Random::new(13);
    for size in [1e-19f32, 1e-21, 1e-23, 1e-30] {
        let mut points: Vec<[f32; 3]> = (0..300)
            .map(|_| [0; 3].map(|_| size * random.uniform() as f32))
            .collect();
        points.push([1.0; 3]);
        assert!(areas(&points).1.iter().all(|a| a.is_finite()), "{size:e}");
    }
}

#[test]
fn a_few_outliers_add_no_area() {
    let mut samples: Vec<[f64; 3]> = torus(20_000, 1).iter().map(|s| s.0).collect();
    let clean: f64 = areas(&samples).1.iter().sum();
    let mut random = Random::new(12);
    samples.extend((0..40).map(|_| [0; 3].map(|_| 6.0 * random.uniform() - 3.0)));
    let (neighborhoods, found) = areas(&samples);
    let isolated = |range: std::ops::Range<usize>| {
        neighborhoods.isolated[range].iter().filter(|&&x| x).count()
    };
    assert_eq!(isolated(0..20_000), 0);
    // Outliers next to other outliers cannot be distinguished from a sparse surface.
    assert!(
        isolated(20_000..20_040) >= 30,
        "{}",
        isolated(20_000..20_040)
    );
    let surface: f64 = found[..20_000].iter().sum();
    // The automatic radius changes a little, since it is measured at other samples.
    assert!((surface / clean - 1.0).abs() < 0.01, "{}", surface / clean);
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let points: Vec<[f32; 3]> = torus(9000, 8).iter().map(|s| vector::of_f64(s.0)).collect();
    crate::testing::assert_same_bits(|| areas(&points).1);
}
