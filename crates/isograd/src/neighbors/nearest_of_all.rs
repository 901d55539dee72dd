//! The nearest others of every point at once.
//!
//! Most points have enough others within the radius of a neighborhood. These are compared with each other, all with
//! all: of so few that is vector code, and takes a fifth of the time of a search for each point.

use super::cell_index::{CellIndex, Place, distance_squared};
use crate::{Real, simd};

/// Most points within the radius that are compared with each other.
const MOST: usize = 64;

/// Memory of one task.
struct Scratch<T> {
    /// Sorted positions of the points near to a cell, their coordinates, and their squared distances from one point.
    positions: Vec<u32>,
    coordinates: [Vec<T>; 3],
    squares: Vec<T>,
    /// For a search.
    found: Vec<(u32, T)>,
}

impl<T> Default for Scratch<T> {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            coordinates: Default::default(),
            squares: Vec::new(),
            found: Vec::new(),
        }
    }
}

/// The others within the radius of a point.
struct Others<T> {
    len: usize,
    positions: [u32; MOST],
    squares: [T; MOST],
}

impl<T: Real> CellIndex<T> {
    /// Writes the sorted positions of the `K` nearest others of every point, nearest first as by [`CellIndex::nearest`],
    /// into `out`, which has a place for each point in sorted order; where there are too few, the point itself stands for
    /// the rest. The result does not depend on `radius`, within which most points have `K` others or a few more.
    pub(crate) fn nearest_of_all<const K: usize>(&self, radius: T, out: &mut [[u32; K]]) {
        debug_assert_eq!(out.len(), self.len());
        if self.is_empty() {
            return;
        }
        let (limit, arch) = (radius * radius, pulp::Arch::new());
        self.for_each_leaf(limit, out, &|at, near, scratch: &mut Scratch<T>, out| {
            self.gather(near, scratch);
            for (position, out) in (at.start..at.end).zip(out) {
                let is_found = simd::vectorized!(arch, {
                    let others = self.others(position, limit, scratch);
                    others.is_some_and(|others| others.sort(out))
                });
                if !is_found {
                    self.nearest_others(position, &mut scratch.found, out);
                }
            }
        });
    }

    /// Collects the points of some cells.
    fn gather(&self, cells: &[Place], scratch: &mut Scratch<T>) {
        scratch.positions.clear();
        scratch.coordinates.iter_mut().for_each(Vec::clear);
        for cell in cells {
            let cell = cell.start..cell.end;
            let to = scratch.coordinates.iter_mut();
            for (to, from) in to.zip(self.coordinates_of(cell.clone())) {
                to.extend_from_slice(from);
            }
            scratch
                .positions
                .extend(cell.map(|position| position as u32));
        }
    }

    /// The gathered points within a distance of another one, whose square is `limit`; `None` if they are too many.
    #[inline(always)]
    fn others(&self, position: usize, limit: T, scratch: &mut Scratch<T>) -> Option<Others<T>> {
        let own = self.point(position);
        let Scratch {
            positions,
            coordinates: [x, y, z],
            squares,
            ..
        } = scratch;
        squares.clear();
        let points = x.iter().zip(&*y).zip(&*z);
        squares.extend(points.map(
            #[inline(always)]
            |((&x, &y), &z)| distance_squared([x, y, z], own),
        ));
        let mut others = Others {
            len: 0,
            positions: [0; MOST],
            squares: [T::infinity(); MOST],
        };
        for (&other, &square) in positions.iter().zip(&*squares) {
            if others.len == MOST {
                return None;
            }
            // Written in any case; what is not kept is written over.
            others.positions[others.len] = other;
            others.squares[others.len] = square;
            others.len += usize::from((square <= limit) & (other as usize != position));
        }
        Some(others)
    }

    /// Like [`CellIndex::nearest_of_all`], for one point, by a search.
    fn nearest_others<const K: usize>(
        &self,
        position: usize,
        found: &mut Vec<(u32, T)>,
        out: &mut [u32; K],
    ) {
        *out = [position as u32; K];
        self.nearest_positions(self.point(position), K + 1, found);
        let others = found.iter().map(|&(other, _)| other);
        let others = others.filter(|&other| other as usize != position);
        for (out, other) in out.iter_mut().zip(others) {
            *out = other;
        }
    }
}

impl<T: Real> Others<T> {
    /// Writes the `K` nearest into `out`, nearest first; returns whether there are so many, no two of them equally far.
    #[inline(always)]
    fn sort<const K: usize>(&self, out: &mut [u32; K]) -> bool {
        // The place of each is the number of nearer ones.
        let mut rank = [0u32; MOST];
        for &nearer in &self.squares[..self.len] {
            for (rank, &square) in rank.iter_mut().zip(&self.squares) {
                *rank += u32::from(nearer < square);
            }
        }
        let mut count = 0;
        *out = [u32::MAX; K];
        for (&rank, &position) in rank.iter().zip(&self.positions).take(self.len) {
            if let Some(out) = out.get_mut(rank as usize) {
                if *out != u32::MAX {
                    return false;
                }
                *out = position;
                count += 1;
            }
        }
        count == K
    }
}
