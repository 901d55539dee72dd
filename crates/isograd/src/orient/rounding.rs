//! How coarsely the coordinates of a cloud are rounded: to the digits of a file, or to voxels.
//!
//! Samples of one rounded surface lie on planes of the lattice of all coordinates, which are not sheets.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

use super::sites::Sites;
use crate::Real;
use crate::neighbors::Neighborhoods;
use crate::vector;

/// Samples whose coordinates are compared.
const SAMPLES: usize = 1 << 13;

/// Differences below this many spacings are rounding of floating point.
const EQUAL: f64 = 1e-3;

/// Of this many differences the smallest is the step: a few may be smaller.
const OF: usize = 10;

/// Differences are multiples of a step up to this share of it, and at most one of [`EXCEPTIONS`] is not.
const EXACT: f64 = 0.05;
const EXCEPTIONS: usize = 50;

/// Sheets of which samples on one are this many steps from the other are two: three rounded samples span a plane up to
/// half a step from the surface between them and farther beyond, and other samples are as far on its other side.
const STEPS: f32 = 1.5;

/// Lattice of rounded coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rounding {
    /// Step along each axis, in spacings; 0 where coordinates have at most two values, and everywhere if any axis has
    /// no step.
    step: [f32; 3],
}

impl Rounding {
    /// The lattice of a cloud.
    pub(super) fn find<T: Real>(neighborhoods: &Neighborhoods<T>, sites: &Sites) -> Self {
        let index = &neighborhoods.index;
        let taken = index.len().min(SAMPLES);
        let sample = |k: usize| index.point(sites.position(k * index.len() / taken));
        let samples: Vec<[f64; 3]> = (0..taken).map(|k| vector::to_f64(sample(k))).collect();
        let spacing = neighborhoods.spacing().f64();
        let along = |a: usize| step(samples.iter().map(|x| x[a] / spacing).collect());
        let step = match [along(0), along(1), along(2)] {
            [Some(x), Some(y), Some(z)] => [x, y, z].map(|step| step as f32),
            _ => [0.0; 3],
        };
        Self { step }
    }

    /// Least distance between two sheets with this normal, in spacings: less can be rounding.
    #[inline(always)]
    pub(super) fn least_distance(self, normal: [f32; 3]) -> f32 {
        let [x, y, z] = self.step;
        STEPS * ((x * normal[0]).abs() + (y * normal[1]).abs() + (z * normal[2]).abs())
    }
}

/// The step that all coordinates are multiples of, from some origin on; 0 if they have at most two values, `None` if they
/// have no step.
fn step(mut coordinates: Vec<f64>) -> Option<f64> {
    coordinates.sort_unstable_by(f64::total_cmp);
    let differences = coordinates.windows(2).map(|pair| pair[1] - pair[0]);
    let mut differences: Vec<f64> = differences.filter(|&d| d > EQUAL).collect();
    if differences.len() < 2 {
        return Some(0.0);
    }
    let tenth = differences.len() / OF;
    let step = *differences.select_nth_unstable_by(tenth, f64::total_cmp).1;
    let is_multiple = |d: f64| (d / step - (d / step).round()).abs() <= EXACT;
    let others = differences.iter().filter(|&&d| !is_multiple(d)).count();
    (others * EXCEPTIONS <= differences.len()).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Random, Sampled, cuboid, neighborhoods, sphere, torus};
    use super::super::tests::orient;
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Steps in the unit of the points.
    fn steps<T: Real>(points: &[[T; 3]]) -> [f64; 3] {
        let near = neighborhoods(points);
        let mut sites = Sites::default();
        sites.find(&near);
        let found = Rounding::find(&near, &sites);
        found
            .step
            .map(|step| f64::from(step) * near.spacing().f64())
    }

    fn assert_steps<T: Real>(points: &[[T; 3]], expected: [f64; 3]) {
        let found = steps(points);
        for (a, b) in found.into_iter().zip(expected) {
            assert!((a - b).abs() <= 1e-3 * b, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn steps_of_rounded_coordinates_are_found() {
        let ball = sphere(20_000, [0.3, -7.0, 0.0], 1.0, 3).0;
        let cube = cuboid(20_000, [1.0; 3], 5).0;
        for points in [ball, cube] {
            for step in [[0.001; 3], [0.01; 3], [0.02, 0.02, 0.05]] {
                let round = |a: usize, x: f64| (x / step[a]).round() * step[a];
                let round = |x: &[f64; 3]| std::array::from_fn(|a| round(a, x[a]));
                let rounded: Vec<[f64; 3]> = points.iter().map(round).collect();
                assert_steps(&rounded, step);
                let single: Vec<[f32; 3]> = rounded.into_iter().map(vector::of_f64).collect();
                assert_steps(&single, step);
            }
        }
    }

    #[test]
    fn single_precision_far_from_the_origin_has_a_step() {
        let points = sphere(20_000, [5e5; 3], 1.0, 3).0;
        let single: Vec<[f32; 3]> = points.into_iter().map(vector::of_f64).collect();
        assert_steps(&single, [1.0 / 32.0; 3]);
    }

    #[test]
    fn other_coordinates_have_no_step() {
        let mut random = Random(3);
        let plate = |_| [random.unit(), random.unit(), random.unit().round() * 0.01];
        let plate: Vec<[f64; 3]> = (0..5000).map(plate).collect();
        let tube = |k: usize| {
            let (sin, cos) = (TAU * (k % 100) as f64 / 100.0).sin_cos();
            [cos, sin, 0.06 * (k / 100) as f64]
        };
        let tube: Vec<[f64; 3]> = (0..5000).map(tube).collect();
        let ball = sphere(5000, [0.0; 3], 1.0, 3).0;
        let cube = cuboid(5000, [1.0; 3], 5).0;
        for points in [plate, tube, ball, cube] {
            assert_steps(&points, [0.0; 3]);
        }
    }

    /// Two sheets that are closer than their samples are not steps, though these lie on a lattice.
    #[test]
    fn two_values_have_no_step() {
        let lattice = |k: usize| [k % 50, k / 50 % 50, k / 2500].map(|i| i as f64);
        let plate = |k: usize| {
            let [x, y, z] = lattice(k);
            [x, y, 0.3 * z]
        };
        let points: Vec<[f64; 3]> = (0..5000).map(plate).collect();
        assert_steps(&points, [1.0, 1.0, 0.0]);
    }

    fn rounded((points, normals): Sampled, step: f64) -> Sampled {
        let round = |x: f64| (x / step).round() * step;
        (points.iter().map(|x| x.map(round)).collect(), normals)
    }

    /// A cube whose faces slant against the axes: each consists of steps. Samples are 0.035 apart.
    #[test]
    fn signs_are_right_on_slanting_faces() {
        let (points, normals) = cuboid(20_000, [1.0; 3], 5);
        for (degrees, step) in [
            (1.0, 0.001),
            (1.0, 0.004),
            (1.0, 0.006),
            (25.0, 0.006),
            (25.0, 0.018),
        ] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let turn = |&[x, y, z]: &[f64; 3]| {
                let [y, z] = [cos * y - sin * z, sin * y + cos * z];
                [cos * x + sin * z, y, cos * z - sin * x]
            };
            let turned = (
                points.iter().map(turn).collect(),
                normals.iter().map(turn).collect(),
            );
            let wrong = orient(&rounded(turned, step)).wrong;
            assert!(wrong <= 20, "{degrees} degrees, {step}: {wrong}");
        }
    }

    /// Voxels as large as the distance of samples, and twice as large: centers repeat.
    #[test]
    fn signs_of_voxels_are_right() {
        let ball = sphere(20_000, [0.0; 3], 1.0, 3);
        let torus = torus(20_000, 3);
        let area = 4.0 * PI * PI * 0.7 * 0.25;
        for (name, body, area) in [("ball", ball, 4.0 * PI), ("torus", torus, area)] {
            for step in [1.0, 2.0] {
                let spacing = f64::sqrt(area / 20_000.0);
                let voxels = rounded(body.clone(), step * spacing);
                let wrong = orient(&voxels).wrong;
                assert!(wrong <= 20, "{name}, {step}: {wrong}");
            }
        }
    }
}
