//! Bodies made for each reason. Every sign is called doubtful, so that every point is asked.

use super::super::shapes::{Random, Sampled, cuboid, cut, join, sphere, torus};
use super::*;
use crate::neighbors::{self, Radius};
use crate::vector::{add, dot, scale};
use crate::{normals, vector};

const ORIGIN: [f64; 3] = [0.0; 3];

struct Asked {
    orientation: Orientation<f64>,
    neighborhoods: Neighborhoods<f64>,
}

impl Asked {
    /// The axes found, on the side of the true normals, with no confidence.
    fn new((points, truth): &Sampled) -> Self {
        let mut neighborhoods = Neighborhoods::default();
        neighbors::forward(points, Radius::Auto, &mut neighborhoods).unwrap();
        let mut axes = normals::Residual::default();
        normals::forward(&neighborhoods, &mut axes);
        let turned = axes.normals.iter().zip(truth);
        let orientation = Orientation {
            normals: turned
                .map(|(&n, &t)| scale(n, dot(n, t).signum()))
                .collect(),
            confidence: vec![0.0; points.len()],
            ..Orientation::default()
        };
        Self {
            orientation,
            neighborhoods,
        }
    }

    fn reasons(&self, sampled: &Sampled) -> Vec<(u32, Reason)> {
        reasons(&sampled.0, &self.orientation, &self.neighborhoods)
    }
}

/// At least this share of the samples that `among` takes is doubtful for `reason`.
#[track_caller]
fn assert_most(reason: Reason, share: f64, sampled: &Sampled, among: impl Fn([f64; 3]) -> bool) {
    let found = Asked::new(sampled).reasons(sampled);
    let asked = |f: &&(u32, Reason)| among(sampled.0[f.0 as usize]);
    let asked: Vec<_> = found.iter().filter(asked).copied().collect();
    let doubt = Doubt::count(asked.len(), &asked);
    assert!(doubt.share_of(reason) >= share, "{doubt:?}");
}

fn everywhere(_: [f64; 3]) -> bool {
    true
}

/// Gaussian noise along all axes.
fn noisy((points, truth): Sampled, deviation: f64) -> Sampled {
    let mut random = Random(99);
    let mut shift = || {
        let radius = deviation * (-2.0 * (1.0 - random.unit()).ln()).sqrt();
        scale(random.direction(), radius)
    };
    (points.iter().map(|&x| add(x, shift())).collect(), truth)
}

#[test]
fn sound_bodies_give_no_reason() {
    // Edges and corners are no noise. But of 24 random samples some look like anything: near the edges of
    // a block, where a quarter of its samples lie, one in 14 sees those of the other side as a sheet.
    assert_most(Reason::Unexplained, 0.97, &torus(8_000, 3), everywhere);
    let block = cuboid(8_000, [1.0; 3], 4);
    assert_most(Reason::Unexplained, 0.93, &block, everywhere);
}

#[test]
fn a_thin_plate_and_a_sharp_edge_are_thin() {
    // 8,000 samples on 2 × 2 × 2: spacing 0.032.
    for half in [0.006, 0.016, 0.032] {
        let plate = cuboid(8_000, [1.0, 1.0, half], 5);
        // Two spacings apart, the axes of many samples lie in the sheet.
        assert_most(Reason::Thin, 0.85, &plate, |x| {
            x[0].abs().max(x[1].abs()) < 0.9
        });
    }
    let wedge: Sampled = {
        let mut random = Random(6);
        (0..8_000)
            .map(|i| {
                let (x, y) = (random.unit(), 2.0 * random.unit());
                let side = if i % 2 == 0 { 1.0 } else { -1.0 };
                ([x, y, side * 0.1 * x], [-0.1, 0.0, side])
            })
            .unzip()
    };
    // Spacing 0.022: from 0.1 to 2.7 spacings thick.
    assert_most(Reason::Thin, 0.75, &wedge, |x| {
        (0.01..0.3).contains(&x[0]) && (0.1..1.9).contains(&x[1])
    });
}

#[test]
fn a_plate_is_thin_even_where_one_side_has_the_wrong_sign() {
    let plate = cuboid(8_000, [1.0, 1.0, 0.024], 5);
    let mut asked = Asked::new(&plate);
    for n in &mut asked.orientation.normals {
        *n = scale(*n, if n[2] < 0.0 { -1.0 } else { 1.0 });
    }
    let doubt = Doubt::count(plate.0.len(), &asked.reasons(&plate));
    // Its edges are open to a judge who takes both sides for one.
    assert!(doubt.share_of(Reason::Thin) > 0.8, "{doubt:?}");
}

#[test]
fn a_sparse_part_and_outliers_are_sparse() {
    let dense = cut(sphere(8_000, ORIGIN, 1.0, 7), |x| x[2] > -0.3);
    let sparse = cut(sphere(500, ORIGIN, 1.0, 8), |x| x[2] < -0.3);
    assert_most(Reason::Sparse, 0.95, &join(dense, sparse), |x| x[2] < -0.5);
    let mut outliers = sphere(10_000, ORIGIN, 1.0, 9);
    let mut random = Random(10);
    for _ in 0..60 {
        let place = scale(random.direction(), 1.3 + 0.5 * random.unit());
        outliers.0.push(place);
        outliers.1.push([0.0, 0.0, 1.0]);
    }
    assert_most(Reason::Sparse, 1.0, &outliers, |x| vector::norm(x) > 1.2);
}

#[test]
fn a_bowl_is_open_as_a_whole_and_a_hole_near_its_rim() {
    let bowl = cut(sphere(8_000, ORIGIN, 1.0, 11), |x| x[2] < 0.0);
    assert_most(Reason::Open, 0.97, &bowl, everywhere);
    let holed = cut(torus(8_000, 12), |x| {
        vector::norm(add(x, [-0.95, 0.0, 0.0])) > 0.15
    });
    let rim = |x: [f64; 3]| vector::norm(add(x, [-0.95, 0.0, 0.0])) < 0.19;
    assert_most(Reason::Open, 0.97, &holed, rim);
}

#[test]
fn scatter_is_noise() {
    // 8,000 samples on 4π: spacing 0.04.
    for deviation in [0.024, 0.05] {
        let ball = noisy(sphere(8_000, ORIGIN, 1.0, 13), deviation);
        assert_most(Reason::Noisy, 0.85, &ball, everywhere);
    }
}

#[test]
fn reasons_are_those_of_the_doubtful_points_in_order_on_any_number_of_threads() {
    let bowl = cut(sphere(4_000, ORIGIN, 1.0, 11), |x| x[2] < 0.2);
    let mut asked = Asked::new(&bowl);
    for (i, confidence) in asked.orientation.confidence.iter_mut().enumerate() {
        *confidence = [0.0, 0.0999, f64::NAN, 0.1, 1.0][i % 5];
    }
    let found: Vec<_> = [1, 2, 5]
        .iter()
        .map(|&threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| asked.reasons(&bowl))
        })
        .collect();
    assert!(found[0] == found[1] && found[0] == found[2]);
    let indices = found[0].iter().map(|f| f.0);
    let doubtful = (0..bowl.0.len() as u32).filter(|i| i % 5 < 3);
    assert!(indices.eq(doubtful));
    let doubt = Doubt::count(bowl.0.len(), &found[0]);
    let by_reason: usize = Reason::ALL.iter().map(|&r| doubt.of(r)).sum();
    assert_eq!(by_reason, doubt.doubtful());
    assert_eq!(doubt.by_frequency()[0], Reason::Open);
    assert!((doubt.share() - 0.6).abs() < 1e-3);
}

#[test]
fn whatever_the_points_are_there_is_a_reason() {
    let mut random = Random(14);
    let mut cube = || [(); 3].map(|()| random.unit());
    let volume: Vec<_> = (0..2000).map(|_| cube()).collect();
    let four = vec![ORIGIN, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let line: Vec<_> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let duplicates = vec![sphere(100, ORIGIN, 1.0, 9).0; 40].concat();
    for points in [volume, four, line, duplicates] {
        let truth = vec![[0.0, 0.0, 1.0]; points.len()];
        let sampled = (points, truth);
        let found = Asked::new(&sampled).reasons(&sampled);
        assert_eq!(found.len(), sampled.0.len());
    }
}
