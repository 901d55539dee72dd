//! Candidates for membership in a neighborhood, laid out for loops over several at a time.

use super::cell_index::{CELL, box_distance_squared};
use crate::Real;

/// Points processed at a time by the loops over candidates: sums are kept a lane, so the result is the
/// same for every instruction set.
pub(crate) const LANES: usize = 8;

/// Coordinates of [`LANES`] candidates, `M` values that each of them carries, and the largest squared
/// distance at which each of them counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<T, const M: usize = 0> {
    pub point: [[T; LANES]; 3],
    pub values: [[T; LANES]; M],
    pub limit: [T; LANES],
}

impl<T: Real, const M: usize> Lanes<T, M> {
    /// Whether any of them counts for a center.
    #[inline(always)]
    pub fn any_counts(&self, center: [T; 3]) -> bool {
        let mut any = false;
        for l in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|a| self.point[a][l] - center[a]);
            any |= x * x + y * y + z * z <= self.limit[l];
        }
        any
    }
}

/// The sum over all lanes, halves added to halves: a fixed order, and short in vector code.
#[inline(always)]
pub(crate) fn sum_lanes<T: Real>(mut lanes: [T; LANES]) -> T {
    let mut width = LANES / 2;
    while width > 0 {
        for l in 0..width {
            lanes[l] += lanes[l + width];
        }
        width /= 2;
    }
    lanes[0]
}

/// Coordinates of the points that may be within a radius of some place, and `M` values of each.
#[derive(Clone, Debug)]
pub(crate) struct Candidates<T, const M: usize = 0> {
    /// An array for each axis, longer than there are candidates; the rest of the last lanes holds copies of
    /// the last point.
    coordinates: [Vec<T>; 3],
    /// An array for each value.
    values: [Vec<T>; M],
    /// Number of candidates.
    len: usize,
}

impl<T, const M: usize> Default for Candidates<T, M> {
    fn default() -> Self {
        Self {
            coordinates: Default::default(),
            values: std::array::from_fn(|_| Vec::new()),
            len: 0,
        }
    }
}

impl<T: Real, const M: usize> Candidates<T, M> {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds the points of a cell, an array for each axis, that are within the distance whose square is
    /// `limit` of a box (from its low to its high corner), and their values.
    #[inline(always)]
    pub(super) fn extend_near(
        &mut self,
        cell: [&[T]; 3],
        values: [&[T]; M],
        corners: [[T; 3]; 2],
        limit: T,
    ) {
        let count = cell[0].len().min(CELL);
        let room = self.len..self.len + count;
        self.make_room(room.end);
        let near = near(cell, corners, limit);
        let mut kept = 0;
        for (to, from) in self.coordinates.iter_mut().zip(cell) {
            kept = keep(&mut to[room.clone()], &from[..count], &near);
        }
        for (to, from) in self.values.iter_mut().zip(values) {
            keep(&mut to[room.clone()], &from[..count], &near);
        }
        self.len += kept;
    }

    /// Makes all arrays at least `len` long.
    #[inline(always)]
    fn make_room(&mut self, len: usize) {
        if self.coordinates[0].len() < len {
            let len = (2 * len).next_multiple_of(LANES);
            for array in self.coordinates.iter_mut().chain(&mut self.values) {
                array.resize(len, T::zero());
            }
        }
    }

    /// To be called when all candidates are there.
    pub(super) fn fill_last_lanes(&mut self) {
        let filled = self.len.next_multiple_of(LANES);
        self.make_room(filled);
        if let Some(last) = self.len.checked_sub(1) {
            for coordinates in &mut self.coordinates {
                let last = coordinates[last];
                coordinates[self.len..filled].fill(last);
            }
        }
        for values in &mut self.values {
            values[self.len..filled].fill(T::zero());
        }
    }

    /// Calls `visit` with all candidates, [`LANES`] at a time. A lane past the last candidate has a
    /// limit below zero, so that it never counts.
    #[inline(always)]
    pub(crate) fn for_each_lanes(&self, radius: T, mut visit: impl FnMut(&Lanes<T, M>)) {
        let within = radius * radius;
        let filled = self.len.next_multiple_of(LANES);
        let [x, y, z] = self
            .coordinates
            .each_ref()
            .map(|x| x[..filled].as_chunks::<LANES>().0);
        let values = self
            .values
            .each_ref()
            .map(|x| x[..filled].as_chunks::<LANES>().0);
        // One call alone, so that it is inlined into code for the instruction set at hand.
        for (group, ((&x, &y), &z)) in x.iter().zip(y).zip(z).enumerate() {
            let mut limit = [within; LANES];
            if (group + 1) * LANES > self.len {
                limit[self.len - group * LANES..].fill(-T::one());
            }
            visit(&Lanes {
                point: [x, y, z],
                values: std::array::from_fn(
                    #[inline(always)]
                    |m| values[m][group],
                ),
                limit,
            });
        }
    }
}

/// Which points of a cell are within the distance whose square is `limit` of a box.
#[inline(always)]
fn near<T: Real>(cell: [&[T]; 3], corners: [[T; 3]; 2], limit: T) -> [bool; CELL] {
    let mut points = [[T::zero(); CELL]; 3];
    for (to, from) in points.iter_mut().zip(cell) {
        to[..from.len()].copy_from_slice(from);
    }
    let mut near = [false; CELL];
    for l in 0..CELL {
        let point = [points[0][l], points[1][l], points[2][l]];
        near[l] = box_distance_squared([point; 2], corners) <= limit;
    }
    near
}

/// Moves the entries that are to be kept to the front of `to`, and returns how many there are.
#[inline(always)]
fn keep<T: Copy>(to: &mut [T], from: &[T], kept: &[bool; CELL]) -> usize {
    let mut count = 0;
    for (&from, &kept) in from.iter().zip(kept) {
        // Written in any case; what is not kept is written over.
        to[count] = from;
        count += usize::from(kept);
    }
    count
}
