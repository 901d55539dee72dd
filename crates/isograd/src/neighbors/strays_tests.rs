//! Strays: those of a plain search, all that were put in, and nothing that is part of a surface.

use super::tests::{Random, torus};
use super::{Neighborhoods, Radius, forward, strays, with_radii};
use crate::element::eigen;
use crate::{Real, vector};

const NEAREST: usize = 24;

/// Samples of a torus of radii 2 and 0.714.
fn body(n: usize, seed: u64) -> Vec<[f64; 3]> {
    let larger = |(point, _)| vector::scale(point, 2.0 / 0.7);
    torus(n, seed).into_iter().map(larger).collect()
}

/// Uniform random points of a cube around the origin.
fn in_mid_air(n: usize, side: f64, random: &mut Random) -> Vec<[f64; 3]> {
    let mut point = || std::array::from_fn(|_| side * (random.uniform() - 0.5));
    (0..n).map(|_| point()).collect()
}

/// A tube along x, of this radius, from 3 to 5.
fn tube(n: usize, radius: f64, random: &mut Random) -> Vec<[f64; 3]> {
    let mut point = || {
        let turn = std::f64::consts::TAU * random.uniform();
        let along = 3.0 + 2.0 * random.uniform();
        [along, radius * turn.cos(), radius * turn.sin()]
    };
    (0..n).map(|_| point()).collect()
}

/// All of it from the distances of all pairs.
fn by_all_pairs(points: &[[f64; 3]]) -> Vec<u32> {
    let mut found = Neighborhoods::default();
    forward(points, Radius::Auto, &mut found).expect("a cloud");
    let radius = found.common_radius;
    let distance = |i: usize, j: usize| vector::norm(vector::sub(points[i], points[j]));
    let nearest = |i: usize| {
        let mut all: Vec<usize> = (0..points.len()).collect();
        all.sort_by(|&a, &b| distance(i, a).total_cmp(&distance(i, b)));
        all.truncate(NEAREST);
        all
    };
    let nearest: Vec<Vec<usize>> = (0..points.len()).map(nearest).collect();
    let reach: Vec<f64> = (nearest.iter().enumerate())
        .map(|(i, nearest)| distance(i, nearest[NEAREST - 1]))
        .collect();
    let apart: Vec<usize> = (0..points.len())
        .filter(|&i| reach[i] > 2.0 * radius)
        .collect();
    let nearest = &nearest;
    let mutual = |i: usize| {
        let others = nearest[i].iter().copied().filter(move |&j| j != i);
        others.filter(move |&j| nearest[j].contains(&i))
    };
    let fill_a_volume = |i: usize| {
        let near = &nearest[i][..10];
        let mean = near
            .iter()
            .fold([0.0; 3], |m, &j| vector::add(m, points[j]));
        let mean = vector::scale(mean, 0.1);
        let moment = |a: usize, b: usize| {
            let of = |j: usize| (points[j][a] - mean[a]) * (points[j][b] - mean[b]);
            near.iter().map(|&j| of(j)).sum::<f64>()
        };
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let covariance = pairs.map(|(a, b)| moment(a, b));
        let values: [f64; 3] = eigen::eigen(covariance.into()).values.into();
        values[0] > 0.3 * values[1] && values[0] > 0.1 * values[2]
    };
    let is_off = |i: usize| (mutual(i).count() as f64) < 23.0 / 8.0 || fill_a_volume(i);
    let half_are_off =
        |samples: &[usize]| 2 * samples.iter().filter(|&&i| is_off(i)).count() >= samples.len();
    let (mut strays, mut left) = (Vec::new(), apart.clone());
    while let Some(first) = left.pop() {
        let mut group = vec![first];
        while let Some(k) = left
            .iter()
            .position(|&i| group.iter().any(|&j| mutual(j).any(|k| k == i)))
        {
            group.push(left.swap_remove(k));
        }
        let connected = |i: usize| mutual(i).filter(|&j| reach[j] <= 2.0 * radius).count();
        let connected: usize = group.iter().map(|&i| connected(i)).sum();
        let mut reaches: Vec<f64> = group.iter().map(|&i| reach[i]).collect();
        reaches.sort_by(f64::total_cmp);
        let least = 0.5 * reaches[reaches.len() / 2];
        let as_coarse = apart.iter().copied().filter(|&i| reach[i] >= least);
        if (half_are_off(&group) || group.len() < NEAREST)
            && (connected as f64) < 0.05 * 23.0 * group.len() as f64
            && half_are_off(&as_coarse.collect::<Vec<_>>())
        {
            strays.extend(group.into_iter().map(|i| i as u32));
        }
    }
    strays.sort_unstable();
    let most = points.len() as f64 / 10.0;
    if strays.len() as f64 > most {
        Vec::new()
    } else {
        strays
    }
}

#[test]
fn strays_are_those_that_all_pairs_give() {
    let random = &mut Random::new(61);
    let mut found = 0;
    for (samples, strays_in, side) in [
        (700, 3, 6.0),
        (700, 20, 4.0),
        (900, 60, 8.0),
        (500, 70, 5.0),
    ] {
        for seed in 0..4 {
            let mut points = body(samples, seed);
            points.extend(in_mid_air(strays_in, side, random));
            points.extend(tube(5 * seed as usize, 0.05, random));
            let expected = by_all_pairs(&points);
            found += expected.len();
            assert_eq!(strays(&points), Ok(expected), "{strays_in} {seed}");
        }
    }
    assert!(found > 100, "{found}");
}

#[test]
fn samples_in_mid_air_are_found_at_any_scale_place_and_order() {
    let random = &mut Random::new(62);
    for count in [1, 10, 100, 800] {
        let mut points = in_mid_air(count, 12.0, random);
        // Those near the torus are parts of it.
        points.retain(|p| {
            let ring = p[0].hypot(p[1]) - 2.0;
            ring.hypot(p[2]) > 2.0
        });
        let expected: Vec<u32> = (0..points.len() as u32).collect();
        points.extend(body(10_000, 3));
        let found = strays(&points).expect("a cloud");
        let missed = expected.len() - found.iter().filter(|i| expected.contains(i)).count();
        assert!(
            missed * 50 <= expected.len(),
            "{missed} of {}",
            expected.len()
        );
        assert!(
            found.len() - expected.len() + missed <= 1 + count / 5,
            "{} of {count}",
            found.len()
        );
        for scale in [1e-9, 2.0, 1e7] {
            let moved: Vec<_> = (points.iter())
                .map(|p| p.map(|x| scale * (x + 0.25)))
                .collect();
            assert_eq!(strays(&moved).expect("a cloud"), found, "{scale}");
        }
        let single: Vec<_> = points.iter().map(|p| p.map(|x| x as f32)).collect();
        assert_eq!(strays(&single).expect("a cloud"), found);
        points.reverse();
        let last = points.len() as u32 - 1;
        let reversed: Vec<u32> = found.iter().rev().map(|i| last - i).collect();
        assert_eq!(strays(&points).expect("a cloud"), reversed);
    }
}

#[test]
fn sparse_parts_of_a_surface_are_no_strays() {
    let random = &mut Random::new(63);
    let mut clouds = vec![
        ("a tenth", body(20_000, 4)),
        ("a hundredth", body(40_000, 5)),
    ];
    for (k, (_, points)) in clouds.iter_mut().enumerate() {
        let share = [0.1, 0.01][k];
        points.retain(|p| p[0] > 0.0 || random.uniform() < share);
    }
    let gradual = body(40_000, 6);
    let gradual = gradual
        .into_iter()
        .filter(|p| random.uniform() < (-p[0] - 3.0).exp());
    clouds.push(("gradual", gradual.collect()));
    for (name, n, radius) in [
        ("a wire", 60, 0.001),
        ("a thin tube", 250, 0.07),
        ("a tube", 250, 0.1),
    ] {
        let points = [body(60_000, 7), tube(n, radius, random)].concat();
        clouds.push((name, points));
    }
    let second = body(200, 8)
        .into_iter()
        .map(|p| vector::add(p, [7.0, 0.0, 0.0]));
    clouds.push((
        "a second body",
        body(20_000, 9).into_iter().chain(second).collect(),
    ));
    for (name, points) in clouds {
        let mut found = Neighborhoods::default();
        forward(&points, Radius::Auto, &mut found).expect("a cloud");
        assert!(found.has_apart(), "{name}");
        let share = found.strays().len() as f64 / found.apart().len() as f64;
        assert!(share < 0.06, "{name}: {share}");
    }
}

#[test]
fn more_than_a_tenth_and_radii_from_elsewhere_give_none() {
    let random = &mut Random::new(64);
    let mut points = body(3_000, 10);
    points.extend(in_mid_air(450, 20.0, random));
    let mut found = Neighborhoods::default();
    forward(&points, Radius::Auto, &mut found).expect("a cloud");
    assert!(found.has_apart() && found.strays().is_empty());
    points.truncate(3_100);
    // A radius that is given does not matter.
    for radius in [Radius::Auto, Radius::Fixed(0.7), Radius::Cut(0.02)] {
        forward(&points, radius, &mut found).expect("a cloud");
        assert_eq!(
            found.strays().len(),
            strays(&points).expect("a cloud").len()
        );
        assert!(found.strays().len() > 90);
    }
    let (each, common, spacing) = (found.radius.clone(), found.common_radius, found.spacing());
    let radii = super::Radii {
        each: &each,
        common,
        spacing,
    };
    with_radii(&points, radii, &mut found).expect("a cloud");
    assert!(!found.has_apart() && found.strays().is_empty());
    let same = vec![[1.0; 3]; 40];
    assert!(strays(&same).is_err());
    let lattice: Vec<[f64; 3]> = (0..1000)
        .map(|k| [k % 10, k / 10 % 10, k / 100].map(Real::of_usize))
        .collect();
    assert_eq!(strays(&lattice), Ok(Vec::new()));
}
