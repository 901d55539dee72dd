//! The map from parameters to points and its pullback, on every shape.

use isograd_element::vector::{dot, norm, sub};
use isograd_shapes::{Shape, SurfaceCoordinate, all};

use super::{RANDOM, shape, with};

/// Every shape at its defaults, and with every parameter changed by up to a tenth where possible.
fn shapes() -> Vec<Shape> {
    let mut shapes = Vec::new();
    for shape in all() {
        let mut other = shape.clone();
        let parameters: Vec<_> = shape.parameters().map(|(p, value)| (*p, value)).collect();
        for (i, (parameter, value)) in parameters.into_iter().enumerate() {
            let factor = 1.0 + 0.1 * (1.7 * (i + 1) as f64).sin();
            if !parameter.whole {
                // A refused value leaves the shape unchanged.
                let _ = other.set(parameter.name, value * factor);
            }
        }
        assert_ne!(shape.values(), other.values());
        shapes.extend([shape, other]);
    }
    let swimming = [("amplitude", 0.1), ("time", 0.3), ("carangiform", 0.4)];
    shapes.push(with("fish", &swimming));
    shapes
}

fn coordinates(shape: &Shape, n: usize) -> Vec<SurfaceCoordinate> {
    let samples = shape.sample::<f64>(n, &RANDOM, 5).expect("samples");
    samples.coordinates
}

/// Numbers of order one without a pattern.
fn weights(n: usize) -> Vec<[f64; 3]> {
    let number = |k: usize| (12.9898 * k as f64 + 0.3).sin();
    (0..n)
        .map(|i| [0, 1, 2].map(|a| number(3 * i + a)))
        .collect()
}

/// `Σ x·x̄`, and the sum of the sizes of its terms: the sum may cancel.
fn product(x: &[[f64; 3]], bars: &[[f64; 3]]) -> (f64, f64) {
    let pairs = x.iter().zip(bars);
    let sum = pairs.clone().map(|(x, bar)| dot(*x, *bar)).sum();
    (sum, pairs.map(|(x, bar)| norm(*x) * norm(*bar)).sum())
}

fn step(value: f64) -> f64 {
    1e-6 * value.abs().max(0.1)
}

/// Central difference of the points in one parameter, and the step; one-sided at the end of a range.
fn difference(shape: &Shape, index: usize, c: &[SurfaceCoordinate]) -> Option<Vec<[f64; 3]>> {
    let (parameter, value) = shape.parameters().nth(index).expect("an index");
    let step = step(value);
    let at = |change: f64| {
        let mut moved = shape.clone();
        moved.set(parameter.name, value + change).ok()?;
        moved.points_at::<f64>(c).ok()
    };
    let (low, high, width) = match (at(-step), at(step)) {
        (Some(low), Some(high)) => (low, high, 2.0 * step),
        (None, Some(high)) => {
            // Second order on one side: (−3 x₀ + 4 x₁ − x₂)/2h.
            let (start, far) = (at(0.0)?, at(2.0 * step)?);
            let row = |i: usize| {
                [0, 1, 2].map(|a| (4.0 * high[i][a] - 3.0 * start[i][a] - far[i][a]) / (2.0 * step))
            };
            return Some((0..c.len()).map(row).collect());
        }
        _ => return None,
    };
    let row = |(a, b): (&[f64; 3], &[f64; 3])| sub(*b, *a).map(|d| d / width);
    Some(low.iter().zip(&high).map(row).collect())
}

#[test]
fn the_pullback_is_the_transpose_of_the_finite_difference_on_every_shape() {
    for shape in shapes() {
        let c = coordinates(&shape, 400);
        let bars = weights(c.len());
        let points = shape.points_at::<f64>(&c).expect("points");
        let gradient = shape.pullback(&c, &bars).expect("a pullback");
        assert_eq!(gradient.len(), shape.values().len());
        let mut checked = 0;
        for (index, &pulled) in gradient.iter().enumerate() {
            if !shape.is_differentiable(index) {
                assert_eq!(pulled, 0.0);
                continue;
            }
            let Some(moved) = difference(&shape, index, &c) else {
                continue;
            };
            let (pushed, size) = product(&moved, &bars);
            // Truncation is the square of a step of 1e-6; rounding is that of the points over the step.
            let (_, rounding) = product(&points, &bars);
            let tolerance = 1e-6 * size + 1e-15 * rounding / step(shape.values()[index]);
            let error = (pulled - pushed).abs();
            assert!(error <= tolerance, "{shape:?} {index}: {pulled} {pushed}");
            checked += 1;
        }
        assert!(checked > 0, "{shape:?}");
    }
}

#[test]
fn the_pullback_is_the_transpose_of_the_tangent() {
    for shape in shapes() {
        let c = coordinates(&shape, 200);
        let bars = weights(c.len());
        let gradient = shape.pullback(&c, &bars).expect("a pullback");
        for (index, (parameter, _)) in shape.parameters().enumerate() {
            let tangent = shape.tangent(parameter.name, &c).expect("a tangent");
            let (pushed, size) = product(&tangent, &bars);
            // The jets are equal; only the order of the sum differs.
            let error = (gradient[index] - pushed).abs();
            assert!(error <= 1e-12 * size, "{shape:?} {}", parameter.name);
        }
    }
}

#[test]
fn points_and_normals_at_the_coordinates_of_samples_are_the_samples() {
    for shape in shapes() {
        let samples = shape.sample::<f64>(300, &RANDOM, 2).expect("samples");
        let points = shape.points_at::<f64>(&samples.coordinates);
        assert_eq!(points.as_deref(), Ok(samples.cloud.points()), "{shape:?}");
        let normals = shape.normals_at::<f64>(&samples.coordinates);
        assert_eq!(
            normals.ok().as_deref(),
            samples.cloud.normals(),
            "{shape:?}"
        );
    }
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads_or_parameters() {
    let shape = shape("fish");
    let c = coordinates(&shape, 7000);
    let bars = weights(c.len());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads")
            .install(|| shape.pullback(&c, &bars).expect("a pullback"))
    };
    let all = with(1);
    assert_eq!(all, with(2));
    assert_eq!(all, with(5));
    let some = shape
        .pullback_of(&[14, 2, 99], &c, &bars)
        .expect("a pullback");
    assert_eq!(some, [all[14], all[2], 0.0]);
}

#[test]
fn mismatched_cotangents_and_patches_are_refused() {
    let mut vessels = shape("vessels");
    let c = coordinates(&vessels, 500);
    let message = vessels
        .pullback(&c, &weights(3))
        .expect_err("too few")
        .to_string();
    assert!(message.contains("one for each"), "{message}");
    vessels.set("generations", 1.0).expect("a tree");
    assert!(vessels.normals_at::<f64>(&c).is_err());
    let message = vessels.points_at::<f64>(&c).expect_err("gone").to_string();
    assert!(message.contains("sample the shape again"), "{message}");
    assert!(vessels.pullback(&c, &weights(500)).is_err());
}
