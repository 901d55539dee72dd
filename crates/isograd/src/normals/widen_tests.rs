//! Which neighborhoods are widened, and what that is good for.

use super::{Residual, forward};
use crate::neighbors::tests::{Random, torus};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::vector;

/// Points and true normals.
type Samples = Vec<([f64; 3], [f64; 3])>;

/// Mean angle in degrees between axes and true normals, and the share of axes from wider neighborhoods, with
/// the automatic radius and with the same radius given.
fn measure(samples: &Samples) -> [(f64, f64); 2] {
    let points: Vec<[f64; 3]> = samples.iter().map(|s| s.0).collect();
    let with = |radius| {
        let mut near = Neighborhoods::default();
        neighbors::forward(&points, radius, &mut near).expect("a valid cloud");
        let mut found = Residual::default();
        forward(&near, &mut found);
        let sine =
            |(n, s): (&[f64; 3], &([f64; 3], [f64; 3]))| vector::norm(vector::cross(*n, s.1));
        let pairs = found.normals.iter().zip(samples);
        let angles = pairs.map(|pair| sine(pair).min(1.0).asin().to_degrees());
        let radii = found.radius.iter().zip(&near.radius);
        let wide = radii.filter(|(wide, own)| wide > own).count();
        let n = samples.len() as f64;
        (
            (angles.sum::<f64>() / n, wide as f64 / n),
            near.common_radius,
        )
    };
    let (automatic, radius) = with(Radius::Auto);
    [automatic, with(Radius::Fixed(radius)).0]
}

/// Gaussian noise along all axes.
fn noisy(mut samples: Samples, deviation: f64) -> Samples {
    let mut random = Random::new(5);
    let mut normal = || {
        let radius = (-2.0 * (1.0 - random.uniform()).ln()).sqrt();
        deviation * radius * (std::f64::consts::TAU * random.uniform()).cos()
    };
    for (point, _) in &mut samples {
        *point = point.map(|x| x + normal());
    }
    samples
}

/// Random samples of two parallel squares of side 1, this many spacings apart.
fn plate(n: usize, apart: f64) -> Samples {
    let mut random = Random::new(6);
    let gap = apart * (2.0 / n as f64).sqrt();
    let sample = |k: usize| {
        let side = (k % 2) as f64;
        let place = [random.uniform(), random.uniform(), gap * side];
        (place, [0.0, 0.0, 2.0 * side - 1.0])
    };
    (0..n).map(sample).collect()
}

/// Random samples of a cube of side 1.
fn cube(n: usize) -> Samples {
    let mut random = Random::new(7);
    let sample = |k: usize| {
        let (axis, side) = (k % 3, (k / 3 % 2) as f64);
        let (mut place, mut normal) = ([0; 3].map(|_| random.uniform()), [0.0; 3]);
        place[axis] = side;
        normal[axis] = 2.0 * side - 1.0;
        (place, normal)
    };
    (0..n).map(sample).collect()
}

#[test]
fn noise_widens_neighborhoods_to_better_axes() {
    // Samples of this torus are 0.024 apart.
    let samples = || torus(12_000, 3);
    for (deviation, gain) in [(0.01, 1.5), (0.015, 2.0), (0.02, 2.5)] {
        let [automatic, given] = measure(&noisy(samples(), deviation));
        assert!(
            gain * automatic.0 < given.0,
            "noise {deviation}: {automatic:?} and {given:?}"
        );
        assert!(
            automatic.0 < 10.0 && given.1 == 0.0,
            "{automatic:?}, {given:?}"
        );
    }
}

#[test]
fn both_sides_of_a_thin_plate_get_the_axis_of_the_plate() {
    for apart in [1.0, 1.5, 2.0] {
        let [automatic, given] = measure(&plate(8_000, apart));
        assert!(
            automatic.0 < 8.0 && 3.0 * automatic.0 < given.0,
            "{apart} spacings: {automatic:?} and {given:?}"
        );
    }
}

#[test]
fn curved_surfaces_and_edges_without_noise_keep_their_neighborhoods() {
    for (name, samples) in [("torus", torus(8_000, 3)), ("cube", cube(8_000))] {
        let [automatic, given] = measure(&samples);
        assert!(automatic.1 < 0.02, "{name}: {automatic:?}");
        assert!(
            (automatic.0 - given.0).abs() < 0.1,
            "{name}: {automatic:?} {given:?}"
        );
    }
}
