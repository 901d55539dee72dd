//! The fit in its plainest form: all samples, and the normal equations of the weighted least squares.

use super::*;
use crate::poisson::tests::eliminate;
use crate::vector::{dot, norm_squared, scale, sub};

/// `R_v` from all distances, sorted.
fn radius(distances: &mut [f64], common: f64) -> f64 {
    distances.sort_unstable_by(f64::total_cmp);
    let last = distances.len() - 1;
    common.max((1.5 * distances[5.min(last)]).min(1.05 * distances[63.min(last)]))
}

/// Value at zero of the `(α, β)` that minimize `Σ w (v − α − β·d)² + W ε |β|²`, lengths in units of `R_v`.
fn fitted_value(weights: &[f64], offsets: &[[f64; 3]], values: &[f64]) -> f64 {
    let total: f64 = weights.iter().sum();
    let samples = || weights.iter().zip(offsets);
    let mean: [f64; 3] =
        std::array::from_fn(|a| samples().map(|(w, d)| w * d[a]).sum::<f64>() / total);
    let spread = |(w, d): (&f64, &[f64; 3])| w * norm_squared(sub(*d, mean)) / total;
    let trace: f64 = samples().map(spread).sum();
    let distance = dot(mean, mean) / trace;
    let ridge = trace * (1e-5 + distance * distance / 256.0);
    let (mut a, mut b) = (vec![vec![0.0; 4]; 4], vec![0.0; 4]);
    for ((w, d), v) in samples().zip(values) {
        let row = [1.0, d[0], d[1], d[2]];
        for i in 0..4 {
            b[i] += w * row[i] * v;
            for j in 0..4 {
                a[i][j] += w * row[i] * row[j];
            }
        }
    }
    for k in 1..4 {
        a[k][k] += total * ridge;
    }
    eliminate(a, b)[0]
}

fn oracle(scene: &Scene<f64>, values: &[f64], y: [f64; 3]) -> f64 {
    let offsets: Vec<[f64; 3]> = scene.points.iter().map(|&x| sub(x, y)).collect();
    let mut distances: Vec<f64> = offsets.iter().map(|d| norm_squared(*d).sqrt()).collect();
    let radius = radius(&mut distances, scene.neighborhoods.common_radius);
    let offsets: Vec<[f64; 3]> = offsets.iter().map(|d| scale(*d, 1.0 / radius)).collect();
    let smallest = 1e-6 * scene.areas.iter().sum::<f64>() / scene.areas.len() as f64;
    let weight = |(area, d): (&f64, &[f64; 3])| {
        (area + smallest) * (1.0 - norm_squared(*d)).max(0.0).powi(2)
    };
    let weights: Vec<f64> = scene.areas.iter().zip(&offsets).map(weight).collect();
    fitted_value(&weights, &offsets, values)
}

#[test]
fn vertices_have_the_values_of_a_plain_weighted_fit() {
    // A hole and an uneven density, so that radii grow; an attribute without any pattern.
    let mut random = Random::new(3);
    let keep = |p: &[f64; 3]| p[1] > -0.6;
    let points: Vec<[f64; 3]> = torus(1500, 2)
        .into_iter()
        .map(|(p, _)| p)
        .filter(keep)
        .collect();
    let scene = Scene::<f64>::new(&points, 20);
    let values: Vec<f64> = points.iter().map(|_| random.uniform() - 0.5).collect();
    let attribute = Attribute {
        name: "noise".into(),
        components: 1,
        values,
    };
    let (extension, _) = scene.extend(&attribute);
    for (&y, &found) in scene.mesh.vertices().iter().zip(&extension.vertices) {
        let expected = oracle(&scene, &attribute.values, y);
        // Both solve systems whose condition number is about 1e5, bounded by the ridge.
        assert!(
            (found - expected).abs() <= 1e-9,
            "{found} {expected} at {y:?}"
        );
    }
}
