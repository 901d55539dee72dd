//! Candidates for membership in a neighbourhood, laid out for loops over several at a time.

use crate::Real;

/// Points processed at a time by the loops over candidates: sums are kept a lane, so the result is the
/// same for every instruction set.
pub(crate) const LANES: usize = 8;

/// Coordinates of [`LANES`] candidates, and the largest squared distance at which each of them counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<T> {
    pub point: [[T; LANES]; 3],
    pub limit: [T; LANES],
}

/// Coordinates of the points that may be within a radius of some place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates<T> {
    /// An array for each axis, filled up to a multiple of [`LANES`] with copies of the last point.
    coordinates: [Vec<T>; 3],
    /// Number of candidates without the copies.
    len: usize,
}

impl<T: Real> Candidates<T> {
    pub(super) fn clear(&mut self) {
        for coordinates in &mut self.coordinates {
            coordinates.clear();
        }
    }

    /// Adds points, an array for each axis.
    #[inline(always)]
    pub(super) fn extend(&mut self, points: [&[T]; 3]) {
        for (coordinates, more) in self.coordinates.iter_mut().zip(points) {
            coordinates.extend_from_slice(more);
        }
    }

    /// To be called when all candidates are there.
    pub(super) fn fill_last_lanes(&mut self) {
        self.len = self.coordinates[0].len();
        for coordinates in &mut self.coordinates {
            let last = coordinates.last().copied().unwrap_or_default();
            coordinates.resize(self.len.next_multiple_of(LANES), last);
        }
    }

    /// Calls `visit` with all candidates, [`LANES`] at a time. A lane past the last candidate has a
    /// limit below zero, so that it never counts.
    #[inline(always)]
    pub(crate) fn for_each_lanes(&self, radius: T, mut visit: impl FnMut(&Lanes<T>)) {
        let within = radius * radius;
        let [x, y, z] = [0, 1, 2].map(|a| self.coordinates[a].as_chunks::<LANES>().0);
        // One call alone, so that it is inlined into code for the instruction set at hand.
        for (group, ((&x, &y), &z)) in x.iter().zip(y).zip(z).enumerate() {
            let mut limit = [within; LANES];
            if (group + 1) * LANES > self.len {
                limit[self.len - group * LANES..].fill(-T::one());
            }
            visit(&Lanes {
                point: [x, y, z],
                limit,
            });
        }
    }
}
