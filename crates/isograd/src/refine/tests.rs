use super::{GAIN, PullbackScratch, Scratch, forward, pullback};
use crate::neighbors::tests::{Random, torus, ugly_clouds};
use crate::neighbors::{self, Neighborhoods, RadiiCotangent, Radius};
use crate::testing::{assert_adjoint, assert_same_bits, inner, moved, vectors};
use crate::{Real, normals, vector};

/// A point and its outward unit normal.
type Sample = ([f64; 3], [f64; 3]);

fn near(points: &[[f64; 3]], radius: Radius) -> Neighborhoods<f64> {
    let mut near = Neighborhoods::default();
    neighbors::forward(points, radius, &mut near).expect("a cloud");
    near
}

fn refined(near: &Neighborhoods<f64>, normals: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut out = normals.to_vec();
    forward(near, &mut Scratch::default(), &mut out);
    out
}

fn normalized(v: [f64; 3]) -> [f64; 3] {
    vector::normalized(v).expect("a direction")
}

/// Axes of samples, turned to the side of their normals.
fn outward(samples: &[Sample], near: &Neighborhoods<f64>) -> Vec<[f64; 3]> {
    let mut axes = normals::Residual::default();
    normals::forward(near, &mut axes);
    let turn = |(axis, sample): (&[f64; 3], &Sample)| {
        vector::scale(*axis, vector::dot(*axis, sample.1).signum())
    };
    axes.normals.iter().zip(samples).map(turn).collect()
}

/// Cotangents of the normals before and of the points, through the radii too, from those of the refined normals.
fn pulled<T: Real>(
    near: &Neighborhoods<T>,
    normals: &[[T; 3]],
    bars: &[[T; 3]],
) -> [Vec<[T; 3]>; 2] {
    let (mut bars, mut points_bar) = (bars.to_vec(), vec![[T::zero(); 3]; bars.len()]);
    let mut radii = RadiiCotangent::default();
    let scratch = &mut PullbackScratch::default();
    pullback(
        near,
        normals,
        &mut bars,
        scratch,
        &mut points_bar,
        &mut radii,
    );
    neighbors::pullback(near, &radii, &mut points_bar);
    [bars, points_bar]
}

/// Mean angle to the normals of the samples, in degrees.
fn mean_angle(normals: &[[f64; 3]], samples: &[Sample]) -> f64 {
    let angle =
        |(n, sample): (&[f64; 3], &Sample)| vector::dot(*n, sample.1).clamp(-1.0, 1.0).acos();
    let sum: f64 = normals.iter().zip(samples).map(angle).sum();
    (sum / samples.len() as f64).to_degrees()
}

/// Mean angles before and after, of samples with noise along all axes.
fn angles(mut samples: Vec<Sample>, noise: f64) -> [f64; 2] {
    let mut random = Random::new(5);
    for (point, _) in &mut samples {
        *point = point.map(|x| x + noise * (2.0 * random.uniform() - 1.0));
    }
    let points: Vec<_> = samples.iter().map(|s| s.0).collect();
    let near = near(&points, Radius::Auto);
    let before = outward(&samples, &near);
    let after = refined(&near, &before);
    [&before, &after].map(|normals| mean_angle(normals, &samples))
}

/// A straight tube whose circumference is `around` samples' spacings.
fn tube(around: f64, n: usize) -> Vec<Sample> {
    let (mut random, radius) = (Random::new(3), 0.05);
    let spacing = std::f64::consts::TAU * radius / around;
    let length = n as f64 * spacing * spacing / (std::f64::consts::TAU * radius);
    let mut sample = || {
        let (sin, cos) = (std::f64::consts::TAU * random.uniform()).sin_cos();
        let along = length * random.uniform();
        ([radius * cos, radius * sin, along], [cos, sin, 0.0])
    };
    (0..n).map(|_| sample()).collect()
}

/// Two faces of a plate, `thickness` spacings apart.
fn plate(thickness: f64, n: usize) -> Vec<Sample> {
    let mut random = Random::new(4);
    let height = thickness * (2.0 / n as f64).sqrt();
    let mut sample = |i: usize| {
        let side = (i % 2) as f64;
        let point = [random.uniform(), random.uniform(), side * height];
        (point, [0.0, 0.0, 2.0 * side - 1.0])
    };
    (0..n).map(&mut sample).collect()
}

#[test]
fn tubes_and_plates_of_few_spacings_get_their_normals() {
    for (name, samples, most) in [
        ("tube of 9 spacings around", tube(9.0, 2000), 0.65),
        ("tube of 14", tube(14.0, 2000), 0.4),
        ("plate of 1.5", plate(1.5, 3000), 0.7),
        ("plate of 2.5", plate(2.5, 3000), 0.7),
        ("torus", torus(4000, 8), 0.5),
    ] {
        let [before, after] = angles(samples, 0.0);
        println!("{name}: {before:.2} → {after:.2} degrees");
        assert!(after < most * before, "{name}: {before} {after}");
    }
}

/// The torus' tube has a radius of 0.3; its samples are about 0.045 apart.
#[test]
fn noise_is_no_quadric() {
    for (noise, most) in [(0.01, 1.0), (0.03, 1.1), (0.06, 1.1), (0.1, 1.1)] {
        let [before, after] = angles(torus(4000, 8), noise);
        println!("{noise}: {before:.2} → {after:.2} degrees");
        assert!(after < most * before, "{noise}: {before} {after}");
    }
}

#[test]
fn normals_of_a_paraboloid_are_exact_up_to_the_ridge() {
    let mut random = Random::new(9);
    let mut sample = || {
        let [x, y] = [0; 2].map(|_| 2.0 * random.uniform() - 1.0);
        let z = 0.2 * x * x - 0.1 * x * y + 0.15 * y * y;
        let normal = normalized([0.1 * y - 0.4 * x, 0.1 * x - 0.3 * y, 1.0]);
        ([x, y, z], normal)
    };
    let samples: Vec<Sample> = (0..2000).map(|_| sample()).collect();
    let [before, after] = angles(samples, 0.0);
    println!("{before:.4} → {after:.4} degrees");
    // At the rim planes are off, and nowhere is there noise.
    assert!(after < 0.2 * before, "{before} {after}");
}

#[test]
fn a_radius_that_is_given_leaves_normals_alone() {
    let samples = torus(500, 1);
    let points: Vec<_> = samples.iter().map(|s| s.0).collect();
    let normals: Vec<_> = samples.iter().map(|s| s.1).collect();
    for radius in [Radius::Fixed(0.3), Radius::Cut(0.3)] {
        let near = near(&points, radius);
        assert_eq!(refined(&near, &normals), normals);
        let [bars, points_bar] = pulled(&near, &normals, &normals);
        assert_eq!(bars, normals);
        assert_eq!(points_bar, vec![[0.0; 3]; points.len()]);
    }
}

/// The formulas of the module's page by Gaussian elimination over all pairs.
fn by_elimination(
    near: &Neighborhoods<f64>,
    points: &[[f64; 3]],
    normals: &[[f64; 3]],
) -> Vec<[f64; 3]> {
    let at = |i: usize| {
        let (n, radius) = (normals[i], near.radius[i]);
        let [t, b] = vector::tangents(n).expect("a direction");
        let mut system = vec![vec![0.0; 7]; 6];
        let (mut total, mut heights, mut squares) = (0.0, 0.0, 0.0);
        for (point, normal) in points.iter().zip(normals) {
            let d = vector::scale(vector::sub(*point, points[i]), 1.0 / radius);
            let r = vector::norm(d);
            if r > 1.0 {
                continue;
            }
            let fall = (5.0 * (1.0 - r)).min(1.0);
            let agreement = vector::dot(n, *normal).max(0.0);
            let w = fall * fall * (3.0 - 2.0 * fall) / (r + 0.2) * agreement;
            let [x, y, z] = [t, b, n].map(|axis| vector::dot(axis, d));
            let terms = [1.0, x, y, x * x, x * y, y * y];
            for (row, a) in system.iter_mut().zip(terms) {
                for (entry, b) in row.iter_mut().zip(terms.into_iter().chain([z])) {
                    *entry += w * a * b;
                }
            }
            total += w;
            heights += w * z;
            squares += w * z * z;
        }
        let right: Vec<f64> = system.iter().map(|row| row[6]).collect();
        for (k, ridge) in [0.0, 1.0, 1.0, 1.0, 0.5, 1.0].into_iter().enumerate() {
            system[k][k] += 3e-4 * total * ridge;
        }
        let p = eliminated(system);
        let explained: f64 = p.iter().zip(right).map(|(p, g)| p * g).sum();
        let quadric = (squares - explained) / total;
        let plane = squares / total - (heights / total).powi(2);
        let quotient = (quadric.max(0.0) + 1e-5) / (plane.max(0.0) + 1e-5);
        let share = ((GAIN[1] - quotient) / (GAIN[1] - GAIN[0])).clamp(0.0, 1.0);
        let slope = vector::add(vector::scale(t, p[1]), vector::scale(b, p[2]));
        normalized(vector::sub(n, vector::scale(slope, share)))
    };
    (0..points.len()).map(at).collect()
}

/// The solution of six equations, whose right sides are last.
fn eliminated(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    for k in 0..6 {
        let pivot = rows[k].clone();
        for row in (0..6).filter(|&row| row != k) {
            let factor = rows[row][k] / pivot[k];
            for (entry, pivot) in rows[row].iter_mut().zip(&pivot) {
                *entry -= factor * pivot;
            }
        }
    }
    (0..6).map(|k| rows[k][6] / rows[k][k]).collect()
}

/// A torus with few samples at one end, where radii grow, and some noise.
fn uneven() -> Vec<Sample> {
    let mut random = Random::new(2);
    let thinned = torus(1600, 4).into_iter().enumerate();
    let thinned = thinned.filter(|(i, s)| s.0[0] < 0.4 || i % 9 == 0);
    let mut rough = |(_, (point, normal)): (usize, Sample)| {
        (point.map(|x| x + 0.02 * random.uniform()), normal)
    };
    thinned.map(&mut rough).collect()
}

#[test]
fn normals_are_those_of_a_plain_elimination() {
    let samples = uneven();
    let points: Vec<_> = samples.iter().map(|s| s.0).collect();
    let near = near(&points, Radius::Auto);
    assert!(near.grown() > 10, "{}", near.grown());
    let before = outward(&samples, &near);
    let expected = by_elimination(&near, &points, &before);
    let found = refined(&near, &before);
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| vector::norm(vector::sub(*a, *b));
    let worst = found
        .iter()
        .zip(&expected)
        .map(distance)
        .fold(0.0, f64::max);
    let turned = before.iter().zip(&found).map(distance).fold(0.0, f64::max);
    assert!(turned > 0.1, "{turned}");
    assert!(worst < 1e-10, "{worst:e}");
}

#[test]
fn the_pullback_is_the_transpose_of_the_derivative() {
    let samples = uneven();
    let points: Vec<_> = samples.iter().map(|s| s.0).collect();
    let n = points.len();
    let held = near(&points, Radius::Auto);
    let before = outward(&samples, &held);
    let mut random = Random::new(12);
    let [v, u, w] = [0; 3].map(|_| vectors(n, &mut random));
    let tangential: Vec<[f64; 3]> = before
        .iter()
        .zip(&u)
        .map(|(n, u)| vector::sub(*u, vector::scale(*n, vector::dot(*n, *u))))
        .collect();
    let [bars, points_bar] = pulled(&held, &before, &w);
    let step = 1e-7 * held.common_radius;
    let loss = |points: &[[f64; 3]], normals: Vec<[f64; 3]>| {
        let mut near = Neighborhoods::default();
        neighbors::hold(points, &held, &mut near).expect("as before");
        inner(&refined(&near, &normals), &w)
    };
    assert_adjoint("points", inner(&points_bar, &v), step, |s| {
        loss(&moved(&points, &v, s), before.clone())
    });
    assert_adjoint("normals", inner(&bars, &tangential), 1e-6, |s| {
        let normals = moved(&before, &tangential, s);
        loss(&points, normals.into_iter().map(normalized).collect())
    });
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let samples = uneven();
    let points: Vec<_> = samples.iter().map(|s| s.0).collect();
    assert_same_bits(|| {
        let near = near(&points, Radius::Auto);
        let before = outward(&samples, &near);
        (refined(&near, &before), pulled(&near, &before, &before))
    });
}

#[test]
fn degenerate_clouds_have_finite_normals_and_gradients_in_f32_and_f64() {
    degenerate::<f32>();
    degenerate::<f64>();
}

fn degenerate<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let mut near = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut near).expect("a valid cloud");
        let mut axes = normals::Residual::default();
        normals::forward(&near, &mut axes);
        let mut found = axes.normals.clone();
        forward(&near, &mut Scratch::default(), &mut found);
        let bars = vec![[T::one(), T::of(-0.3), T::of(0.7)]; points.len()];
        let pulled = pulled(&near, &axes.normals, &bars);
        for normal in &found {
            let length = vector::norm(vector::to_f64(*normal));
            assert!((length - 1.0).abs() < 1e-6, "{name}: {normal:?}");
        }
        for list in pulled {
            let bad = list.iter().position(|&v| !vector::is_finite(v));
            assert_eq!(bad, None, "{name}");
        }
    }
}
