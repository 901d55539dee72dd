use super::*;
use crate::testing::assert_same_bits;

/// A small random generator (xorshift64*).
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 20) % n
    }

    fn unit(&mut self) -> f64 {
        self.below(1 << 40) as f64 / (1u64 << 40) as f64
    }
}

/// Points of a lattice, with ties and duplicates, and scattered ones; some far away.
fn cloud(n: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random::new(seed);
    let point = |_| match random.below(4) {
        0 => [(); 3].map(|()| random.unit()),
        1 if random.below(10) == 0 => [(); 3].map(|()| 5.0 * random.unit() - 2.0),
        _ => [(); 3].map(|()| random.below(5) as f64 * 0.25),
    };
    (0..n).map(point).collect()
}

fn shuffled(points: &[[f64; 3]], seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random::new(seed);
    let mut points = points.to_vec();
    for i in (1..points.len()).rev() {
        points.swap(i, random.below(i as u64 + 1) as usize);
    }
    points
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    vector::norm_squared(vector::sub(a, b))
}

/// Every step, for a cloud of unit size.
fn steps() -> Vec<Options> {
    let none = Options::default();
    let statistical = |neighbors, ratio| Some(Statistical { neighbors, ratio });
    let radius = |radius, neighbors| Some(Sparse { radius, neighbors });
    vec![
        Options {
            duplicates: Some(0.0),
            ..none
        },
        Options {
            duplicates: Some(0.05),
            ..none
        },
        Options {
            statistical: statistical(6, 1.0),
            ..none
        },
        Options {
            statistical: statistical(1, 0.0),
            ..none
        },
        Options {
            radius: radius(0.25, 3),
            ..none
        },
        Options {
            radius: radius(0.1, 1),
            ..none
        },
        Options {
            voxel: Some(0.25),
            ..none
        },
        Options {
            voxel: Some(0.3),
            ..none
        },
        Options {
            poisson_disk: Some(0.25),
            ..none
        },
        Options {
            poisson_disk: Some(0.3),
            ..none
        },
        Options {
            drop_not_finite: true,
            duplicates: Some(0.0),
            statistical: statistical(4, 2.0),
            radius: radius(0.4, 2),
            voxel: Some(0.1),
            poisson_disk: Some(0.15),
        },
    ]
}

fn kept(points: &[[f64; 3]], options: &Options) -> Vec<u32> {
    clean(points, options).expect("cleaned").kept
}

#[test]
fn kept_points_do_not_depend_on_the_order_of_the_input() {
    for seed in 0..8 {
        let points = cloud(400, seed);
        for options in steps() {
            let sorted = |points: &[[f64; 3]]| {
                let indices = kept(points, &options);
                assert!(indices.is_sorted_by(|a, b| a < b));
                let mut kept: Vec<_> = indices.iter().map(|&i| points[i as usize]).collect();
                kept.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
                kept
            };
            assert_eq!(
                sorted(&points),
                sorted(&shuffled(&points, seed + 1)),
                "{options:?}"
            );
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let points = cloud(5000, 3);
    assert_same_bits(|| steps().map_each(|options| clean(&points, options).expect("cleaned")));
}

trait MapEach {
    fn map_each(self, f: impl Fn(&Options) -> Cleaned) -> Vec<Cleaned>;
}

impl MapEach for Vec<Options> {
    fn map_each(self, f: impl Fn(&Options) -> Cleaned) -> Vec<Cleaned> {
        self.iter().map(f).collect()
    }
}

#[test]
fn equal_points_are_kept_once_and_the_first_of_them() {
    for seed in 0..5 {
        let points = cloud(300, seed);
        let is_first = |i: &usize| !points[..*i].contains(&points[*i]);
        let expected: Vec<u32> = (0..points.len())
            .filter(is_first)
            .map(|i| i as u32)
            .collect();
        assert!(expected.len() < 290);
        assert_eq!(duplicates(&points, 0.0).expect("valid"), expected);
    }
    let zeros = [[0.0, 0.0, 0.0], [-0.0, 0.0, 0.0], [1e-200, 0.0, 0.0]];
    assert_eq!(duplicates(&zeros, 0.0).expect("valid"), [0, 2]);
}

#[test]
fn thinned_samples_are_apart_and_cover_the_others() {
    for (seed, distance) in [(1, 0.05), (2, 0.25), (3, 0.3), (4, 1.0), (5, 100.0)] {
        let points = cloud(300, seed);
        let kept = poisson_disk(&points, distance).expect("valid");
        let near = |a: usize, b: u32| squared(points[a], points[b as usize]) <= distance * distance;
        for i in 0..points.len() {
            let count = kept.iter().filter(|&&j| near(i, j)).count();
            if kept.contains(&(i as u32)) {
                assert_eq!(count, 1, "only itself");
            } else {
                assert!(count > 0, "{i} is not covered");
            }
        }
        assert_eq!(kept, duplicates(&points, distance).expect("valid"));
    }
}

#[test]
fn one_sample_of_each_voxel_is_kept_the_one_nearest_to_their_mean() {
    for (seed, size) in [(1, 0.25), (2, 0.4), (3, 10.0)] {
        let points = cloud(300, seed);
        let voxel_of = |i: usize| points[i].map(|x| (x / size).floor() as i64);
        let kept = voxel(&points, size).expect("valid");
        let mut seen = Vec::new();
        for &i in &kept {
            let i = i as usize;
            assert!(!seen.contains(&voxel_of(i)));
            seen.push(voxel_of(i));
            let members = (0..points.len()).filter(|&j| voxel_of(j) == voxel_of(i));
            let members: Vec<[f64; 3]> = members.map(|j| points[j]).collect();
            let sum = members.iter().fold([0.0; 3], |sum, &p| vector::add(sum, p));
            let mean = vector::scale(sum, 1.0 / members.len() as f64);
            let least = members
                .iter()
                .map(|&p| squared(p, mean))
                .fold(f64::INFINITY, f64::min);
            assert!(squared(points[i], mean) <= least + 1e-12);
        }
        assert!((0..points.len()).all(|i| seen.contains(&voxel_of(i))));
    }
}

#[test]
fn outliers_are_those_of_all_pairs_tried() {
    for seed in 0..5 {
        let points = cloud(200, seed);
        for (neighbors, ratio) in [(1, 0.0), (4, 1.0), (9, 2.5), (500, 0.5)] {
            let mean = |i: usize| {
                let others = (0..points.len()).filter(|&j| j != i);
                let mut others: Vec<f64> = others.map(|j| squared(points[i], points[j])).collect();
                others.sort_by(f64::total_cmp);
                others.truncate(neighbors);
                others.iter().map(|d| d.sqrt()).sum::<f64>() / others.len() as f64
            };
            let means: Vec<f64> = (0..points.len()).map(mean).collect();
            let average = means.iter().sum::<f64>() / 200.0;
            let variance = means.iter().map(|m| (m - average).powi(2)).sum::<f64>() / 199.0;
            let limit = average + ratio * variance.sqrt();
            let kept = statistical_outliers(&points, Statistical { neighbors, ratio });
            let kept = kept.expect("valid");
            for (i, mean) in (0u32..).zip(means) {
                // Sums in another order.
                if (mean - limit).abs() > 1e-12 {
                    assert_eq!(kept.contains(&i), mean < limit, "{neighbors} {ratio}");
                }
            }
        }
        for (radius, neighbors) in [(0.25, 4), (0.05, 1), (0.3, 0), (0.5, 1000)] {
            let kept = radius_outliers(&points, Sparse { radius, neighbors }).expect("valid");
            for i in 0..points.len() {
                let within = |&p: &&[f64; 3]| squared(points[i], *p) <= radius * radius;
                let others = points.iter().filter(within).count() - 1;
                assert_eq!(kept.contains(&(i as u32)), others >= neighbors);
            }
        }
    }
}

#[test]
fn steps_are_applied_one_after_the_other_to_what_is_left() {
    let mut points = cloud(300, 9);
    points.insert(5, [f64::NAN, 0.0, 0.0]);
    points.insert(50, [0.0, f64::INFINITY, 0.0]);
    let options = steps().pop().expect("the last has all steps");
    let cleaned = clean(&points, &options).expect("cleaned");
    let names: Vec<_> = cleaned.removed.iter().map(|(name, _)| *name).collect();
    let all = [
        "drop_not_finite",
        "duplicates",
        "statistical",
        "radius",
        "voxel",
        "poisson_disk",
    ];
    assert_eq!(names, all);
    assert_eq!(cleaned.removed[0].1, 2);
    let removed: usize = cleaned.removed.iter().map(|(_, count)| count).sum();
    assert_eq!(cleaned.kept.len() + removed, points.len());
    let (mut left, none) = (points.clone(), Options::default());
    for step in [
        Options {
            drop_not_finite: true,
            ..none
        },
        Options {
            duplicates: options.duplicates,
            ..none
        },
        Options {
            statistical: options.statistical,
            ..none
        },
        Options {
            radius: options.radius,
            ..none
        },
        Options {
            voxel: options.voxel,
            ..none
        },
        Options {
            poisson_disk: options.poisson_disk,
            ..none
        },
    ] {
        left = kept(&left, &step)
            .iter()
            .map(|&i| left[i as usize])
            .collect();
    }
    let at_once: Vec<_> = cleaned.kept.iter().map(|&i| points[i as usize]).collect();
    assert_eq!(at_once, left);
}

#[test]
fn single_precision_keeps_the_same_samples() {
    let points = cloud(300, 4)
        .iter()
        .map(|p| p.map(|x| x as f32))
        .collect::<Vec<_>>();
    let wide: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
    for options in steps() {
        assert_eq!(clean(&points, &options), clean(&wide, &options));
    }
}

#[test]
fn clouds_of_few_points_do_not_fail() {
    for options in steps() {
        assert!(kept(&[], &options).is_empty());
        let one = kept(&[[1.0; 3]], &options);
        assert_eq!(
            one.len(),
            usize::from(options.radius.is_none()),
            "{options:?}"
        );
        let equal = clean(&[[1.0; 3]; 40], &options).expect("cleaned");
        assert!(!equal.kept.is_empty() || options.radius.is_some());
    }
}

#[test]
fn bad_input_is_refused_with_a_reason() {
    let refused = |points: &[[f64; 3]], options: Options| {
        clean(points, &options).expect_err("refused").to_string()
    };
    let none = Options::default();
    let nan = [[0.0; 3], [0.0, f64::NAN, 0.0]];
    assert!(refused(&nan, none).contains("point 1 is not finite"));
    assert!(refused(&[[1e200; 3]], none).contains("unit"));
    let one = [[1.0; 3]];
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(
            refused(
                &one,
                Options {
                    duplicates: Some(bad),
                    ..none
                }
            )
            .contains("give")
        );
        assert!(
            refused(
                &one,
                Options {
                    voxel: Some(bad),
                    ..none
                }
            )
            .contains("voxels")
        );
        assert!(
            refused(
                &one,
                Options {
                    poisson_disk: Some(bad),
                    ..none
                }
            )
            .contains("give")
        );
        let radius = Some(Sparse {
            radius: bad,
            neighbors: 1,
        });
        assert!(refused(&one, Options { radius, ..none }).contains("radius"));
        let statistical = Some(Statistical {
            neighbors: 3,
            ratio: bad,
        });
        assert!(
            refused(
                &one,
                Options {
                    statistical,
                    ..none
                }
            )
            .contains("ratio")
        );
    }
    let statistical = Some(Statistical {
        neighbors: 0,
        ratio: 1.0,
    });
    assert!(
        refused(
            &one,
            Options {
                statistical,
                ..none
            }
        )
        .contains("neighbors")
    );
    assert!(
        refused(
            &[[1e9; 3]],
            Options {
                voxel: Some(1e-9),
                ..none
            }
        )
        .contains("larger")
    );
}

#[test]
fn normals_sensors_and_attributes_go_along() {
    let points = cloud(100, 3);
    let doubled: Vec<[f64; 3]> = points.iter().map(|&p| vector::scale(p, 2.0)).collect();
    let attribute = Attribute {
        name: "pair".into(),
        components: 2,
        values: points.iter().flat_map(|p| [p[0], p[2]]).collect(),
    };
    let all = PointCloud::new(points.clone())
        .and_then(|cloud| cloud.with_normals(doubled.clone()))
        .and_then(|cloud| cloud.with_sensors(Sensors::Each(doubled)))
        .and_then(|cloud| cloud.with_attribute(attribute))
        .expect("valid");
    let options = Options {
        voxel: Some(0.25),
        ..Options::default()
    };
    let cleaned = clean(&points, &options).expect("cleaned");
    let kept = cleaned.apply(&all).expect("the same cloud");
    assert_eq!(kept.len(), cleaned.kept.len());
    let (normals, sensors) = (
        kept.normals().expect("normals"),
        kept.sensors().expect("sensors"),
    );
    for (row, &i) in cleaned.kept.iter().enumerate() {
        let point = points[i as usize];
        assert_eq!(kept.points()[row], point);
        assert_eq!(normals[row], vector::scale(point, 2.0));
        assert_eq!(sensors.positions()[row], normals[row]);
        let pair = &kept.attributes()[0].values[2 * row..2 * row + 2];
        assert_eq!(pair, [point[0], point[2]]);
    }
}
