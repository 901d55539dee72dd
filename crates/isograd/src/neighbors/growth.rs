//! Radii beyond the common one: where few samples are within it, and where the next lines of samples are farther than most.

use super::cell_index::{CellIndex, distance_squared};
use super::lines;
use super::radius::{Neighborhoods, Radius};
use super::rule::{FEWEST_NEIGHBORS, GROWTH_MARGIN};
use crate::Real;

/// By how much a radius passes the next lines at least: with 1.05, those at the radius would get hardly any weight.
const LINE_MARGIN: f64 = 1.15;

/// The least radius of a sample, as a multiple of the distance to another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth<T> {
    /// Sorted position of the other sample.
    pub to: usize,
    /// The radius over the distance to it.
    pub margin: f64,
    pub radius: T,
}

impl<T: Real> Neighborhoods<T> {
    /// The radius that grows up to the next lines: the common one, where it is automatic and samples lie along lines.
    pub(super) fn along_lines(&self) -> Option<T> {
        self.lines()
            .filter(|_| self.rule == Radius::Auto)
            .map(|_| self.common_radius)
    }
}

impl<T: Real> Growth<T> {
    /// Of the radius of a sample, by its sorted position; `along_lines` as [`Neighborhoods::along_lines`].
    pub(super) fn of(
        index: &CellIndex<T>,
        position: usize,
        along_lines: Option<T>,
        nearest: &mut Vec<(u32, T)>,
    ) -> Self {
        let up_to = |to: usize, margin: f64| {
            let square = distance_squared(index.point(position), index.point(to));
            let radius = T::of(margin) * square.sqrt();
            Self { to, margin, radius }
        };
        index.nearest_positions(index.point(position), FEWEST_NEIGHBORS, nearest);
        let last = nearest.last().map_or(position, |&(last, _)| last as usize);
        let fewest = up_to(last, GROWTH_MARGIN);
        let next = along_lines.and_then(|reach| lines::next(index, position, reach, nearest));
        match next.map(|next| up_to(next, LINE_MARGIN)) {
            Some(next) if next.radius > fewest.radius => next,
            _ => fewest,
        }
    }
}
