//! Samples along lines: those of scan lines, contours and slices, at any angle.
//!
//! Where lines are farther apart than the samples on them, most neighbors of a sample lie on its own line. One that bends
//! spans a plane, that of the scan or of the slice, in which its samples lie exactly; this looks like a sheet and is none.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

use super::coupling::NEIGHBORS;
use crate::vector;

/// Neighbors whose directions are compared. On a square lattice, two of three are at right angles.
const COMPARED: usize = 3;

/// Samples lie along lines where the mean [turn](turns) of the nearest neighbors over a neighborhood is less: it is 0 on
/// a straight line, ½ on a surface that is sampled evenly, within 0.1 for 17 random samples.
const LINE: f32 = 0.36;

/// Other lines are among the neighbors where the mean turn of the farthest of them is more. Where it is less, all
/// neighbors lie on one line, and their common axis is no better than that of the sheet.
const SEVERAL: f32 = 0.2;

/// Mean squares of the sine of the angle at which two of the nearest, and two of the farthest neighbors are seen.
fn turns(offset: &[[f32; 3]; NEIGHBORS]) -> [f32; 2] {
    [0, NEIGHBORS - COMPARED].map(|from| turn(&offset[from..from + COMPARED]))
}

/// Mean square of the sine of the angle between two of these offsets; ½, as on a surface, where all are 0.
fn turn(offset: &[[f32; 3]]) -> f32 {
    let (mut sum, mut pairs) = (0.0, 0.0);
    for (j, &a) in offset.iter().enumerate() {
        for &b in &offset[..j] {
            let squares = vector::norm_squared(a) * vector::norm_squared(b);
            if squares > 0.0 {
                let product = vector::dot(a, b);
                sum += 1.0 - product * product / squares;
                pairs += 1.0;
            }
        }
    }
    if pairs > 0.0 { sum / pairs } else { 0.5 }
}

/// Whether a sample lies on one of several lines, from the offsets of its neighbors to theirs, and its own.
pub(super) fn is_on_line<'a>(around: impl Iterator<Item = &'a [[f32; 3]; NEIGHBORS]>) -> bool {
    let (mut near, mut far, mut count) = (0.0, 0.0, 0.0);
    for turn in around.map(turns) {
        near += turn[0];
        far += turn[1];
        count += 1.0;
    }
    near < LINE * count && far > SEVERAL * count
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Random, Sampled, cuboid, cut};
    use super::super::tests::orient;
    use super::*;

    /// The mean turns of 17 neighborhoods, each of 16 calls of `offset`, and whether a sample among them lies on a line.
    fn around(mut offset: impl FnMut(usize) -> [f32; 3]) -> ([f32; 2], bool) {
        let all: Vec<[[f32; 3]; NEIGHBORS]> =
            (0..17).map(|_| std::array::from_fn(&mut offset)).collect();
        let mean = |k: usize| all.iter().map(|offset| turns(offset)[k]).sum::<f32>() / 17.0;
        ([mean(0), mean(1)], is_on_line(all.iter()))
    }

    #[test]
    fn lines_are_told_from_surfaces() {
        let mut random = Random(3);
        let mut number = || 2.0 * random.unit() as f32 - 1.0;
        let (line, is_line) = around(|_| [number(), 0.0, 0.0]);
        assert!(line[0] < 1e-6 && line[1] < 1e-6 && !is_line, "{line:?}");
        let (lines, is_line) = around(|k| [number(), if k < 9 { 0.0 } else { number() }, 0.0]);
        assert!(lines[0] < 1e-6 && lines[1] > 0.4 && is_line, "{lines:?}");
        let (surface, is_line) = around(|_| [number(), number(), 0.0]);
        assert!(
            surface[0] > 0.4 && surface[1] > 0.4 && !is_line,
            "{surface:?}"
        );
        let (lattice, is_line) = around(|k| {
            let side = if k % 4 < 2 { 1.0 } else { -1.0 };
            if k % 2 == 0 {
                [side, 0.0, 0.0]
            } else {
                [0.0, side, 0.0]
            }
        });
        assert!(lattice[0] > 0.6 && !is_line, "{lattice:?}");
        assert_eq!(around(|_| [0.0; 3]), ([0.5; 2], false));
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

    #[test]
    fn signs_of_scan_lines_are_right() {
        for (ratio, seed) in [(2.0, 3), (3.0, 5), (4.0, 7), (5.0, 9)] {
            let cube = scanned_cube(ratio, seed);
            assert!(cube.0.len() > 9000, "{}", cube.0.len());
            let wrong = orient(&cube).wrong;
            assert!(wrong <= 20, "{ratio}: {wrong}");
        }
    }
}
