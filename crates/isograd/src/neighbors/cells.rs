//! The points that those of a cell may have as neighbors, for every cell of an index.

use std::ops::Range;

use super::candidates::Candidates;
use super::cell_index::{CellIndex, Node, Place, TASK};
use crate::{Real, simd};

/// What is looked for: points within a radius, with values that they carry, arrays in sorted order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search<'a, T, const M: usize> {
    pub radius: T,
    pub values: [&'a [T]; M],
}

impl<T: Real> CellIndex<T> {
    /// Fills `out`, which has a place for each point in sorted order, cell by cell and in parallel:
    /// `fill(cell, candidates, out of that cell)`, where the candidates are all points within `radius` of
    /// the box round the cell, each with its `values` (arrays in sorted order).
    pub(crate) fn for_each_cell<const M: usize, U: Send>(
        &self,
        radius: T,
        values: [&[T]; M],
        out: &mut [U],
        fill: &(impl Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync),
    ) {
        debug_assert_eq!(out.len(), self.len());
        if !self.is_empty() {
            let walk = Walk {
                index: self,
                search: Search { radius, values },
                limit: radius * radius,
                arch: pulp::Arch::new(),
                fill,
            };
            let mut buffers = Buffers::new(&[self.root()]);
            walk.below(self.root(), 0..1, out, &mut buffers);
        }
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
struct Walk<'a, T, const M: usize, F> {
    index: &'a CellIndex<T>,
    search: Search<'a, T, M>,
    /// The squared radius.
    limit: T,
    arch: pulp::Arch,
    fill: &'a F,
}

/// Memory of one task.
struct Buffers<T, const M: usize> {
    /// Nodes near to the one at hand, after those near to the nodes above it.
    near: Vec<Place>,
    candidates: Candidates<T, M>,
}

impl<T: Real, const M: usize> Buffers<T, M> {
    fn new(near: &[Place]) -> Self {
        Self {
            near: near.to_vec(),
            candidates: Candidates::default(),
        }
    }
}

impl<T: Real, const M: usize, F> Walk<'_, T, M, F> {
    fn node(&self, place: Place) -> &Node<T> {
        &self.index.nodes[place.node]
    }

    /// Fills the cells below `at`; `near` are the places in the buffer of the nodes near to it.
    fn below<U: Send>(
        &self,
        at: Place,
        near: Range<usize>,
        out: &mut [U],
        buffers: &mut Buffers<T, M>,
    ) where
        F: Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync,
    {
        if at.levels == 0 {
            self.collect(at, near, buffers);
            (self.fill)(at.start..at.end, &buffers.candidates, out);
            return;
        }
        let [left, right] = at.children();
        let (left_out, right_out) = out.split_at_mut(left.end - left.start);
        if at.end - at.start > TASK {
            let near = &buffers.near[near];
            let alone = |child, out| self.enter(child, 0..near.len(), out, &mut Buffers::new(near));
            rayon::join(|| alone(left, left_out), || alone(right, right_out));
        } else {
            self.enter(left, near.clone(), left_out, buffers);
            self.enter(right, near, right_out, buffers);
        }
    }

    /// Goes on below `at`, where `near` are the nodes near to its parent.
    fn enter<U: Send>(
        &self,
        at: Place,
        near: Range<usize>,
        out: &mut [U],
        buffers: &mut Buffers<T, M>,
    ) where
        F: Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync,
    {
        let (first, own) = (buffers.near.len(), self.node(at));
        for i in near {
            for child in buffers.near[i].children() {
                if own.box_distance_squared(self.node(child)) <= self.limit {
                    buffers.near.push(child);
                }
            }
        }
        self.below(at, first..buffers.near.len(), out, buffers);
        buffers.near.truncate(first);
    }

    /// The points of the cells `near` that are within the radius of the box of `at`.
    fn collect(&self, at: Place, near: Range<usize>, buffers: &mut Buffers<T, M>) {
        let Buffers {
            near: places,
            candidates,
        } = buffers;
        let corners = self.node(at).corners();
        candidates.clear();
        simd::vectorized!(self.arch, {
            for place in &places[near.clone()] {
                let cell = place.start..place.end;
                let points = self.index.coordinates_of(cell.clone());
                let values = self.search.values.map(
                    #[inline(always)]
                    |values| &values[cell.clone()],
                );
                candidates.extend_near(points, values, corners, self.limit);
            }
        });
        candidates.fill_last_lanes();
    }
}
