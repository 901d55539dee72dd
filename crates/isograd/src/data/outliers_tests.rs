//! Detection of outliers: which samples it leaves out, and which it keeps.

use super::outliers::Outliers;
use crate::testing::noise;

/// Samples on the unit sphere, times a radius, around a center.
fn sphere(count: usize, radius: f64, center: [f64; 3], seed: u64) -> Vec<[f64; 3]> {
    let mut next = noise(seed);
    let mut points = Vec::new();
    while points.len() < count {
        let p = [next(), next(), next()];
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (0.05..0.5).contains(&length) {
            points.push(std::array::from_fn(|a| center[a] + radius * p[a] / length));
        }
    }
    points
}

fn left_out(points: &[[f64; 3]]) -> Vec<u32> {
    Outliers::Ignore.select(points).left_out().to_vec()
}

#[test]
fn isolated_far_samples_are_left_out_at_any_scale_place_and_order() {
    let mut points = sphere(2000, 1.0, [0.0; 3], 1);
    let far = [
        [100.0, 0.0, 0.0],
        [-7.0, 30.0, 5.0],
        [-7.1, 30.0, 5.0],
        [0.0, 0.0, -1e6],
    ];
    for (k, p) in far.into_iter().enumerate() {
        points.insert(300 * k + 7, p);
    }
    let expected = vec![7, 307, 607, 907];
    assert_eq!(left_out(&points), expected);
    assert!(Outliers::Keep.select(&points).is_all());
    for (scale, shift) in [(1e-6, 0.0), (1e9, -4e9), (3.0, 1e3)] {
        let moved: Vec<_> = points
            .iter()
            .map(|p| p.map(|x| scale * x + shift))
            .collect();
        assert_eq!(left_out(&moved), expected, "{scale} {shift}");
    }
    let last = points.len() as u32 - 1;
    points.reverse();
    let reversed: Vec<u32> = expected.iter().rev().map(|i| last - i).collect();
    assert_eq!(left_out(&points), reversed);
    let single: Vec<[f32; 3]> = points.iter().map(|p| p.map(|x| x as f32)).collect();
    assert_eq!(Outliers::Ignore.select(&single).left_out(), reversed);
}

#[test]
fn as_many_outliers_as_the_root_of_the_samples_are_left_out() {
    let mut next = noise(2);
    let body = sphere(40_000, 1.0, [3.0, 0.0, 0.0], 3);
    for (count, expected) in [(150, 150), (300, 0)] {
        let mut points = body.clone();
        points.extend((0..count).map(|_| [0; 3].map(|_| 4000.0 * next())));
        assert_eq!(left_out(&points).len(), expected, "{count}");
    }
}

#[test]
fn bodies_are_kept_however_small_and_far() {
    let body = sphere(5000, 1.0, [0.0; 3], 4);
    for (count, radius, center) in [
        (5000, 1.0, [1000.0, 0.0, 0.0]),
        (20, 0.02, [1e5, 1e5, 0.0]),
        (4, 0.1, [0.0, -50.0, 0.0]),
    ] {
        let mut points = body.clone();
        points.extend(sphere(count, radius, center, 5));
        assert_eq!(left_out(&points), [0; 0], "{count}");
    }
}

#[test]
fn ground_planes_tails_and_sparse_parts_are_kept() {
    let mut next = noise(6);
    let body = sphere(20_000, 1.0, [0.0; 3], 7);
    // A plane a hundred times as wide, its samples 0.9 of the body's width apart.
    let mut ground = body.clone();
    for i in 0..111 {
        for j in 0..111 {
            ground.push([1.8 * f64::from(i) - 99.0, 1.8 * f64::from(j) - 99.0, -1.0]);
        }
    }
    assert_eq!(left_out(&ground), [0; 0]);
    // A tail of 60 samples, thirty times as long as the body.
    let mut tail = body.clone();
    tail.extend((0..60).map(|k| [1.0 + f64::from(k), 0.01 * next(), 0.0]));
    assert_eq!(left_out(&tail), [0; 0]);
    // A scan whose density falls with the square of the distance.
    let mut scan = body;
    scan.extend((1..120).map(|k| {
        let r = 1.0 / (1.01 - f64::from(k) / 120.0);
        [r, 0.3 * r * next(), 0.3 * r * next()]
    }));
    assert_eq!(left_out(&scan), [0; 0]);
}

#[test]
fn small_and_degenerate_clouds_are_kept() {
    for count in [0, 1, 2, 50, 98] {
        let mut points = sphere(count, 1.0, [0.0; 3], 8);
        points.push([100.0, 0.0, 0.0]);
        assert_eq!(left_out(&points), [0; 0], "{count}");
    }
    let mut heap = vec![[1.0; 3]; 400];
    assert_eq!(left_out(&heap), [0; 0]);
    heap.push([2.0; 3]);
    assert_eq!(left_out(&heap), [0; 0], "the rest has no extent");
    let huge: Vec<_> = sphere(500, 1e308, [0.0; 3], 9);
    assert_eq!(left_out(&huge), [0; 0]);
    // Samples of very different density, and an even line.
    let mut next = noise(10);
    let line: Vec<_> = (0..500).map(|k| [f64::from(k), 0.0, 0.0]).collect();
    assert_eq!(left_out(&line), [0; 0]);
    for seed in 0..50 {
        let power = 1.0 + 0.2 * f64::from(seed);
        let points: Vec<[f64; 3]> = (0..1000)
            .map(|_| {
                [0; 3]
                    .map(|_| 2.0 * next())
                    .map(|x: f64| x.signum() * x.abs().powf(power))
            })
            .collect();
        assert_eq!(left_out(&points), [0; 0], "power {power}");
    }
}

#[test]
fn rows_are_gathered_and_scattered() {
    let mut points = sphere(500, 1.0, [0.0; 3], 11);
    points.insert(0, [90.0, 0.0, 0.0]);
    points.push([0.0, 80.0, 0.0]);
    points.insert(40, [0.0, -80.0, 0.0]);
    let selection = Outliers::Ignore.select(&points);
    assert_eq!(selection.left_out(), [0, 40, 502]);
    let rows: Vec<u32> = (0..1006).collect();
    let used = selection.gather(&rows, 2);
    assert_eq!(used.len(), 1000);
    let all = selection.scatter(&used, 2, u32::MAX);
    for (i, pair) in all.chunks(2).enumerate() {
        let i = i as u32;
        let expected = match selection.left_out().contains(&i) {
            true => [u32::MAX; 2],
            false => [2 * i, 2 * i + 1],
        };
        assert_eq!(pair, expected);
    }
}
