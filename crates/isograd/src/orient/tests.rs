//! Signs against the bodies that the samples were taken from.

use super::shapes::{
    Random, Sampled, cuboid, cut, inside_out, join, neighborhoods, oriented, sphere, torus,
};
use super::*;
use crate::normals;
use crate::vector::{add, dot, scale};

const ORIGIN: [f64; 3] = [0.0; 3];

pub(super) struct Outcome {
    orientation: Orientation<f64>,
    /// Signs that are wrong, among axes within 60 degrees of the truth, and how many those are.
    pub(super) wrong: usize,
    judged: usize,
}

/// Axes by D-PCA, with signs that say nothing.
fn axes<T: Real>(neighborhoods: &Neighborhoods<T>) -> Vec<[T; 3]> {
    let mut residual = normals::Residual::default();
    normals::forward(neighborhoods, &mut residual);
    let mut random = Random(0x5eed);
    let turn = |n: [T; 3]| {
        if random.unit() < 0.5 {
            n.map(|x| -x)
        } else {
            n
        }
    };
    residual.normals.into_iter().map(turn).collect()
}

fn run<T: Real>(points: &[[T; 3]], method: &Method) -> (Vec<[T; 3]>, Orientation<T>) {
    let neighborhoods = neighborhoods(points);
    let axes = axes(&neighborhoods);
    let out = oriented(points, &axes, &neighborhoods, None, method).unwrap();
    (axes, out)
}

pub(super) fn orient(sampled: &Sampled) -> Outcome {
    let (_, orientation) = run(&sampled.0, &Method::Auto);
    let cosines = orientation
        .normals
        .iter()
        .zip(&sampled.1)
        .map(|(&n, &t)| dot(n, t));
    let judged: Vec<f64> = cosines.filter(|c| c.abs() > 0.5).collect();
    let wrong = judged.iter().filter(|&&c| c < 0.0).count();
    Outcome {
        orientation,
        wrong,
        judged: judged.len(),
    }
}

/// Share of samples that are doubtful by chance: where random samples are close together, an axis can be far off, and its
/// couplings with it.
const FEW: f64 = 0.001;

/// All signs are right, and at most this share of them doubtful.
fn assert_right(name: &str, sampled: Sampled, doubtful: f64) {
    let outcome = orient(&sampled);
    assert_eq!(outcome.wrong, 0, "{name}");
    assert!(
        outcome.judged as f64 >= 0.9 * sampled.0.len() as f64,
        "{name}"
    );
    assert!(outcome.orientation.doubtful() <= doubtful, "{name}");
}

#[test]
fn closed_bodies_are_oriented_with_hardly_a_doubt() {
    for n in [60, 300, 5000] {
        assert_right("sphere", sphere(n, ORIGIN, 1.0, 1), 0.0);
    }
    for n in [700, 5000] {
        assert_right("torus", torus(n, 2), FEW);
    }
}

#[test]
fn separate_bodies_are_oriented_each() {
    for distance in [2.07, 2.5, 1e5] {
        let other = sphere(3000, [distance, 0.0, 0.0], 1.0, 4);
        // Where they all but touch, the samples of either hide the other from one side.
        assert_right(
            "two spheres",
            join(sphere(3000, ORIGIN, 1.0, 3), other),
            0.01,
        );
    }
}

#[test]
fn walls_of_cavities_point_into_the_cavity() {
    let hollow = || {
        join(
            sphere(8000, ORIGIN, 1.0, 3),
            inside_out(sphere(4000, ORIGIN, 0.7, 4)),
        )
    };
    assert_right("hollow sphere", hollow(), FEW);
    let nested = join(hollow(), sphere(1000, ORIGIN, 0.35, 5));
    assert_right("ball in a hollow sphere", nested, FEW);
}

#[test]
fn thin_plates_have_two_sides() {
    // 20,000 samples on 2 × 2 × 2: spacing 0.02.
    let plate = orient(&cuboid(20_000, [1.0, 1.0, 0.03], 5));
    assert!(
        plate.wrong * 1000 <= plate.judged,
        "3 spacings: {}",
        plate.wrong
    );
    let plate = orient(&cuboid(20_000, [1.0, 1.0, 0.02], 5));
    // At two spacings a neighborhood holds both sides, and a quarter of the axes lie in the plate.
    assert!(
        plate.wrong * 100 <= plate.judged,
        "2 spacings: {}",
        plate.wrong
    );
}

#[test]
fn a_hole_in_the_sampling_does_not_mislead() {
    for top in [0.9, 0.5] {
        let holed = cut(sphere(8000, ORIGIN, 1.0, 6), |x| x[2] < top);
        assert_right("sphere with a hole", holed, 0.0);
    }
}

#[test]
fn open_surfaces_have_consistent_signs_and_are_not_sure_of_them() {
    let hemisphere = cut(sphere(8000, ORIGIN, 1.0, 6), |x| x[2] > 0.0);
    let tube = cut(cuboid(8000, [0.3, 0.3, 1.0], 7), |x| x[2].abs() < 0.99);
    for (name, sampled) in [("hemisphere", hemisphere), ("tube", tube)] {
        let outcome = orient(&sampled);
        assert_eq!(outcome.wrong, 0, "{name}");
        let confidence = outcome.orientation.confidence;
        assert!(confidence.iter().all(|&c| c < 0.9), "{name}");
        let mean = confidence.iter().sum::<f64>() / confidence.len() as f64;
        assert!(mean < 0.7, "{name}: {mean}");
    }
}

/// Random samples of the height field `z = f(x, y)` over the unit square, from the height and its two slopes.
fn height_field(n: usize, seed: u64, f: impl Fn(f64, f64) -> [f64; 3]) -> Sampled {
    let mut random = Random(seed);
    let sample = |_| {
        let (x, y) = (random.unit(), random.unit());
        let [z, dx, dy] = f(x, y);
        ([x, y, z], vector::normalized([-dx, -dy, 1.0]).unwrap())
    };
    (0..n).map(sample).unzip()
}

fn wave(x: f64, y: f64) -> [f64; 3] {
    let ((sin_x, cos_x), (sin_y, cos_y)) = ((12.0 * x).sin_cos(), (12.0 * y).sin_cos());
    [
        0.1 * sin_x * sin_y,
        1.2 * cos_x * sin_y,
        1.2 * sin_x * cos_y,
    ]
}

/// Hills and valleys of several sizes; root mean square slope 1.
fn terrain(x: f64, y: f64) -> [f64; 3] {
    let waves = (1..=12).map(f64::from).map(|k| {
        let (u, v) = (2.5 * k * (1.7 * k).cos(), 2.5 * k * (1.7 * k).sin());
        let (sin, cos) = (u * x + v * y + 2.3 * k * k).sin_cos();
        let amplitude = 0.4 / (2.5 * k);
        [sin, u * cos, v * cos].map(|value| amplitude * value)
    });
    waves.fold([0.0; 3], add)
}

#[test]
fn sheets_without_an_inside_are_consistent() {
    let wavy = height_field(20_000, 99, wave);
    let flat: Sampled = (0..10_000)
        .map(|i| ([(i % 100) as f64, (i / 100) as f64, 0.0], [0.0, 0.0, 1.0]))
        .unzip();
    let mut sheets = vec![("wavy", wavy), ("flat", flat)];
    sheets.extend([1, 2, 3].map(|seed| {
        (
            "other samples of the wavy one",
            height_field(20_000, seed, wave),
        )
    }));
    sheets.extend([5, 6].map(|seed| ("terrain", height_field(30_000, seed, terrain))));
    for (name, sampled) in sheets {
        let outcome = orient(&sampled);
        let one_way = outcome.wrong == 0 || outcome.wrong == outcome.judged;
        assert!(one_way, "{name}: {} of {}", outcome.wrong, outcome.judged);
        let doubtful = outcome.orientation.doubtful();
        // Crests and troughs of the wavy one look like lids for a while.
        assert!(doubtful > 0.6, "{name}: {doubtful}");
    }
}

#[test]
fn noise_below_the_spacing_does_no_harm() {
    let mut random = Random(17);
    let mut sampled = sphere(8000, ORIGIN, 1.0, 6);
    for (x, n) in sampled.0.iter_mut().zip(&sampled.1) {
        *x = add(*x, scale(*n, 0.02 * (random.unit() - 0.5)));
    }
    assert_right("noisy sphere", sampled, 0.0);
}

#[test]
fn outliers_do_no_harm_however_far() {
    let mut random = Random(8);
    let mut sampled = sphere(10_000, ORIGIN, 1.0, 8);
    let outlier = [(); 3].map(|()| 6.0 * random.unit() - 3.0);
    assert!(
        vector::norm(outlier) > 1.2,
        "an outlier must not lie on the sphere: {outlier:?}"
    );
    for _ in 0..100 {
        sampled.0.push([(); 3].map(|()| 6.0 * random.unit() - 3.0));
        // No truth: not judged.
        sampled.1.push([0.0; 3]);
    }
    assert_right("1 % outliers", sampled.clone(), 0.01);
    sampled.0.push([1e9, 0.0, 0.0]);
    sampled.1.push([0.0; 3]);
    assert_right("and one far away", sampled, 0.01);
}

#[test]
fn whatever_the_points_are_there_is_an_answer() {
    let mut random = Random(5);
    let mut cube = || [(); 3].map(|()| random.unit());
    let volume: Vec<_> = (0..3000).map(|_| cube()).collect();
    let four = vec![ORIGIN, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let line = (0..3000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let duplicates = vec![sphere(500, ORIGIN, 1.0, 9).0; 20].concat();
    let pair = (0..1000)
        .map(|i| if i % 2 == 0 { ORIGIN } else { [1.0; 3] })
        .collect();
    let clumps = (0..3000)
        .map(|i| add(scale(cube(), 1e-9), [f64::from(i % 30); 3]))
        .collect();
    for points in [volume, four, line, duplicates, pair, clumps] {
        for method in [Method::Auto, Method::Parity(ParityOptions::default())] {
            let neighborhoods = neighborhoods(&points);
            let axes = axes(&neighborhoods);
            let out = match oriented(&points, &axes, &neighborhoods, None, &method) {
                Ok(out) => out,
                Err(Error::DetectionRadius { .. }) => continue,
                Err(error) => panic!("{error}"),
            };
            assert!(out.confidence.iter().all(|c| (0.0..=1.0).contains(c)));
            for (n, a) in out.normals.iter().zip(&axes) {
                assert!(n == a || *n == a.map(|x| -x));
            }
        }
    }
}

#[test]
fn counts_add_up() {
    let sampled = torus(2000, 12);
    for method in [Method::Auto, Method::Parity(ParityOptions::default())] {
        let (axes, out) = run(&sampled.0, &method);
        let Decided {
            given,
            parity,
            evidence,
            neighbors,
            rule,
        } = out.decided;
        assert_eq!(given + parity + evidence + neighbors + rule, 2000);
        let changed = axes
            .iter()
            .zip(&out.normals)
            .filter(|(a, n)| a != n)
            .count();
        assert_eq!(out.flipped, changed);
    }
}

#[test]
fn the_sign_of_the_axes_does_not_matter() {
    let (points, _) = torus(2000, 12);
    let neighborhoods = neighborhoods(&points);
    let mut axes = axes(&neighborhoods);
    let mut outputs = Vec::new();
    let mut scratch = Scratch::default();
    for _ in 0..2 {
        let (mut out, near) = (Orientation::default(), &neighborhoods);
        let method = &Method::Auto;
        forward(&points, &axes, near, None, method, &mut scratch, &mut out).unwrap();
        outputs.push(out);
        axes.iter_mut().step_by(3).for_each(|a| *a = a.map(|x| -x));
    }
    assert_eq!(outputs[0].normals, outputs[1].normals);
}

#[test]
fn single_precision_far_from_the_origin_gives_the_same_signs() {
    let (points, normals) = torus(4000, 12);
    let far: Vec<[f32; 3]> = points
        .iter()
        .map(|&x| add(x, [1e3; 3]).map(|x| x as f32))
        .collect();
    let (_, out) = run(&far, &Method::Auto);
    let wrong = out
        .normals
        .iter()
        .zip(&normals)
        .filter(|&(&n, &t)| dot(vector::to_f64(n), t) < 0.0);
    assert_eq!(wrong.count(), 0);
}

#[test]
fn any_number_of_threads_and_a_used_scratch_give_the_same_bits() {
    let clouds = [
        torus(5000, 3).0,
        cuboid(9000, [1.0, 1.0, 0.03], 4).0,
        torus(5000, 3).0,
    ];
    let all = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (mut scratch, mut out) = (Scratch::default(), Orientation::default());
        let mut results = Vec::new();
        for points in &clouds {
            pool.install(|| {
                let near = &neighborhoods(points);
                let (axes, method) = (axes(near), &Method::Auto);
                forward(points, &axes, near, None, method, &mut scratch, &mut out)
            })
            .unwrap();
            results.push((out.normals.clone(), out.confidence.clone(), out.flipped));
        }
        results
    };
    let reference = all(1);
    assert!(reference[0] == reference[2], "a used scratch");
    for threads in [2, 5] {
        assert!(all(threads) == reference, "{threads} threads");
    }
}

#[test]
fn given_normals_are_made_unit_and_trusted() {
    let (points, normals) = sphere(200, ORIGIN, 1.0, 7);
    let inward: Vec<_> = normals.iter().map(|&n| scale(n, -3e-200)).collect();
    let neighborhoods = neighborhoods(&points);
    let take = |given: Option<&[[f64; 3]]>| {
        oriented(&points, &Vec::new(), &neighborhoods, given, &Method::Given)
    };
    let taken = take(Some(&inward)).unwrap();
    for (n, t) in taken.normals.iter().zip(&normals) {
        assert!(dot(*n, *t) < -1.0 + 1e-14);
    }
    assert_eq!((taken.flipped, taken.decided.given), (0, 200));
    assert_eq!(take(None).unwrap_err(), Error::NoNormals);
    let mut broken = inward.clone();
    broken[17] = [0.0; 3];
    let kind = "the normal";
    assert_eq!(
        take(Some(&broken)).unwrap_err(),
        Error::NoDirection { index: 17, kind }
    );
    broken[5] = [0.0, f64::NAN, 1.0];
    assert_eq!(
        take(Some(&broken)).unwrap_err(),
        Error::NoDirection { index: 5, kind }
    );
    assert!(matches!(
        take(Some(&inward[1..])),
        Err(Error::Count { vectors: 199, .. })
    ));
}

#[test]
fn axes_turn_to_the_side_of_given_normals_and_keep_their_direction() {
    let (points, normals) = sphere(300, ORIGIN, 1.0, 7);
    let neighborhoods = neighborhoods(&points);
    let axes = axes(&neighborhoods);
    // Wrong by up to 80 degrees, of any length, and pointing inward: their side is what counts.
    let given: Vec<_> = (0..300)
        .map(|i| {
            let across = vector::cross(normals[i], [0.3, 0.5, 0.7]);
            let off = add(normals[i], scale(across, 4.0));
            scale(off, -((i + 1) as f64))
        })
        .collect();
    let turn = |given: Option<&[[f64; 3]]>| {
        oriented(&points, &axes, &neighborhoods, given, &Method::Signs)
    };
    let turned = turn(Some(&given)).unwrap();
    let mut flipped = 0;
    for i in 0..300 {
        let is_flipped = turned.normals[i] != axes[i];
        flipped += usize::from(is_flipped);
        assert!(!is_flipped || turned.normals[i] == scale(axes[i], -1.0));
        let cosine = dot(turned.normals[i], vector::normalized(given[i]).unwrap());
        assert!((cosine - turned.confidence[i]).abs() < 1e-15 && cosine > 0.0);
        assert!(dot(turned.normals[i], normals[i]) < 0.0, "inward");
    }
    assert_eq!((turned.flipped, turned.decided.given), (flipped, 300));
    assert_eq!(turned.method.name(), "signs");
    assert_eq!(turn(None).unwrap_err(), Error::NoNormals);
    let mut broken = given.clone();
    broken[9] = [0.0; 3];
    let kind = "the normal";
    assert_eq!(
        turn(Some(&broken)).unwrap_err(),
        Error::NoDirection { index: 9, kind }
    );
    assert!(matches!(
        turn(Some(&given[1..])),
        Err(Error::Count { vectors: 299, .. })
    ));
}

#[test]
fn axes_without_a_direction_are_refused() {
    let (points, mut axes) = sphere(50, ORIGIN, 1.0, 7);
    axes[3] = [0.0; 3];
    let neighborhoods = neighborhoods(&points);
    let outcome = oriented(&points, &axes, &neighborhoods, None, &Method::Auto);
    let kind = "the axis";
    assert_eq!(outcome.unwrap_err(), Error::NoDirection { index: 3, kind });
}
