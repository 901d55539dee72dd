//! The nearest points of a place.

use std::cmp::Ordering::Equal;

use super::cell_index::{CellIndex, Place, distance_squared};
use crate::Real;

impl<T: Real> CellIndex<T> {
    /// The `k` points nearest to `query` as `(input index, distance²)`, nearest first, and the lower
    /// index first among equals; all points where there are fewer than `k`. Includes the point itself
    /// where `query` is one of the points. Exact. Takes `O(log N)` for a query near the points, in a
    /// cluster or far outside; only where nearly all points are equally far (the center of a sphere) does
    /// it have to look at most of them.
    pub fn nearest(&self, query: [T; 3], k: usize, out: &mut Vec<(u32, T)>) {
        out.clear();
        if k > 0 && !self.is_empty() {
            self.nearest_below(self.root(), query, k, out);
        }
    }

    fn nearest_below(&self, at: Place, query: [T; 3], k: usize, out: &mut Vec<(u32, T)>) {
        if at.levels == 0 {
            for position in at.start..at.end {
                let d2 = distance_squared(self.point(position), query);
                insert_nearest((self.order()[position], d2), k, out);
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
            if may_enter((self.nodes[child.node].least, d2), k, out) {
                self.nearest_below(child, query, k, out);
            }
        }
    }

    /// Squared distance from `query` to its `k`-th nearest point, or to the farthest of all where there are
    /// fewer than `k`; 0 for no points. The same number as by [`CellIndex::nearest`], in half the time.
    pub(super) fn reach_squared(&self, query: [T; 3], k: usize, distances: &mut Vec<T>) -> T {
        let k = k.min(self.len());
        if k == 0 {
            return T::zero();
        }
        // Any k points bound the distance; those of a small subtree round the query bound it well.
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
        distances.extend((at.start..at.end).map(to));
        let bound = smallest(distances, k);
        if bound == T::zero() {
            // However many points lie there, none is nearer.
            return bound;
        }
        distances.clear();
        self.walk(
            &mut |node| node.distance_squared(query) <= bound,
            &mut |cell| distances.extend(cell.map(to).filter(|&d2| d2 <= bound)),
        );
        smallest(distances, k)
    }
}

/// The `k`-th smallest of the numbers (at least `k` of them, none NaN).
fn smallest<T: Real>(numbers: &mut [T], k: usize) -> T {
    let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(Equal);
    *numbers.select_nth_unstable_by(k - 1, order).1
}

/// Whether `(index, distance²)` comes before the last of the `k` nearest found so far.
#[inline(always)]
fn may_enter<T: Real>((index, d2): (u32, T), k: usize, nearest: &[(u32, T)]) -> bool {
    match nearest.last() {
        Some(&last) if nearest.len() >= k => comes_before((index, d2), last),
        _ => true,
    }
}

#[inline(always)]
fn comes_before<T: Real>(a: (u32, T), b: (u32, T)) -> bool {
    a.1 < b.1 || (a.1 == b.1 && a.0 < b.0)
}

/// Puts `found` where it belongs among the `k` nearest found so far.
#[inline(always)]
fn insert_nearest<T: Real>(found: (u32, T), k: usize, nearest: &mut Vec<(u32, T)>) {
    if may_enter(found, k, nearest) {
        nearest.truncate(k - 1);
        let place = nearest.partition_point(|&other| comes_before(other, found));
        nearest.insert(place, found);
    }
}
