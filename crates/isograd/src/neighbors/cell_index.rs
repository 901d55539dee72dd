//! Points sorted into small cells: radius and nearest queries.

use std::ops::Range;

use super::candidates::Candidates;
use crate::Real;

/// Most points in one cell.
const CELL: usize = 16;

/// Subtrees of fewer points than this are built and walked by one thread.
const TASK: usize = 2048;

/// Points sorted into the cells of a balanced k-d tree, for exact radius and nearest queries.
///
/// No cell holds more than 16 points, however unevenly the cloud is sampled and whatever its extent:
/// a uniform grid of cells would put whole clusters into one cell as soon as an outlier or a second
/// cluster is far away. Memory is `O(N)`. The tree depends on the points alone, and so does the order
/// in which a query visits them.
///
/// Points are taken as they are (no rescaling), and only differences of coordinates are ever
/// multiplied, so a cloud far from the origin loses nothing.
#[derive(Clone, Debug, Default)]
pub struct CellIndex<T> {
    /// Coordinates in sorted order, an array for each axis.
    coordinates: [Vec<T>; 3],
    /// Sorted position → input index.
    order: Vec<u32>,
    /// All nodes of the tree, each before its left and then its right subtree.
    nodes: Vec<Node<T>>,
    /// Splits between the root and a cell.
    levels: u32,
    /// Kept for the next build.
    entries: Vec<Entry<T>>,
}

/// A point and its index, while they are being sorted.
#[derive(Clone, Copy, Debug)]
struct Entry<T> {
    point: [T; 3],
    index: u32,
}

/// The box round the points of a subtree, and the least input index among them.
#[derive(Clone, Copy, Debug)]
struct Node<T> {
    low: [T; 3],
    high: [T; 3],
    least: u32,
}

/// What is looked for: points within a radius, with values that they carry, arrays in sorted order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search<'a, T, const M: usize> {
    pub radius: T,
    pub values: [&'a [T]; M],
}

/// Where a subtree stands: its node, its sorted positions, and the splits below it.
#[derive(Clone, Copy, Debug)]
struct Place {
    node: usize,
    start: usize,
    end: usize,
    levels: u32,
}

impl Place {
    /// The two halves of the subtree.
    #[inline(always)]
    fn children(self) -> [Self; 2] {
        let middle = self.start + (self.end - self.start) / 2;
        let levels = self.levels - 1;
        let left = Self {
            node: self.node + 1,
            start: self.start,
            end: middle,
            levels,
        };
        let right = Self {
            node: self.node + (1 << self.levels),
            start: middle,
            end: self.end,
            levels,
        };
        [left, right]
    }
}

impl<T: Real> Node<T> {
    fn around(entries: &[Entry<T>]) -> Self {
        let mut node = Self {
            low: [T::infinity(); 3],
            high: [T::neg_infinity(); 3],
            least: u32::MAX,
        };
        for entry in entries {
            for a in 0..3 {
                node.low[a] = node.low[a].min(entry.point[a]);
                node.high[a] = node.high[a].max(entry.point[a]);
            }
            node.least = node.least.min(entry.index);
        }
        node
    }

    /// The axis along which the box is longest.
    fn longest_axis(&self) -> usize {
        let length = |a: usize| self.high[a] - self.low[a];
        let axis = if length(1) > length(0) { 1 } else { 0 };
        if length(2) > length(axis) { 2 } else { axis }
    }

    /// Squared distance from a point to the box. Never above the squared distance to a point inside it,
    /// rounding included: every operation is monotone, and in the order of [`distance_squared`].
    #[inline(always)]
    fn distance_squared(&self, query: [T; 3]) -> T {
        box_distance_squared(self.low, self.high, query, query)
    }
}

/// Squared distance between two boxes, each from its low to its high corner; 0 where they meet.
#[inline(always)]
fn box_distance_squared<T: Real>(
    low: [T; 3],
    high: [T; 3],
    other_low: [T; 3],
    other_high: [T; 3],
) -> T {
    let gap = |a: usize| {
        (low[a] - other_high[a])
            .max(other_low[a] - high[a])
            .max(T::zero())
    };
    gap(0) * gap(0) + gap(1) * gap(1) + gap(2) * gap(2)
}

/// `|a − b|²`, the one way in which every query of the index rounds it.
#[inline(always)]
fn distance_squared<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

impl<T: Real> CellIndex<T> {
    /// Bytes of what queries need, and of work space.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        let coordinates = self.coordinates.iter().map(|x| size_of_val(x.as_slice()));
        let needed = coordinates.sum::<usize>()
            + size_of_val(self.order.as_slice())
            + size_of_val(self.nodes.as_slice());
        [needed, size_of_val(self.entries.as_slice())]
    }

    /// Sorts `points` (finite; fewer than 2³²) into cells: `O(N log N)` whatever their distribution.
    pub fn new(points: &[[T; 3]]) -> Self {
        let mut index = Self::default();
        index.rebuild(points);
        index
    }

    /// The same as [`CellIndex::new`], in the memory of this index.
    pub fn rebuild(&mut self, points: &[[T; 3]]) {
        self.levels = 0;
        while points.len().div_ceil(1 << self.levels) > CELL {
            self.levels += 1;
        }
        self.entries.clear();
        self.entries.extend(
            (0u32..)
                .zip(points)
                .map(|(index, &point)| Entry { point, index }),
        );
        self.nodes.clear();
        self.nodes.resize((2 << self.levels) - 1, Node::around(&[]));
        sort_into_cells(&mut self.entries, &mut self.nodes, self.levels);
        self.order.clear();
        self.order
            .extend(self.entries.iter().map(|entry| entry.index));
        for (a, coordinates) in self.coordinates.iter_mut().enumerate() {
            coordinates.clear();
            coordinates.extend(self.entries.iter().map(|entry| entry.point[a]));
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Sorted position → input index. Points that are close in this order are close in space.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The point at a sorted position.
    #[inline(always)]
    pub(crate) fn point(&self, position: usize) -> [T; 3] {
        [0, 1, 2].map(|a| self.coordinates[a][position])
    }

    /// Low and high corner of the box round all points; an empty box (low above high) for no points.
    pub(crate) fn bounds(&self) -> ([T; 3], [T; 3]) {
        match self.nodes.first() {
            Some(root) => (root.low, root.high),
            None => ([T::infinity(); 3], [T::neg_infinity(); 3]),
        }
    }

    /// Calls `visit(input index, distance²)` for every point within `radius` of `query` (at the radius
    /// itself included), in an order that depends on the points alone. No point is within a negative radius.
    pub fn for_each_within(&self, query: [T; 3], radius: T, mut visit: impl FnMut(usize, T)) {
        if !(radius >= T::zero()) {
            return;
        }
        let limit = radius * radius;
        self.walk(
            &mut |node| node.distance_squared(query) <= limit,
            &mut |cell| {
                for position in cell {
                    let d2 = distance_squared(self.point(position), query);
                    if d2 <= limit {
                        visit(self.order[position] as usize, d2);
                    }
                }
            },
        );
    }

    /// The `k` points nearest to `query` as `(input index, distance²)`, nearest first, and the lower
    /// index first among equals; all points where there are fewer than `k`. Includes the point itself
    /// where `query` is one of the points. Exact. Takes `O(log N)` for a query near the points, in a
    /// cluster or far outside; only where nearly all points are equally far (the centre of a sphere) does
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
                insert_nearest((self.order[position], d2), k, out);
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

    fn root(&self) -> Place {
        Place {
            node: 0,
            start: 0,
            end: self.len(),
            levels: self.levels,
        }
    }

    /// Calls `visit` with the sorted positions of every cell that `enter` does not rule out, in order.
    #[inline(always)]
    fn walk(&self, enter: &mut impl FnMut(&Node<T>) -> bool, visit: &mut impl FnMut(Range<usize>)) {
        if self.is_empty() {
            return;
        }
        // A path holds at most one open sibling a level, and 2³² points make fewer than 32 levels.
        let mut open = [self.root(); 34];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let at = open[depth];
            if !enter(&self.nodes[at.node]) {
                continue;
            }
            if at.levels == 0 {
                visit(at.start..at.end);
                continue;
            }
            let [left, right] = at.children();
            open[depth] = right;
            open[depth + 1] = left;
            depth += 2;
        }
    }

    /// Fills `out`, which has a place for each point in sorted order, cell by cell and in parallel:
    /// `fill(cell, candidates, out of that cell)`, where the candidates are all points that any point of
    /// the cell can have within `radius`, each with its `values` (arrays in sorted order).
    pub(crate) fn for_each_cell<const M: usize, U: Send>(
        &self,
        radius: T,
        values: [&[T]; M],
        out: &mut [U],
        fill: &(impl Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync),
    ) {
        debug_assert_eq!(out.len(), self.len());
        if !self.is_empty() {
            let search = Search { radius, values };
            self.cells_below(self.root(), search, out, &mut Candidates::default(), fill);
        }
    }

    fn cells_below<const M: usize, U: Send>(
        &self,
        at: Place,
        search: Search<'_, T, M>,
        out: &mut [U],
        candidates: &mut Candidates<T, M>,
        fill: &(impl Fn(Range<usize>, &Candidates<T, M>, &mut [U]) + Sync),
    ) {
        if at.levels == 0 {
            let Node { low, high, .. } = self.nodes[at.node];
            self.candidates([low, high], search, candidates);
            fill(at.start..at.end, candidates, out);
            return;
        }
        let [left, right] = at.children();
        let (left_out, right_out) = out.split_at_mut(left.end - left.start);
        if at.end - at.start > TASK {
            rayon::join(
                || self.cells_below(left, search, left_out, &mut Candidates::default(), fill),
                || self.cells_below(right, search, right_out, &mut Candidates::default(), fill),
            );
        } else {
            self.cells_below(left, search, left_out, candidates, fill);
            self.cells_below(right, search, right_out, candidates, fill);
        }
    }

    /// All points within the radius of the box from `low` to `high`, and perhaps some more.
    pub(crate) fn candidates<const M: usize>(
        &self,
        [low, high]: [[T; 3]; 2],
        search: Search<'_, T, M>,
        out: &mut Candidates<T, M>,
    ) {
        out.clear();
        let limit = search.radius * search.radius;
        self.walk(
            &mut |node| box_distance_squared(node.low, node.high, low, high) <= limit,
            &mut |cell| {
                out.extend(
                    [0, 1, 2].map(|a| &self.coordinates[a][cell.clone()]),
                    search.values.map(|values| &values[cell.clone()]),
                );
            },
        );
        out.fill_last_lanes();
    }
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

/// Sorts `entries` into the order of the cells, and writes the nodes of their subtree.
fn sort_into_cells<T: Real>(entries: &mut [Entry<T>], nodes: &mut [Node<T>], levels: u32) {
    let Some((node, below)) = nodes.split_first_mut() else {
        return;
    };
    *node = Node::around(entries);
    if levels == 0 {
        entries.sort_unstable_by_key(|entry| entry.index);
        return;
    }
    let axis = node.longest_axis();
    let middle = entries.len() / 2;
    // Equal coordinates are told apart by index: the two halves are sets that no algorithm can change.
    entries.select_nth_unstable_by(middle, |a, b| {
        let along = a.point[axis].f64().total_cmp(&b.point[axis].f64());
        along.then(a.index.cmp(&b.index))
    });
    let parallel = entries.len() > TASK;
    let (left, right) = entries.split_at_mut(middle);
    let (left_nodes, right_nodes) = below.split_at_mut((1 << levels) - 1);
    if parallel {
        rayon::join(
            || sort_into_cells(left, left_nodes, levels - 1),
            || sort_into_cells(right, right_nodes, levels - 1),
        );
    } else {
        sort_into_cells(left, left_nodes, levels - 1);
        sort_into_cells(right, right_nodes, levels - 1);
    }
}
