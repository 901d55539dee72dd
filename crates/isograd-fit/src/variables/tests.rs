//! Gradients against finite differences, bounds, starts.

use isograd::PointCloud;
use isograd_shapes::{Sampling, by_name};

use super::*;

fn fish() -> ShapeParameters {
    ShapeParameters {
        samples: 500,
        ..ShapeParameters::new(by_name("fish").expect("a shape"))
    }
}

fn degrees(options: ShapeParameters) -> Degrees {
    Degrees::new(Variables::Shape(options), 0.1).expect("variables")
}

fn blob() -> PointCloud<f64> {
    let sphere = by_name("sphere").expect("a shape");
    let samples = sphere.sample::<f64>(300, &Sampling::default(), 1);
    PointCloud::new(samples.expect("samples").cloud.points().to_vec()).expect("finite")
}

fn weights(n: usize) -> Vec<f64> {
    (0..n).map(|k| (12.9898 * k as f64 + 0.3).sin()).collect()
}

/// A functional of the points with the regularization terms, and its gradient.
fn functional(degrees: &Degrees, x: &[f64]) -> (f64, Vec<f64>) {
    let cloud = degrees.cloud(x).expect("a cloud");
    let w = weights(3 * cloud.len());
    let bars: Vec<[f64; 3]> = w.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let value: f64 = cloud
        .points()
        .as_flattened()
        .iter()
        .zip(&w)
        .map(|(x, w)| x * w)
        .sum();
    let mut gradient = degrees.pullback(x, &bars).expect("a gradient");
    let terms = degrees.regularization(x, &mut gradient);
    (value + terms.smoothness + terms.bounds, gradient)
}

fn assert_gradient(degrees: &Degrees, x: &[f64], components: &[usize]) {
    let (_, gradient) = functional(degrees, x);
    for &k in components {
        let (step, mut moved) = (1e-6, x.to_vec());
        moved[k] = x[k] + step;
        let above = functional(degrees, &moved).0;
        moved[k] = x[k] - step;
        let below = functional(degrees, &moved).0;
        let slope = (above - below) / (2.0 * step);
        // Values of order ten: rounding of 1e-15/1e-6.
        assert!(
            (slope - gradient[k]).abs() < 1e-7,
            "{k}: {slope} {}",
            gradient[k]
        );
    }
}

#[test]
fn gradients_are_finite_differences_within_and_beyond_the_bounds() {
    let degrees = degrees(fish());
    let mut x = degrees.start();
    let all: Vec<usize> = (0..x.len()).collect();
    // Amplitude and envelope are at their bounds, where the derivative is one-sided.
    x[15] = 0.5;
    x[17] = 0.5;
    assert_gradient(&degrees, &x, &all);
    x[3] = -0.4;
    x[8] = 30.0;
    x[15] = -0.5;
    assert_gradient(&degrees, &x, &all);
    let points = Points {
        smoothness: 2.0,
        ..Points::new(blob())
    };
    let degrees = Degrees::new(Variables::Points(points), 0.1).expect("variables");
    assert_gradient(&degrees, &weights(900), &[0, 1, 2, 450, 899]);
}

#[test]
fn variables_beyond_a_bound_give_the_shape_at_the_bound() {
    let Degrees::Shape(shape) = degrees(fish()) else {
        panic!("a shape");
    };
    let mut x = shape.start();
    x[1] = -3.0;
    assert_eq!(shape.values(&x)[1], 1e-4);
    assert_eq!(shape.at(&x).expect("a fish").get("width1"), Ok(1e-4));
    let mut gradient = vec![0.0; x.len()];
    assert!(shape.overshoot(&x, &mut gradient) > 9.0 && gradient[1] < -6.0);
    assert_eq!(
        shape.overshoot(&shape.start(), &mut vec![0.0; x.len()]),
        0.0
    );
}

#[test]
fn all_but_time_and_whole_numbers_are_fitted_unless_named() {
    let names = |options: ShapeParameters| match degrees(options) {
        Degrees::Shape(shape) => shape.names().collect::<Vec<_>>(),
        Degrees::Points(_) => Vec::new(),
    };
    let all = names(fish());
    assert!(all.len() == 19 && !all.contains(&"time"), "{all:?}");
    let only = |names: &[&str]| Some(names.iter().map(|n| n.to_string()).collect::<Vec<_>>());
    let some = names(ShapeParameters {
        only: only(&["height1", "width2", "height1"]),
        ..fish()
    });
    assert_eq!(some, ["width2", "height1"]);
    let refused = |shape: &str, wanted: &[&str]| {
        let options = ShapeParameters {
            only: only(wanted),
            samples: 100,
            ..ShapeParameters::new(by_name(shape).expect("a shape"))
        };
        Degrees::new(Variables::Shape(options), 0.1)
            .expect_err("refused")
            .to_string()
    };
    assert!(refused("fish", &["fins"]).contains("width1"));
    assert!(refused("vessels", &["generations"]).contains("whole"));
    assert!(refused("fish", &[]).contains("at least one"));
}

#[test]
fn random_starts_are_within_their_spread_and_repeat() {
    let with = |seed, spread| ShapeParameters {
        start: Start::Random { seed, spread },
        ..fish()
    };
    let values = |options| match degrees(options) {
        Degrees::Shape(shape) => shape.values(&shape.start()),
        Degrees::Points(_) => Vec::new(),
    };
    let given = values(fish());
    let random = values(with(3, 0.5));
    assert_eq!(random, values(with(3, 0.5)));
    assert_ne!(random, values(with(4, 0.5)));
    let factors: Vec<f64> = random
        .iter()
        .zip(&given)
        .filter(|(_, given)| **given != 0.0)
        .map(|(random, given)| random / given)
        .collect();
    assert!(
        factors.iter().all(|f| (1.0 / 1.5..=1.5).contains(f)),
        "{factors:?}"
    );
    assert!(factors.iter().any(|&f| f > 1.1) && factors.iter().any(|&f| f < 0.9));
    for spread in [-0.1, f64::NAN] {
        assert!(Degrees::new(Variables::Shape(with(1, spread)), 0.1).is_err());
    }
}

#[test]
fn a_motion_of_the_whole_is_smooth_and_an_odd_point_is_not() {
    let Degrees::Points(points) =
        Degrees::new(Variables::Points(Points::new(blob())), 0.1).expect("variables")
    else {
        panic!("points");
    };
    let mut x: Vec<f64> = [0.3, -0.2, 5.0].repeat(300);
    let mut gradient = vec![0.0; 900];
    assert_eq!(points.roughness(&x, &mut gradient), 0.0);
    assert!(gradient.iter().all(|g| *g == 0.0));
    x[7] += 1.0;
    assert!(points.roughness(&x, &mut gradient) > 0.0 && gradient[7] > 0.0);
    let off = Points {
        smoothness: 0.0,
        ..Points::new(blob())
    };
    let Degrees::Points(points) = Degrees::new(Variables::Points(off), 0.1).expect("variables")
    else {
        panic!("points");
    };
    assert_eq!(points.roughness(&x, &mut gradient), 0.0);
}
