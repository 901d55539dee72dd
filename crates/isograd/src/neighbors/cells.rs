//! The points that those of a cell may have as neighbors, for every cell of an index.

use std::ops::Range;

use super::candidates::Candidates;
use super::cell_index::{CellIndex, Place, TASK};
use crate::{Real, parallel, simd};

/// A search for points within a radius, with values that they carry, arrays in sorted order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search<'a, T, const M: usize> {
    pub radius: T,
    pub values: [&'a [T]; M],
}

impl<T: Real> CellIndex<T> {
    /// Fills `out`, which has a place for each point in sorted order, cell by cell and in parallel:
    /// `fill(cell, candidates, out of that cell)`, where the candidates are all points within `radius` of
    /// the box around the cell, each with its `values` (arrays in sorted order).
    pub(crate) fn for_each_cell<const M: usize, U: Send>(
        &self,
        radius: T,
        values: [&[T]; M],
        out: &mut [U],
        fill: &(impl Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync),
    ) {
        debug_assert_eq!(out.len(), self.len());
        if !self.is_empty() {
            let (limit, arch) = (radius * radius, pulp::Arch::new());
            let leaf =
                |at: Place, near: &[Place], candidates: &mut Candidates<T, M>, out: &mut [U]| {
                    simd::vectorized!(arch, self.collect(at, near, values, limit, candidates));
                    fill(at.positions(), candidates, out);
                };
            self.for_each_leaf(limit, out, &leaf);
        }
    }

    /// Collects the points of the cells `near` that are within a distance of the box of `at`, whose square is `limit`.
    #[inline(always)]
    fn collect<const M: usize>(
        &self,
        at: Place,
        near: &[Place],
        values: [&[T]; M],
        limit: T,
        candidates: &mut Candidates<T, M>,
    ) {
        let corners = self.nodes[at.node].corners();
        candidates.clear();
        for place in near {
            let cell = place.positions();
            let points = self.coordinates_of(cell.clone());
            let values = values.map(
                #[inline(always)]
                |values| &values[cell.clone()],
            );
            candidates.extend_near(points, values, corners, limit);
        }
        candidates.fill_last_lanes();
    }

    /// Calls `leaf(cell, cells near to it, scratch, out of that cell)` for every cell, in parallel; `out` has a place for
    /// each point in sorted order, and `limit` is the square of the distance up to which a cell is near.
    pub(super) fn for_each_leaf<S: Default, U: Send>(
        &self,
        limit: T,
        out: &mut [U],
        leaf: &(impl Fn(Place, &[Place], &mut S, &mut [U]) + Sync),
    ) {
        let walk = Walk {
            index: self,
            limit,
            leaf,
        };
        let mut buffers = Buffers::new(&[self.root()]);
        walk.below(self.root(), 0..1, out, &mut buffers);
    }

    /// All points within the radius of a point.
    pub(crate) fn candidates<const M: usize>(
        &self,
        point: [T; 3],
        search: Search<'_, T, M>,
        out: &mut Candidates<T, M>,
    ) {
        out.clear();
        let limit = search.radius * search.radius;
        self.walk(
            &mut |node| node.distance_squared(point) <= limit,
            &mut |cell| {
                let cell = cell.positions();
                let points = self.coordinates_of(cell.clone());
                let values = search.values.map(|values| &values[cell.clone()]);
                out.extend_near(points, values, [point; 2], limit);
            },
        );
        out.fill_last_lanes();
    }
}

/// A walk down the tree that hands on what is near: the nodes near to a child are children of the nodes
/// near to its parent.
struct Walk<'a, T, F> {
    index: &'a CellIndex<T>,
    /// The square of the distance up to which nodes are near.
    limit: T,
    leaf: &'a F,
}

/// Memory of one task.
struct Buffers<S> {
    /// Nodes near to the one at hand, after those near to the nodes above it.
    near: Vec<Place>,
    scratch: S,
}

impl<S: Default> Buffers<S> {
    fn new(near: &[Place]) -> Self {
        Self {
            near: near.to_vec(),
            scratch: S::default(),
        }
    }
}

impl<T: Real, F> Walk<'_, T, F> {
    /// Visits the cells below `at`; `near` are the places in the buffer of the nodes near to it.
    fn below<S: Default, U: Send>(
        &self,
        at: Place,
        near: Range<usize>,
        out: &mut [U],
        buffers: &mut Buffers<S>,
    ) where
        F: Fn(Place, &[Place], &mut S, &mut [U]) + Sync,
    {
        if at.levels == 0 {
            (self.leaf)(at, &buffers.near[near], &mut buffers.scratch, out);
            return;
        }
        let [left, right] = at.children();
        let (left_out, right_out) = out.split_at_mut(left.end - left.start);
        if at.end - at.start > TASK {
            let near = &buffers.near[near];
            let alone = |child, out| self.enter(child, 0..near.len(), out, &mut Buffers::new(near));
            parallel::join(|| alone(left, left_out), || alone(right, right_out));
        } else {
            self.enter(left, near.clone(), left_out, buffers);
            self.enter(right, near, right_out, buffers);
        }
    }

    /// Goes on below `at`, where `near` are the nodes near to its parent.
    fn enter<S: Default, U: Send>(
        &self,
        at: Place,
        near: Range<usize>,
        out: &mut [U],
        buffers: &mut Buffers<S>,
    ) where
        F: Fn(Place, &[Place], &mut S, &mut [U]) + Sync,
    {
        let nodes = &self.index.nodes;
        let (first, own) = (buffers.near.len(), &nodes[at.node]);
        for i in near {
            for child in buffers.near[i].children() {
                if own.box_distance_squared(&nodes[child.node]) <= self.limit {
                    buffers.near.push(child);
                }
            }
        }
        self.below(at, first..buffers.near.len(), out, buffers);
        buffers.near.truncate(first);
    }
}
