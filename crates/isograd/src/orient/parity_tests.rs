//! The paper's method against a plain transcription of it.

use super::parity::{Pattern, detection_radius, flip};
use super::shapes::{Random, neighborhoods, oriented, sphere, torus};
use super::*;
use crate::vector::{add, norm, norm_squared, scale, sub};

/// The detection array of one ray, entry by entry, over all points.
fn plain_pattern(points: &[[f64; 3]], i: usize, n: [f64; 3], r_d: f64, step: f64) -> Pattern {
    let diameter = points
        .iter()
        .map(|&x| norm(sub(x, points[i])))
        .fold(0.0, f64::max);
    // Beyond the farthest sample, nothing is detected any more.
    let last = ((diameter + 2.0 * r_d) / step).ceil() as usize + 1;
    let detected: Vec<bool> = (0..=last)
        .map(|m| {
            let y = add(points[i], scale(n, m as f64 * step));
            let others = points.iter().any(|&x| norm_squared(sub(x, y)) <= r_d * r_d);
            others || m as f64 * step <= r_d
        })
        .collect();
    let all = (1..=last)
        .filter(|&m| !detected[m] && detected[m - 1])
        .count();
    let leading = detected.iter().take_while(|&&d| d).count();
    Pattern {
        crossings: all - 1,
        leading,
    }
}

/// Iterations 0, 1 and 2, each along the normal as the one before left it.
fn plain_sign(
    points: &[[f64; 3]],
    i: usize,
    axis: [f64; 3],
    r_d: f64,
    o: &ParityOptions,
) -> [f64; 3] {
    let opposite = |n: [f64; 3]| n.map(|x| -x);
    let look = |n| plain_pattern(points, i, n, r_d, o.step * r_d);
    let mut n = axis;
    if look(n).crossings % 2 == 1 {
        n = opposite(n);
    }
    if look(n).crossings != 0 || look(n).leading > o.tolerance {
        n = opposite(n);
    }
    if look(n).crossings > look(opposite(n)).crossings {
        n = opposite(n);
    }
    n
}

fn noisy_torus(n: usize) -> Vec<[f64; 3]> {
    let mut random = Random(3);
    let jitter = |x: [f64; 3]| add(x, scale(random.direction(), 0.03));
    torus(n, 4).0.into_iter().map(jitter).collect()
}

#[test]
fn signs_are_those_of_the_plain_transcription() {
    let mut far = sphere(300, [0.0; 3], 1.0, 2).0;
    far.push([50.0, 0.0, 0.0]);
    for points in [torus(500, 4).0, noisy_torus(500), far] {
        let mut random = Random(6);
        let axes: Vec<_> = points.iter().map(|_| random.direction()).collect();
        let neighborhoods = neighborhoods(&points);
        for options in [
            ParityOptions::default(),
            ParityOptions {
                gamma: 1.0,
                tolerance: 3,
                step: 0.3,
            },
        ] {
            let r_d = detection_radius(&neighborhoods, &options);
            let method = Method::Parity(options);
            let out = oriented(&points, &axes, &neighborhoods, None, &method).unwrap();
            for (i, &axis) in axes.iter().enumerate() {
                assert_eq!(
                    out.normals[i],
                    plain_sign(&points, i, axis, r_d, &options),
                    "point {i}"
                );
            }
        }
    }
}

#[test]
fn the_detection_radius_is_that_of_the_most_lonely_point() {
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 2.0, 0.0],
        [1.5, 0.0, 0.0],
    ];
    let neighborhoods = neighborhoods(&points);
    let options = ParityOptions::default();
    assert_eq!(detection_radius(&neighborhoods, &options), 2.5 * 0.5 * 2.0);
}

#[test]
fn the_iterations_follow_each_other() {
    let pattern = |crossings, leading| Pattern { crossings, leading };
    // Outward already: nothing in front, one crossing behind.
    assert!(!flip(pattern(0, 2), pattern(1, 2), 2));
    // Inward: iteration 0 turns it.
    assert!(flip(pattern(1, 2), pattern(0, 2), 2));
    // A long first block: iteration 1 turns it, iteration 2 turns it back, having fewer crossings.
    assert!(!flip(pattern(0, 3), pattern(1, 2), 2));
    // The same, but nothing behind either: iteration 2 leaves it turned.
    assert!(flip(pattern(0, 3), pattern(0, 2), 2));
    // Two crossings in front and none behind: iteration 1 turns it.
    assert!(flip(pattern(2, 2), pattern(0, 2), 2));
}

#[test]
fn spheres_are_oriented() {
    let (points, truth) = sphere(2000, [0.0; 3], 1.0, 11);
    let axes: Vec<_> = truth
        .iter()
        .map(|n| if n[0] > 0.0 { *n } else { n.map(|x| -x) })
        .collect();
    let neighborhoods = neighborhoods(&points);
    let method = Method::Parity(ParityOptions::default());
    let out = oriented(&points, &axes, &neighborhoods, None, &method).unwrap();
    assert_eq!(out.normals, truth);
}

#[test]
fn options_out_of_range_are_refused() {
    let (points, axes) = sphere(50, [0.0; 3], 1.0, 11);
    let neighborhoods = neighborhoods(&points);
    for (gamma, step) in [
        (0.5, 1.0),
        (f64::NAN, 1.0),
        (2.5, 0.0),
        (2.5, f64::INFINITY),
    ] {
        let method = Method::Parity(ParityOptions {
            gamma,
            tolerance: 2,
            step,
        });
        let outcome = oriented(&points, &axes, &neighborhoods, None, &method);
        assert!(matches!(outcome, Err(Error::Option { .. })));
    }
}

#[test]
fn clouds_of_equal_pairs_are_refused_by_name() {
    let (points, axes) = sphere(50, [0.0; 3], 1.0, 11);
    let (points, axes) = (
        [points.clone(), points].concat(),
        [axes.clone(), axes].concat(),
    );
    let neighborhoods = neighborhoods(&points);
    let method = Method::Parity(ParityOptions::default());
    let outcome = oriented(&points, &axes, &neighborhoods, None, &method);
    assert_eq!(outcome.unwrap_err(), Error::DetectionRadius { radius: 0.0 });
}

#[test]
fn rays_end_whatever_the_options() {
    // Probes so far apart that in single precision no sample has a finite distance from the second one.
    for (gamma, step) in [(1e30, 1.0), (1e30, 0.01), (1e308, 1.0), (2.5, 1e308)] {
        let options = ParityOptions {
            gamma,
            step,
            ..ParityOptions::default()
        };
        let (points, normals) = sphere(200, [0.0; 3], 1.0, 5);
        let of = |v: &[[f64; 3]]| {
            v.iter()
                .map(|&v| vector::of_f64::<f32>(v))
                .collect::<Vec<_>>()
        };
        let (points, normals) = (of(&points), of(&normals));
        let neighborhoods = neighborhoods(&points);
        let method = Method::Parity(options);
        let out = oriented(&points, &normals, &neighborhoods, None, &method);
        let out = out.expect("options in range");
        assert!(out.normals.iter().all(|&n| vector::is_finite(n)));
        let MethodUsed::Parity { detection_radius } = out.method else {
            panic!("{:?}", out.method);
        };
        assert!(detection_radius.is_finite(), "{detection_radius}");
    }
}
