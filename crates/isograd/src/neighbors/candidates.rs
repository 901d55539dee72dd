//! Candidates for membership in a neighbourhood, laid out for loops over several at a time.

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

/// Coordinates of the points that may be within a radius of some place, and `M` values of each.
#[derive(Clone, Debug)]
pub(crate) struct Candidates<T, const M: usize = 0> {
    /// An array for each axis, filled up to a multiple of [`LANES`] with copies of the last point.
    coordinates: [Vec<T>; 3],
    /// An array for each value, filled up with zeros.
    values: [Vec<T>; M],
    /// Number of candidates without the copies.
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
        for array in self.coordinates.iter_mut().chain(&mut self.values) {
            array.clear();
        }
    }

    /// Adds points, an array for each axis, and their values.
    #[inline(always)]
    pub(super) fn extend(&mut self, points: [&[T]; 3], values: [&[T]; M]) {
        for (coordinates, more) in self.coordinates.iter_mut().zip(points) {
            coordinates.extend_from_slice(more);
        }
        for (values, more) in self.values.iter_mut().zip(values) {
            values.extend_from_slice(more);
        }
    }

    /// To be called when all candidates are there.
    pub(super) fn fill_last_lanes(&mut self) {
        self.len = self.coordinates[0].len();
        let filled = self.len.next_multiple_of(LANES);
        for coordinates in &mut self.coordinates {
            let last = coordinates.last().copied().unwrap_or_default();
            coordinates.resize(filled, last);
        }
        for values in &mut self.values {
            values.resize(filled, T::zero());
        }
    }

    /// Calls `visit` with all candidates, [`LANES`] at a time. A lane past the last candidate has a
    /// limit below zero, so that it never counts.
    #[inline(always)]
    pub(crate) fn for_each_lanes(&self, radius: T, mut visit: impl FnMut(&Lanes<T, M>)) {
        let within = radius * radius;
        let [x, y, z] = [0, 1, 2].map(|a| self.coordinates[a].as_chunks::<LANES>().0);
        let values: [&[[T; LANES]]; M] =
            std::array::from_fn(|m| self.values[m].as_chunks::<LANES>().0);
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
