//! Local sheets of all samples: found one by one, confirmed by their neighbors, and extended to samples beside them.
//!
//! Of the 16 neighbors of a sample on one of two close sheets, about half lie on each, but by chance five or eleven:
//! too few, or too many, for [`sheet::find`] to separate them. Such a sample takes the plane of the sheet that most of
//! its neighbors agree on. In noise, planes are found by chance: no neighbor finds the same one. Samples along
//! [`lines`] have no sheets.

use super::coupling::{self, NEIGHBORS};
use super::lattice::Lattice;
use super::lines;
use super::sheet::{self, Sheet};
use crate::parallel::{self, CHUNK};
use crate::{simd, vector};

/// Neighbors that must have found the same sheet to confirm it.
const CONFIRMING: usize = 4;

/// Neighbors that must agree on a sheet to extend it to a sample.
const EXTENDING: usize = 2;

/// Rounds of extension; each reaches the neighbors of the one before.
const ROUNDS: usize = 3;

/// Least cosine between the axes of one sheet at two neighbors: 26 degrees.
const ALIGNED: f32 = 0.9;

/// Least cosine between two offsets, along their plane, of the same direction: 45 degrees.
const TOWARD: f32 = 0.7;

/// Neighbors of all samples, as in [`Graph`](super::graph::Graph).
#[derive(Clone, Copy, Debug)]
pub(super) struct Near<'a> {
    /// `(N, 16)` sites.
    pub near: &'a [[u32; NEIGHBORS]],
    /// `(N, 16, 3)` offsets, in spacings.
    pub offset: &'a [[[f32; 3]; NEIGHBORS]],
}

/// Local sheets in the order of the sites; scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Sheets {
    /// `(N,)` sheet of each sample; of scatter 0 where none is known.
    sheets: Vec<Sheet>,
    next: Vec<Sheet>,
}

impl Sheets {
    /// Finds, confirms and extends the sheets. `axes` `(N, 3)` are those of whole neighborhoods.
    pub(super) fn find(&mut self, near: Near<'_>, axes: &[[f32; 3]], lattice: Lattice) {
        let arch = pulp::Arch::new();
        parallel::resize_large(&mut self.sheets, axes.len(), Sheet::default());
        let chunks = self.sheets.chunks_mut(CHUNK);
        let chunks = chunks.zip(near.offset.chunks(CHUNK).zip(axes.chunks(CHUNK)));
        parallel::each(chunks, |_, (sheets, (offset, axes))| {
            simd::vectorized!(arch, {
                for ((sheet, offset), &axis) in sheets.iter_mut().zip(offset).zip(axes) {
                    *sheet = sheet::find(offset, axis, lattice).unwrap_or_default();
                }
            });
        });
        self.update(|sheets, p| {
            let sheet = sheets[p];
            let confirmed = sheet.is_known()
                && near.agreeing(sheets, p, sheet) >= CONFIRMING
                && !near.is_on_line(p);
            if confirmed { sheet } else { Sheet::default() }
        });
        for _ in 0..ROUNDS {
            self.update(|sheets, p| match sheets[p].is_known() {
                true => sheets[p],
                false => near.adjacent(sheets, p, axes[p]),
            });
        }
    }

    /// `(N,)` sheet of each sample; of scatter 0 where none is known.
    pub(super) fn sheets(&self) -> &[Sheet] {
        &self.sheets
    }

    fn update(&mut self, next: impl Fn(&[Sheet], usize) -> Sheet + Sync) {
        let sheets = &self.sheets;
        parallel::fill_large(&mut self.next, sheets.len(), &|p| next(sheets, p));
        std::mem::swap(&mut self.sheets, &mut self.next);
    }
}

impl Near<'_> {
    /// Neighbors of a sample whose sheets pass through it.
    fn through<'a>(
        &'a self,
        sheets: &'a [Sheet],
        p: usize,
    ) -> impl Iterator<Item = (Sheet, [f32; 3])> + 'a {
        let neighbors = self.near[p].iter().zip(&self.offset[p]);
        let others = neighbors.filter(move |&(&q, _)| q as usize != p);
        let sheets = others.map(|(&q, &d)| (sheets[q as usize], d));
        sheets.filter(|(sheet, d)| sheet.holds(*d))
    }

    /// Number of neighbors whose sheets are the given one of a sample.
    fn agreeing(&self, sheets: &[Sheet], p: usize, sheet: Sheet) -> usize {
        let through = self.through(sheets, p);
        let same = |&(other, d): &(Sheet, [f32; 3])| sheet.holds(d) && sheet.is_aligned(&other);
        through.filter(same).count()
    }

    fn is_on_line(&self, p: usize) -> bool {
        let others = self.near[p].iter().map(|&q| &self.offset[q as usize]);
        lines::is_on_line(others.chain([&self.offset[p]]))
    }

    /// Of the sheets through a sample, the one that most of its neighbors agree on, and of several the one that it is
    /// closest to, with the axis on the side of `axis`; of scatter 0 if fewer than [`EXTENDING`] agree.
    fn adjacent(&self, sheets: &[Sheet], p: usize, axis: [f32; 3]) -> Sheet {
        let mut best = (EXTENDING - 1, f32::MAX, Sheet::default());
        for (sheet, d) in self.through(sheets, p) {
            let same = |&(other, e): &(Sheet, [f32; 3])| {
                sheet.is_aligned(&other) && sheet.holds(vector::sub(e, d))
            };
            let agreeing = self.through(sheets, p).filter(same).count();
            let off = sheet.height(d) / sheet.scatter;
            if agreeing > best.0 || (agreeing == best.0 && off < best.1) {
                best = (agreeing, off, sheet);
            }
        }
        best.2.toward(axis)
    }
}

/// Share of the neighbors off a sheet beyond which, in the same direction, others lie on it; 0 without a sheet or
/// neighbors off it.
///
/// Two sheets that lie over each other have mixed samples: about half. Where one sheet bends, the samples of its two
/// sides are apart: below a fifth.
pub(super) fn interleaved(offset: &[[f32; 3]; NEIGHBORS], sheet: Sheet) -> f32 {
    if !sheet.is_known() {
        return 0.0;
    }
    let along = offset.map(|d| {
        let height = vector::dot(sheet.axis, d);
        vector::sub(d, vector::scale(sheet.axis, height))
    });
    let square = along.map(vector::norm_squared);
    let on = offset.map(|d| sheet.holds(d));
    let is_beyond = |q: usize, r: usize| {
        let cosine = vector::dot(along[q], along[r]);
        on[r] & (square[r] > square[q]) & (cosine > TOWARD * (square[q] * square[r]).sqrt())
    };
    let (mut off, mut under) = (0u8, 0u8);
    for q in (0..NEIGHBORS).filter(|&q| !on[q]) {
        off += 1;
        under += u8::from((0..NEIGHBORS).fold(false, |any, r| any | is_beyond(q, r)));
    }
    f32::from(under) / f32::from(off.max(1))
}

impl Sheet {
    /// Whether there is a sheet.
    fn is_known(&self) -> bool {
        self.scatter > 0.0
    }

    /// Distance from its plane, of a place at this offset from one on it.
    fn height(&self, offset: [f32; 3]) -> f32 {
        vector::dot(self.axis, offset).abs()
    }

    /// Whether a place at this offset from one on the sheet is on it too.
    fn holds(&self, offset: [f32; 3]) -> bool {
        self.is_known() && self.height(offset) <= coupling::largest_height(self.scatter)
    }

    fn is_aligned(&self, other: &Self) -> bool {
        vector::dot(self.axis, other.axis).abs() >= ALIGNED
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Random, Sampled};
    use super::super::tests::orient;
    use super::*;

    /// `n` random samples of the two sides of a wedge of this angle, in degrees, whose edge is the y axis: 1 × 2.
    fn wedge(n: usize, degrees: f64, seed: u64) -> Sampled {
        let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
        let mut random = Random(seed);
        let sample = |_| {
            let (x, y) = (random.unit(), 2.0 * random.unit());
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            ([x * cos, y, side * x * sin], [-sin, 0.0, side * cos])
        };
        (0..n).map(sample).unzip()
    }

    /// Neighbors by exhaustive search, and their sheets.
    fn sheets(points: &[[f64; 3]], spacing: f64, axis: [f32; 3]) -> (Vec<Sheet>, Vec<Sheet>) {
        let (mut near, mut offset) = (Vec::new(), Vec::new());
        for &x in points {
            let distance = |q: usize| vector::norm_squared(vector::sub(points[q], x));
            let mut all: Vec<usize> = (0..points.len()).collect();
            all.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let neighbors: [usize; NEIGHBORS] = std::array::from_fn(|k| all[k + 1]);
            near.push(neighbors.map(|q| q as u32));
            offset.push(
                neighbors.map(|q| {
                    vector::of_f64(vector::scale(vector::sub(points[q], x), 1.0 / spacing))
                }),
            );
        }
        let near = Near {
            near: &near,
            offset: &offset,
        };
        let alone = offset
            .iter()
            .map(|d| sheet::find(d, axis, Lattice::default()));
        let alone = alone.map(Option::unwrap_or_default).collect();
        let mut found = Sheets::default();
        found.find(near, &vec![axis; points.len()], Lattice::default());
        (alone, found.sheets)
    }

    fn known(sheets: &[Sheet]) -> usize {
        sheets.iter().filter(|sheet| sheet.is_known()).count()
    }

    #[test]
    fn samples_without_a_sheet_take_that_of_their_neighbors() {
        let (points, normals) = wedge(2000, 4.0, 5);
        let (alone, sheets) = sheets(&points, (2.0f64 / 1000.0).sqrt(), [0.0, 0.0, 1.0]);
        // By chance fewer than six or more than ten of 16 neighbors lie on the sheet of a sample.
        assert!(known(&alone) < 1960, "{}", known(&alone));
        assert!(known(&sheets) >= 1990, "{}", known(&sheets));
        let off = |(sheet, &n): (&Sheet, &[f64; 3])| {
            vector::dot(vector::to_f64(sheet.axis), n).abs() < 1.0f64.to_radians().cos()
        };
        let off = sheets
            .iter()
            .zip(&normals)
            .filter(|&pair| off(pair))
            .count();
        assert!(off <= 20, "{off}");
    }

    #[test]
    fn noise_has_no_sheets() {
        let mut random = Random(11);
        let place = |_| [random.unit(), random.unit(), 0.05 * random.unit()];
        let points: Vec<[f64; 3]> = (0..2000).map(place).collect();
        let (alone, sheets) = sheets(&points, (1.0f64 / 2000.0).sqrt(), [0.0, 0.0, 1.0]);
        assert!(known(&alone) > 5 && known(&sheets) == 0);
    }

    #[test]
    fn samples_of_two_sheets_are_mixed_and_those_of_a_bend_are_apart() {
        let mut random = Random(3);
        let plane = Sheet {
            axis: [0.0, 0.0, 1.0],
            scatter: 1e-3,
        };
        let mut mean = |height: fn(f64, f64) -> f64| {
            let mut share = || {
                let offset = std::array::from_fn(|_| {
                    let [x, y, pick] = [(); 3].map(|()| 4.0 * random.unit() - 2.0);
                    [x, y, height(x, pick)].map(|c| c as f32)
                });
                interleaved(&offset, plane)
            };
            (0..500).map(|_| share()).sum::<f32>() / 500.0
        };
        let two = mean(|_, pick| if pick < 0.0 { 0.0 } else { 0.1 });
        let bend = mean(|x, _| -0.1 * (x - 0.5).max(0.0));
        assert!(two > 0.5 && bend < 0.2, "{two} {bend}");
    }

    #[test]
    fn signs_are_right_up_to_the_edge_of_a_wedge() {
        let (mut wrong, mut all) = (0, 0);
        for degrees in [2.0, 10.0, 25.0] {
            let wedge = wedge(6000, degrees, 7);
            wrong += orient(&wedge).wrong;
            all += wedge.0.len();
        }
        assert!(100 * wrong < all, "{wrong} of {all}");
    }
}
