//! Oracles: brute force over all points.

use rayon::ThreadPoolBuilder;

use super::{CellIndex, Error, Neighborhoods, Radius, forward};
use crate::Real;

/// Uniform numbers in `[0, 1)` (xorshift64*).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn point(&mut self, scale: f64) -> [f64; 3] {
        [0; 3].map(|_| scale * self.uniform())
    }
}

/// `n` samples of the unit sphere, spread evenly along a spiral.
pub(crate) fn even_sphere(n: usize) -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..n)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let (r, angle) = ((1.0 - z * z).sqrt(), golden * i as f64);
            [r * angle.cos(), r * angle.sin(), z]
        })
        .collect()
}

/// `n` uniform random samples of the torus of radii 0.7 and 0.25, with their outward normals.
pub(crate) fn torus(n: usize, seed: u64) -> Vec<([f64; 3], [f64; 3])> {
    let mut random = Random::new(seed);
    let mut samples = Vec::new();
    while samples.len() < n {
        let [u, v] = [0; 2].map(|_| std::f64::consts::TAU * random.uniform());
        let to_axis = 0.7 + 0.25 * v.cos();
        // As many samples as there is area: in proportion to the distance to the axis.
        if random.uniform() * 0.95 < to_axis {
            let point = [to_axis * u.cos(), to_axis * u.sin(), 0.25 * v.sin()];
            samples.push((point, [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()]));
        }
    }
    samples
}

/// Clouds that break careless indices.
pub(crate) fn ugly_clouds<T: Real>() -> Vec<(&'static str, Vec<[T; 3]>)> {
    let mut random = Random::new(7);
    let mut make = |n: usize, f: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| -> Vec<[T; 3]> {
        (0..n)
            .map(|i| crate::vector::of_f64(f(i, random.point(1.0))))
            .collect()
    };
    vec![
        ("cube", make(700, &|_, p| p)),
        (
            "far from the origin",
            make(500, &|_, p| p.map(|x| 1e6 + 100.0 * x)),
        ),
        (
            "nine tenths in one place",
            make(600, &|i, p| {
                if i % 10 == 0 { p } else { p.map(|x| 1e-6 * x) }
            }),
        ),
        (
            "two clusters far apart",
            make(400, &|i, p| p.map(|x| x + 1e6 * (i % 2) as f64)),
        ),
        (
            "one outlier",
            make(400, &|i, p| if i == 17 { [1e9, -1e9, 1e9] } else { p }),
        ),
        (
            "many equal points",
            make(500, &|i, p| {
                p.map(|x| {
                    if i % 3 == 0 {
                        0.25
                    } else {
                        (4.0 * x).floor() / 4.0
                    }
                })
            }),
        ),
        ("a line", make(300, &|_, p| [p[0], 0.5, 0.5])),
        (
            "a lattice",
            make(512, &|i, _| [i & 7, (i >> 3) & 7, i >> 6].map(|x| x as f64)),
        ),
        ("four points", make(4, &|_, p| p)),
        ("seventeen points", make(17, &|_, p| p)),
    ]
}

fn distance_squared<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let d = crate::vector::sub(a, b);
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// All points by `(distance², coordinates, index)`.
fn by_distance<T: Real>(points: &[[T; 3]], query: [T; 3]) -> Vec<(u32, T)> {
    let mut all: Vec<_> = (0u32..)
        .zip(points.iter().map(|&p| distance_squared(p, query)))
        .collect();
    let place = |&(i, _): &(u32, T)| points[i as usize];
    all.sort_by(|a, b| {
        let by_distance = a.1.f64().total_cmp(&b.1.f64());
        let by_place = place(a).partial_cmp(&place(b)).expect("finite points");
        by_distance.then(by_place).then(a.0.cmp(&b.0))
    });
    all
}

pub(super) fn queries<T: Real>(points: &[[T; 3]]) -> Vec<[T; 3]> {
    let some = points.iter().step_by(points.len().div_ceil(40)).copied();
    let beside = points.iter().step_by(97).map(|p| p.map(|x| x + T::of(0.1)));
    some.chain(beside)
        .chain([[T::of(-3e8); 3], [T::of(0.5); 3]])
        .collect()
}

fn nearest_agrees_with_brute_force<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let index = CellIndex::new(&points);
        let (mut found, mut distances) = (Vec::new(), Vec::new());
        for query in queries(&points) {
            let all = by_distance(&points, query);
            for k in [0, 1, 8, 24, 1000] {
                index.nearest(query, k, &mut found);
                assert_eq!(
                    found,
                    all[..k.min(all.len())],
                    "{name}, k = {k}, at {query:?}"
                );
                let farthest = found.last().map_or(T::zero(), |&(_, d2)| d2);
                let reach = index.reach_squared(query, k, &mut distances);
                assert_eq!(reach, farthest, "{name}, k = {k}, at {query:?}");
            }
        }
    }
}

#[test]
fn nearest_agrees_with_brute_force_in_f32_and_f64() {
    nearest_agrees_with_brute_force::<f32>();
    nearest_agrees_with_brute_force::<f64>();
}

/// In a volume the cells near to another one hold far more points than are near to it.
#[test]
fn reaches_in_a_volume_agree_with_single_searches() {
    let mut random = Random::new(3);
    let points: Vec<[f64; 3]> = (0..8000).map(|_| random.point(1.0)).collect();
    let index = CellIndex::new(&points);
    let (mut reaches, mut distances) = (vec![0.0; points.len()], Vec::new());
    for k in [24, 40, 60, 90] {
        index.reaches_squared(k, &mut reaches);
        for (position, &reach) in reaches.iter().enumerate() {
            let expected = index.reach_squared(index.point(position), k, &mut distances);
            assert_eq!(reach, expected, "k = {k}, position {position}");
        }
    }
}

fn nearest_of_all_agree_with_single_searches<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let index = CellIndex::new(&points);
        let (mut reaches, mut distances) = (vec![T::zero(); points.len()], Vec::new());
        for k in [1, 2, 8, 24, 80, 1000] {
            index.reaches_squared(k, &mut reaches);
            for (position, &reach) in reaches.iter().enumerate().step_by(3) {
                let expected = index.reach_squared(index.point(position), k, &mut distances);
                assert_eq!(reach, expected, "{name}, k = {k}");
            }
        }
        let (mut all, mut found) = (vec![[0; 5]; points.len()], Vec::new());
        let mut by_place = Vec::new();
        index.positions_by_place(&mut by_place);
        for radius in [0.0, 1e-3, 0.1, 0.3, 1e3] {
            index.nearest_of_all(T::of(radius), &by_place, &mut all);
            for (&position, others) in by_place.iter().zip(&all).step_by(7) {
                let position = position as usize;
                index.nearest_positions(index.point(position), 6, &mut found);
                let mut expected: Vec<_> = found.iter().map(|&(other, _)| other).collect();
                expected.retain(|&other| other as usize != position);
                expected.resize(5, position as u32);
                assert_eq!(others[..], expected, "{name}, radius {radius}");
            }
        }
    }
}

#[test]
fn nearest_of_all_agree_with_single_searches_in_f32_and_f64() {
    nearest_of_all_agree_with_single_searches::<f32>();
    nearest_of_all_agree_with_single_searches::<f64>();
}

#[test]
fn points_within_a_radius_agree_with_brute_force() {
    for (name, points) in ugly_clouds::<f32>() {
        let index = CellIndex::new(&points);
        for query in queries(&points) {
            for radius in [-1.0f32, 0.0, 0.01, 0.25, 1.0, 1e7] {
                let mut found = Vec::new();
                index.for_each_within(query, radius, |i, d2| found.push((i as u32, d2)));
                found.sort_by_key(|&(i, _)| i);
                let mut expected = by_distance(&points, query);
                expected.retain(|&(_, d2)| radius >= 0.0 && d2 <= radius * radius);
                expected.sort_by_key(|&(i, _)| i);
                assert_eq!(found, expected, "{name}, radius {radius}, at {query:?}");
            }
        }
    }
}

#[test]
fn radii_grow_to_the_eighth_sample_and_counts_agree_with_brute_force() {
    for (name, points) in ugly_clouds::<f64>() {
        for radius in [
            Radius::Auto,
            Radius::Fixed(0.05),
            Radius::Fixed(1e-9),
            Radius::Fixed(30.0),
        ] {
            let mut found = Neighborhoods::default();
            forward(&points, radius, &mut found).expect(name);
            let common = found.common_radius;
            for (i, &point) in points.iter().enumerate() {
                let all = by_distance(&points, point);
                let within = |r: f64| all.iter().filter(|a| a.1 <= r * r).count();
                let eighth = all[8.min(all.len()) - 1].1.sqrt();
                let expected = common.max(1.05 * eighth);
                assert_eq!(found.radius[i], expected, "{name}, {radius:?}, point {i}");
                assert_eq!(
                    found.count[i] as usize,
                    within(expected),
                    "{name}, {radius:?}, point {i}"
                );
            }
        }
    }
}

#[test]
fn isolated_samples_are_those_that_their_neighbors_do_not_have() {
    for (name, points) in ugly_clouds::<f64>() {
        let mut found = Neighborhoods::default();
        forward(&points, Radius::Auto, &mut found).expect(name);
        for (i, &point) in points.iter().enumerate() {
            let near = |j: usize, r: f64| distance_squared(points[j], point) <= r * r;
            let neighbors = (0..points.len()).filter(|&j| j != i && near(j, found.radius[i]));
            let neighbors: Vec<usize> = neighbors.collect();
            let mutual = neighbors
                .iter()
                .filter(|&&j| near(j, found.radius[j]))
                .count();
            let expected = 8 * mutual < neighbors.len();
            assert_eq!(found.isolated[i], expected, "{name}, point {i}");
        }
        assert!(found.isolated.iter().any(|&x| !x), "{name}");
        assert_eq!(
            name == "one outlier",
            found.isolated[17.min(points.len() - 1)],
            "{name}"
        );
    }
}

#[test]
fn order_is_a_permutation_and_a_rebuilt_index_is_a_new_one() {
    let mut reused = CellIndex::<f32>::default();
    for (name, points) in ugly_clouds::<f32>() {
        reused.rebuild(&points);
        let new = CellIndex::new(&points);
        assert_eq!(reused.order(), new.order(), "{name}");
        let mut sorted = new.order().to_vec();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..points.len() as u32), "{name}");
    }
}

#[test]
fn automatic_radius_holds_about_24_samples_of_an_even_sphere() {
    let n = 4000;
    let points = even_sphere(n);
    let mut found = Neighborhoods::default();
    forward(&points, Radius::Auto, &mut found).expect("valid");
    let mut counts = found.count.clone();
    counts.sort_unstable();
    assert!(
        (22..=27).contains(&counts[n / 2]),
        "median {}",
        counts[n / 2]
    );
    // One sample has 4π/n to itself.
    let expected = (4.0 * std::f64::consts::PI / n as f64).sqrt();
    assert!(
        (found.spacing() / expected - 1.0).abs() < 0.05,
        "{}",
        found.spacing() / expected
    );
    assert_eq!(found.grown(), 0);
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let mut random = Random::new(3);
    let points: Vec<[f32; 3]> = (0..9000)
        .map(|i| {
            random
                .point(if i % 10 == 0 { 1.0 } else { 0.2 })
                .map(|x| x as f32)
        })
        .collect();
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let mut found = Neighborhoods::default();
            forward(&points, Radius::Auto, &mut found).expect("valid");
            (found.index.order().to_vec(), found.radius, found.count)
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn heavily_clustered_clouds_take_no_quadratic_time() {
    // Quadratic queries over these would take hours, so finishing is the property.
    let mut random = Random::new(5);
    let n = 100_000;
    let equal = vec![[0.5f32; 3]; n];
    let mut clusters: Vec<[f32; 3]> = (0..n)
        .map(|_| random.point(1e-3).map(|x| x as f32))
        .collect();
    clusters[0] = [1e6; 3];
    let (mut found, mut distances) = (Vec::new(), Vec::new());
    for points in [equal, clusters] {
        let index = CellIndex::new(&points);
        for &query in &points {
            index.nearest(query, 8, &mut found);
            assert_eq!(found.len(), 8);
            index.reach_squared(query, 8, &mut distances);
        }
        index.reaches_squared(8, &mut vec![0.0; n]);
        let mut by_place = Vec::new();
        index.positions_by_place(&mut by_place);
        for radius in [1e-6, 1.0] {
            index.nearest_of_all(radius, &by_place, &mut vec![[0; 7]; n]);
        }
    }
}

#[test]
fn bad_clouds_are_refused_with_a_reason() {
    let message = |points: &[[f32; 3]], radius| {
        forward(points, radius, &mut Neighborhoods::default())
            .expect_err("refused")
            .to_string()
    };
    let corners = [
        [0.0f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    for few in 0..4 {
        assert!(message(&corners[..few], Radius::Auto).contains("at least 4"));
    }
    assert!(message(&[[1.0; 3]; 9], Radius::Auto).contains("equal"));
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-20, 1e20] {
        assert!(
            message(&corners, Radius::Fixed(radius)).contains("positive"),
            "{radius}"
        );
    }
    let with = |x: f32| [corners[0], corners[1], corners[2], [0.0, x, 0.0]];
    assert!(message(&with(f32::NAN), Radius::Auto).contains("point 3"));
    assert!(message(&with(1e30), Radius::Auto).contains("f64"));
    assert!(message(&corners.map(|p| p.map(|x| x * 1e-30)), Radius::Auto).contains("f64"));
    let refused = forward(
        &[[f64::MAX, 0.0, 0.0]; 4].map(|p| p),
        Radius::Auto,
        &mut Neighborhoods::default(),
    );
    assert_eq!(refused, Err(Error::AllEqual { points: 4 }));
}
