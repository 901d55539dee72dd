//! Samples along lines: those of scan lines, contours and slices, at any angle.
//!
//! Where lines are farther apart than the samples on them, most neighbors of a sample lie on its own line. One that bends
//! spans a plane, that of the scan or of the slice, in which its samples lie exactly; this looks like a sheet and is none.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

use super::coupling::NEIGHBORS;
use super::sites::Sites;
use crate::neighbors::Neighborhoods;
use crate::neighbors::lines::{COMPARED, LINE, turn};
use crate::{Real, parallel};

/// Reach of a sample along a line in radii of its neighborhood, which hold the next lines: discs of .6 of their distance. With
/// .4, signs of lines ten times as far apart as their samples are wrong a third more often.
const REACH: f64 = 0.35;

/// Widens the reach of samples along lines, so that their discs leave no gaps between the lines; in the order of the sites, in
/// spacings.
pub(super) fn widen<T: Real>(reach: &mut [f32], neighborhoods: &Neighborhoods<T>, sites: &Sites) {
    if neighborhoods.lines().is_none() {
        return;
    }
    let (order, spacing) = (sites.order(), neighborhoods.spacing().f64());
    parallel::for_each(reach, |p, reach| {
        let radius = neighborhoods.radius[order[p] as usize].f64();
        *reach = reach.max((REACH * radius / spacing) as f32);
    });
}

/// Whether a sample lies on a line, from the offsets of its neighbors to theirs, and its own.
pub(super) fn is_on_line<'a>(around: impl Iterator<Item = &'a [[f32; 3]; NEIGHBORS]>) -> bool {
    mean_turn(around) < LINE
}

/// Mean [turn] of the nearest.
fn mean_turn<'a>(around: impl Iterator<Item = &'a [[f32; 3]; NEIGHBORS]>) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for offset in around {
        sum += turn(&offset[..COMPARED]);
        count += 1.0;
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Random, Sampled, cuboid, cut};
    use super::super::tests::orient;
    use super::*;
    use crate::vector;

    /// The mean turn of 17 neighborhoods, each of 16 calls of `offset`, and whether a sample among them lies on a line.
    fn around(mut offset: impl FnMut(usize) -> [f32; 3]) -> (f32, bool) {
        let all: Vec<[[f32; 3]; NEIGHBORS]> =
            (0..17).map(|_| std::array::from_fn(&mut offset)).collect();
        (mean_turn(all.iter()), is_on_line(all.iter()))
    }

    #[test]
    fn lines_are_told_from_surfaces() {
        let mut random = Random(3);
        let mut number = || 2.0 * random.unit() as f32 - 1.0;
        let (line, is_line) = around(|_| [number(), 0.0, 0.0]);
        assert!(line < 1e-6 && is_line, "{line:?}");
        let (surface, is_line) = around(|_| [number(), number(), 0.0]);
        assert!(surface > 0.4 && !is_line, "{surface:?}");
        let (lattice, is_line) = around(|k| {
            let side = if k % 4 < 2 { 1.0 } else { -1.0 };
            if k % 2 == 0 {
                [side, 0.0, 0.0]
            } else {
                [0.0, side, 0.0]
            }
        });
        assert!(lattice > 0.6 && !is_line, "{lattice:?}");
        assert_eq!(around(|_| [0.0; 3]), (0.5, false));
    }

    /// About 10,000 samples of a cube on lines in parallel planes, so many times as far apart as the samples on them.
    fn scanned_cube(ratio: f64, seed: u64) -> Sampled {
        let across = [0.3, 0.5, 0.8].map(|x| x / 0.98f64.sqrt());
        let between = (6.0 * ratio / 10_000.0).sqrt();
        let near = |x: [f64; 3]| {
            let place = vector::dot(x, across) / between;
            (place - place.round()).abs() < 0.008
        };
        cut(cuboid(600_000, [0.5; 3], seed), near)
    }

    /// The unit sphere in so many rings of so many samples.
    fn rings(count: usize, samples: usize) -> Sampled {
        let point = |i: usize| {
            let turn = std::f64::consts::TAU * (i % samples) as f64 / samples as f64;
            let polar = std::f64::consts::PI * ((i / samples) as f64 + 0.5) / count as f64;
            let (sin, cos) = polar.sin_cos();
            [sin * turn.cos(), sin * turn.sin(), cos]
        };
        let points: Vec<[f64; 3]> = (0..count * samples).map(point).collect();
        (points.clone(), points)
    }

    #[test]
    fn rings_have_the_sides_of_the_next_ones() {
        for (count, samples) in [(20, 280), (30, 420), (30, 480), (25, 500)] {
            let wrong = orient(&rings(count, samples)).wrong;
            assert_eq!(wrong, 0, "{count} rings of {samples}");
        }
    }

    #[test]
    fn signs_of_scan_lines_are_right() {
        for (ratio, seed) in [(2.0, 3), (3.0, 5), (4.0, 7), (5.0, 9), (8.0, 11)] {
            let cube = scanned_cube(ratio, seed);
            assert!(cube.0.len() > 9000, "{}", cube.0.len());
            let wrong = orient(&cube).wrong;
            assert!(wrong <= 20, "{ratio}: {wrong}");
        }
    }
}
