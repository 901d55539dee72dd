//! The nearest others of all points.
//!
//! Points near a cell are gathered once for all of its own points. The few that may be among the nearest of one point are
//! compared with each other, all with all: vector code, and faster than one search per point.

use std::cell::Cell;

use super::candidates::LANES;
use super::cell_index::{CellIndex, Place, distance_squared};
use crate::{Real, simd};

/// Most points that are compared with each other.
const MOST: usize = 96;

/// Most points that are gathered for a cell: where some lie much closer together than others, single searches are sooner.
const MANY: usize = 1024;

/// The `k`-th nearest of the points of a cell are sought within this many times the distance to that of one of them; of nearly
/// all they are nearer.
const REACHES: f64 = 1.4;

/// Relative margin of a bound, above its rounding error.
const MARGIN: f64 = 1.001;

/// Scratch buffers of one task.
#[derive(Default)]
struct Scratch<T> {
    /// Whether all points near to a cell were gathered.
    are_all: bool,
    /// Their sorted positions, their coordinates, and their squared distances from one point.
    positions: Vec<u32>,
    coordinates: [Vec<T>; 3],
    squares: Vec<T>,
    /// Points of the cell and the distances to their `k`-th nearest.
    reaches: Vec<([T; 3], T)>,
    /// For a search.
    found: Vec<(u32, T)>,
}

impl<T> Scratch<T> {
    fn clear(&mut self) {
        self.are_all = true;
        self.positions.clear();
        self.coordinates.iter_mut().for_each(Vec::clear);
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
    /// into `out`, in the order of [`CellIndex::positions_by_place`], which is `by_place`; where there are too few, the
    /// point itself stands for the rest. The result does not depend on `radius`, within which most points have `K` others
    /// or a few more.
    pub(crate) fn nearest_of_all<const K: usize>(
        &self,
        radius: T,
        by_place: &[u32],
        out: &mut [[u32; K]],
    ) {
        debug_assert_eq!((out.len(), by_place.len()), (self.len(), self.len()));
        if self.is_empty() {
            return;
        }
        let (limit, arch) = (radius * radius, pulp::Arch::new());
        self.for_each_leaf(limit, out, &|at, near, scratch: &mut Scratch<T>, out| {
            scratch.clear();
            for &cell in near {
                self.gather(cell, at, limit, scratch);
            }
            for (&position, out) in by_place[at.positions()].iter().zip(out) {
                let position = position as usize;
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

    /// Writes the squared distance from every point to its `k`-th nearest, itself included, or to the farthest of all where
    /// there are fewer, into `out`, which has a place for each point in sorted order: the numbers of
    /// [`Self::reach_squared`].
    pub(super) fn reaches_squared(&self, k: usize, out: &mut [T]) {
        debug_assert_eq!(out.len(), self.len());
        let k = k.min(self.len());
        if k == 0 {
            return;
        }
        let arch = pulp::Arch::new();
        let search = |position: usize, scratch: &mut Scratch<T>| {
            self.reach_squared(self.point(position), k, &mut scratch.squares)
        };
        // Each cell has a distance of its own, so no cells near its parent are passed down.
        let none = -T::one();
        self.for_each_leaf(none, out, &|at, _, scratch: &mut Scratch<T>, out| {
            let positions = at.positions();
            let middle = at.start + positions.len() / 2;
            let reach = search(middle, scratch).sqrt();
            let most = reach * T::of(REACHES);
            self.gather_within(at, most, scratch);
            scratch.reaches.clear();
            scratch.reaches.push((self.point(middle), reach));
            for (position, out) in positions.zip(out) {
                let found = simd::vectorized!(arch, {
                    let limit = self.bound(position, &scratch.reaches).min(most);
                    let others = self.others(position, limit * limit, scratch);
                    others.and_then(|others| others.smallest(k - 1))
                });
                *out = found.unwrap_or_else(|| search(position, scratch));
                scratch.reaches.push((self.point(position), out.sqrt()));
            }
        });
    }

    /// An upper bound of the distance from a point to its `k`-th nearest, from those of other points: by the way to one of
    /// them and its own.
    #[inline(always)]
    fn bound(&self, position: usize, reaches: &[([T; 3], T)]) -> T {
        let own = self.point(position);
        let by_way = reaches
            .iter()
            .map(|&(point, reach)| distance_squared(point, own).sqrt() + reach);
        by_way.fold(T::infinity(), T::min) * T::of(MARGIN)
    }

    /// Collects the points within a distance of the box of a cell.
    fn gather_within(&self, at: Place, distance: T, scratch: &mut Scratch<T>) {
        let (own, limit) = (&self.nodes[at.node], distance * distance);
        scratch.clear();
        let are_all = Cell::new(true);
        self.walk(
            &mut |node| are_all.get() && node.box_distance_squared(own) <= limit,
            &mut |cell| are_all.set(self.gather(cell, at, limit, scratch)),
        );
    }

    /// Adds the points of a cell within a distance of the box of `at`, whose square is `limit`, to those gathered, unless
    /// these are too many; returns whether all were added so far.
    fn gather(&self, cell: Place, at: Place, limit: T, scratch: &mut Scratch<T>) -> bool {
        scratch.are_all &= scratch.positions.len() + cell.positions().len() <= MANY;
        if scratch.are_all {
            let own = &self.nodes[at.node];
            for position in cell.positions() {
                let point = self.point(position);
                if own.distance_squared(point) <= limit {
                    scratch.positions.push(position as u32);
                    for (to, x) in scratch.coordinates.iter_mut().zip(point) {
                        to.push(x);
                    }
                }
            }
        }
        scratch.are_all
    }

    /// The points within a distance of another one, whose square is `limit`, of those gathered; `None` if these or those are
    /// too many.
    #[inline(always)]
    fn others(&self, position: usize, limit: T, scratch: &mut Scratch<T>) -> Option<Others<T>> {
        if !scratch.are_all {
            return None;
        }
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
    /// The number of nearer ones, for each.
    #[inline(always)]
    fn ranks(&self) -> [u32; MOST] {
        let mut ranks = [0; MOST];
        let filled = self.len.next_multiple_of(LANES);
        for &nearer in &self.squares[..self.len] {
            for (rank, &square) in ranks[..filled].iter_mut().zip(&self.squares) {
                *rank += u32::from(nearer < square);
            }
        }
        ranks
    }

    /// Writes the `K` nearest into `out`, nearest first; returns whether there are so many, no two of them equally far.
    #[inline(always)]
    fn sort<const K: usize>(&self, out: &mut [u32; K]) -> bool {
        let mut count = 0;
        *out = [u32::MAX; K];
        for (&rank, &position) in self.ranks().iter().zip(&self.positions).take(self.len) {
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

    /// The `k`-th smallest square: the largest that has fewer below it. 0 for `k = 0`; `None` if there are fewer.
    #[inline(always)]
    fn smallest(&self, k: usize) -> Option<T> {
        let ranks = self.ranks();
        let low = ranks.iter().zip(&self.squares).take(self.len);
        let low = low.filter(|&(&rank, _)| (rank as usize) < k);
        (self.len >= k).then(|| low.fold(T::zero(), |largest, (_, &square)| largest.max(square)))
    }
}
