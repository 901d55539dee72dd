//! Local sheets of all samples: found one by one, confirmed by their neighbors, and extended to samples beside them.
//!
//! Of the 16 neighbors of a sample on one of two close sheets, about half lie on each, but by chance five or eleven:
//! too few, or too many, for [`sheet::find`] to separate them. Such a sample takes the plane of the sheet that most of
//! its neighbors agree on. In noise, planes are found by chance: no neighbor finds the same one.

use rayon::prelude::*;

use super::coupling::{self, NEIGHBORS};
use super::sheet::{self, Sheet};
use crate::vector;

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
    pub(super) fn find(&mut self, near: Near<'_>, axes: &[[f32; 3]]) {
        let found = |p: usize| sheet::find(&near.offset[p], axes[p]).unwrap_or_default();
        let all = (0..axes.len()).into_par_iter();
        all.map(found).collect_into_vec(&mut self.sheets);
        self.update(|sheets, p| {
            let sheet = sheets[p];
            let confirmed = sheet.is_known() && near.agreeing(sheets, p, sheet) >= CONFIRMING;
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
        let all = (0..sheets.len()).into_par_iter();
        all.map(|p| next(sheets, p))
            .collect_into_vec(&mut self.next);
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
        on[r] && square[r] > square[q] && cosine > TOWARD * (square[q] * square[r]).sqrt()
    };
    let (mut off, mut under) = (0u8, 0u8);
    for q in (0..NEIGHBORS).filter(|&q| !on[q]) {
        off += 1;
        under += u8::from((0..NEIGHBORS).any(|r| is_beyond(q, r)));
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
