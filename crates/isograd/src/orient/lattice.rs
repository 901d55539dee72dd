//! Steps of which coordinates are multiples: those of few digits, of voxels, and of slices.
//!
//! Samples of one rounded surface lie on planes of the lattice of all coordinates, and those of one slice on its plane;
//! these are not sheets.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

use super::sites::Sites;
use crate::Real;
use crate::neighbors::Neighborhoods;

/// Samples whose coordinates are compared.
const SAMPLES: usize = 1 << 13;

/// Differences below this many spacings are rounding of floating point.
const EQUAL: f64 = 1e-3;

/// A tenth of the differences may be smaller than the step.
const SMALLER: usize = 10;

/// Differences are multiples of a step up to this share of it; a fiftieth may be none.
const EXACT: f64 = 0.05;
const OTHERS: usize = 50;

/// Sheets of which samples on one are this many steps from the other are two: three rounded samples span a plane up to
/// half a step from the surface between them and farther beyond, and other samples are as far on its other side.
const STEPS: f32 = 1.5;

/// Lattice of the coordinates of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lattice {
    /// Step along each axis, in spacings; 0 where there is none.
    step: [f32; 3],
}

impl Lattice {
    /// The lattice of a cloud.
    pub(super) fn find<T: Real>(neighborhoods: &Neighborhoods<T>, sites: &Sites) -> Self {
        let index = &neighborhoods.index;
        let taken = index.len().min(SAMPLES);
        let sample = |k: usize| index.point(sites.position(k * index.len() / taken));
        let spacing = neighborhoods.spacing().f64();
        let along = |a: usize| (0..taken).map(|k| sample(k)[a].f64() / spacing).collect();
        Self {
            step: [0, 1, 2].map(|a| step(along(a)) as f32),
        }
    }

    /// Least distance between two sheets with this normal, in spacings: less can be rounding, or that of two slices.
    #[inline(always)]
    pub(super) fn least_distance(self, normal: [f32; 3]) -> f32 {
        let [x, y, z] = self.step;
        STEPS * ((x * normal[0]).abs() + (y * normal[1]).abs() + (z * normal[2]).abs())
    }
}

/// The step that all coordinates are multiples of, from some origin on; 0 if there is none, or if they have at most two
/// values: those of a plate.
fn step(mut coordinates: Vec<f64>) -> f64 {
    coordinates.sort_unstable_by(f64::total_cmp);
    let differences = coordinates.windows(2).map(|pair| pair[1] - pair[0]);
    let mut differences: Vec<f64> = differences.filter(|&d| d > EQUAL).collect();
    if differences.len() < 2 {
        return 0.0;
    }
    let rank = differences.len() / SMALLER;
    let step = *differences.select_nth_unstable_by(rank, f64::total_cmp).1;
    let is_multiple = |d: f64| (d / step - (d / step).round()).abs() <= EXACT;
    let others = differences.iter().filter(|&&d| !is_multiple(d)).count();
    match others * OTHERS <= differences.len() {
        true => step,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Random, Sampled, cuboid, neighborhoods, sphere, torus};
    use super::super::tests::orient;
    use super::*;
    use crate::vector;
    use std::f64::consts::PI;

    /// Steps in the unit of the points.
    fn steps<T: Real>(points: &[[T; 3]]) -> [f64; 3] {
        let near = neighborhoods(points);
        let mut sites = Sites::default();
        sites.find(&near);
        let found = Lattice::find(&near, &sites);
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
        let ball = sphere(5000, [0.0; 3], 1.0, 3).0;
        let cube = cuboid(5000, [1.0; 3], 5).0;
        for points in [plate, ball, cube] {
            assert_steps(&points, [0.0; 3]);
        }
    }

    /// Two sheets that are closer than their samples are not steps, though these lie on a lattice.
    #[test]
    fn two_values_have_no_step() {
        let lattice = (0..5000).map(|k| [k % 50, k / 50 % 50, k / 2500].map(f64::from));
        let points: Vec<[f64; 3]> = lattice.map(|[x, y, z]| [x, y, 0.3 * z]).collect();
        assert_steps(&points, [1.0, 1.0, 0.0]);
    }

    fn rounded((points, normals): Sampled, step: f64) -> Sampled {
        let round = |x: f64| (x / step).round() * step;
        (points.iter().map(|x| x.map(round)).collect(), normals)
    }

    /// A cube whose faces slant against the axes. Samples are 0.035 apart.
    fn slanting_cube(degrees: f64) -> Sampled {
        let (points, normals) = cuboid(20_000, [1.0; 3], 5);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let turn = |&[x, y, z]: &[f64; 3]| {
            let [y, z] = [cos * y - sin * z, sin * y + cos * z];
            [cos * x + sin * z, y, cos * z - sin * x]
        };
        (
            points.iter().map(turn).collect(),
            normals.iter().map(turn).collect(),
        )
    }

    #[test]
    fn signs_are_right_on_slanting_faces() {
        for (degrees, step) in [
            (1.0, 0.001),
            (1.0, 0.004),
            (1.0, 0.006),
            (25.0, 0.006),
            (25.0, 0.018),
        ] {
            let wrong = orient(&rounded(slanting_cube(degrees), step)).wrong;
            assert!(wrong <= 20, "{degrees} degrees, {step}: {wrong}");
        }
    }

    /// Slices twice as far from each other as the samples: these are moved along their faces to the next slice, some a bit
    /// beyond the edge.
    #[test]
    fn signs_of_slices_are_right() {
        let between = 0.07;
        let (mut points, normals) = slanting_cube(25.0);
        for (x, n) in points.iter_mut().zip(&normals) {
            let height = (x[2] / between).round() * between;
            let uphill = [-n[2] * n[0], -n[2] * n[1], 1.0 - n[2] * n[2]];
            let far = (height - x[2]) / uphill[2];
            *x = vector::add(*x, vector::scale(uphill, far));
            x[2] = height;
        }
        assert_steps(&points, [0.0, 0.0, between]);
        let wrong = orient(&(points, normals)).wrong;
        assert!(wrong <= 100, "{wrong}");
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
