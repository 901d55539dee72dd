//! The nearest points of a place.

use std::cmp::Ordering;

use super::cell_index::{CellIndex, Node, Place, compare_points, distance_squared};
use crate::Real;

impl<T: Real> CellIndex<T> {
    /// The `k` points nearest to `query` as `(input index, distance²)`, nearest first; of equally distant ones that with
    /// the lower coordinates first (x, then y, then z), of equal ones that with the lower index; all points where
    /// there are fewer than `k`. Includes the point itself where `query` is one of the points. Exact. Takes `O(log N)` for
    /// a query near the points, in a cluster or far outside; only where nearly all points are equally far (the center of
    /// a sphere) does it have to look at most of them.
    pub fn nearest(&self, query: [T; 3], k: usize, out: &mut Vec<(u32, T)>) {
        self.nearest_positions(query, k, out);
        let order = self.order();
        out.iter_mut()
            .for_each(|(found, _)| *found = order[*found as usize]);
    }

    /// Like [`Self::nearest`], with sorted positions in the place of input indices.
    pub(super) fn nearest_positions(&self, query: [T; 3], k: usize, out: &mut Vec<(u32, T)>) {
        out.clear();
        if k > 0 && !self.is_empty() {
            self.nearest_below(self.root(), query, k, out);
        }
    }

    fn nearest_below(&self, at: Place, query: [T; 3], k: usize, out: &mut Vec<(u32, T)>) {
        if at.levels == 0 {
            for position in at.positions() {
                let d2 = distance_squared(self.point(position), query);
                self.insert_nearest((position as u32, d2), k, out);
            }
            return;
        }
        let bound = |child: Place| self.nodes[child.node].distance_squared(query);
        let [left, right] = at.children();
        let (left_bound, right_bound) = (bound(left), bound(right));
        let mut order = [(left, left_bound), (right, right_bound)];
        if right_bound < left_bound {
            order.swap(0, 1);
        }
        for (child, d2) in order {
            // No point of the box comes before its low corner.
            let Node { low, least, .. } = self.nodes[child.node];
            if self.may_enter(
                Near {
                    d2,
                    point: low,
                    index: least,
                },
                k,
                out,
            ) {
                self.nearest_below(child, query, k, out);
            }
        }
    }

    /// Whether something comes before the last of the `k` nearest found so far.
    #[inline(always)]
    fn may_enter(&self, near: Near<T>, k: usize, nearest: &[(u32, T)]) -> bool {
        match nearest.last() {
            Some(&last) if nearest.len() >= k => near.comes_before(|| self.near(last), last.1),
            _ => true,
        }
    }

    /// Puts `found`, a sorted position and its squared distance, where it belongs among the `k` nearest so far.
    #[inline(always)]
    fn insert_nearest(&self, found: (u32, T), k: usize, nearest: &mut Vec<(u32, T)>) {
        let near = self.near(found);
        if self.may_enter(near, k, nearest) {
            nearest.truncate(k - 1);
            let is_before = |&other: &(u32, T)| self.near(other).comes_before(|| near, near.d2);
            let place = nearest.partition_point(is_before);
            nearest.insert(place, found);
        }
    }

    #[inline(always)]
    fn near(&self, (position, d2): (u32, T)) -> Near<T> {
        let position = position as usize;
        Near {
            d2,
            point: self.point(position),
            index: self.order()[position],
        }
    }

    /// Squared distance from `query` to its `k`-th nearest point, or to the farthest of all where there are
    /// fewer than `k`; 0 for no points. The same number as by [`CellIndex::nearest`], in half the time.
    pub(super) fn reach_squared(&self, query: [T; 3], k: usize, distances: &mut Vec<T>) -> T {
        let k = k.min(self.len());
        if k == 0 {
            return T::zero();
        }
        // Any k points bound the distance; those of a small subtree around the query bound it well.
        let mut at = self.root();
        while at.levels > 0 {
            let bound = |child: &Place| self.nodes[child.node].distance_squared(query);
            let [left, right] = at.children();
            let nearer = if bound(&right) < bound(&left) {
                right
            } else {
                left
            };
            if nearer.end - nearer.start < k {
                break;
            }
            at = nearer;
        }
        let to = |position: usize| distance_squared(self.point(position), query);
        distances.clear();
        distances.extend(at.positions().map(to));
        let bound = smallest(distances, k);
        if bound == T::zero() {
            // However many points lie there, none is nearer.
            return bound;
        }
        distances.clear();
        self.walk(
            &mut |node| node.distance_squared(query) <= bound,
            &mut |cell| distances.extend(cell.positions().map(to).filter(|&d2| d2 <= bound)),
        );
        smallest(distances, k)
    }
}

/// The `k`-th smallest of the numbers (at least `k` of them, none NaN).
fn smallest<T: Real>(numbers: &mut [T], k: usize) -> T {
    let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(Ordering::Equal);
    *numbers.select_nth_unstable_by(k - 1, order).1
}

/// A point, and its squared distance from the query.
#[derive(Clone, Copy)]
struct Near<T> {
    d2: T,
    point: [T; 3],
    index: u32,
}

impl<T: Real> Near<T> {
    /// Whether this point is nearer than another one, whose squared distance is `d2`, or comes before it among equals.
    #[inline(always)]
    fn comes_before(self, other: impl FnOnce() -> Self, d2: T) -> bool {
        if self.d2 != d2 {
            return self.d2 < d2;
        }
        let other = other();
        let by_place = compare_points(self.point, other.point);
        by_place.then(self.index.cmp(&other.index)) == Ordering::Less
    }
}
