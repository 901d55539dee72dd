//! Points sorted into small cells: radius and nearest queries.

use std::cmp::Ordering;
use std::ops::Range;

use crate::Real;
use crate::parallel::{self, CHUNK};

/// Most points in one cell.
pub(super) const CELL: usize = 16;

/// Subtrees of fewer points than this are built and walked by one thread.
pub(super) const TASK: usize = 256;

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
    /// Coordinates in sorted order, an array for each axis, and [`CELL`] numbers more, so that as many may be read from
    /// any point on.
    coordinates: [Vec<T>; 3],
    /// Sorted position → input index.
    order: Vec<u32>,
    /// All nodes of the tree, each before its left and then its right subtree.
    pub(super) nodes: Vec<Node<T>>,
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

/// The box around the points of a subtree, and the least input index among them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<T> {
    pub(super) low: [T; 3],
    high: [T; 3],
    pub(super) least: u32,
}

/// Where a subtree stands: its node, its sorted positions, and the splits below it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) node: usize,
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) levels: u32,
}

impl Place {
    /// The sorted positions.
    #[inline(always)]
    pub(super) fn positions(self) -> Range<usize> {
        self.start..self.end
    }

    /// The two halves of the subtree.
    #[inline(always)]
    pub(super) fn children(self) -> [Self; 2] {
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
            for (a, x) in entry.point.into_iter().enumerate() {
                // Points are finite: one comparison each, where `min` would look for NaN.
                node.low[a] = if x < node.low[a] { x } else { node.low[a] };
                node.high[a] = if x > node.high[a] { x } else { node.high[a] };
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

    /// Low and high corner of the box.
    pub(super) fn corners(&self) -> [[T; 3]; 2] {
        [self.low, self.high]
    }

    /// Squared distance from a point to the box. Never above the squared distance to a point inside it,
    /// rounding included: every operation is monotone, and in the order of [`distance_squared`].
    #[inline(always)]
    pub(super) fn distance_squared(&self, query: [T; 3]) -> T {
        box_distance_squared(self.corners(), [query; 2])
    }

    /// Squared distance between two boxes.
    #[inline(always)]
    pub(super) fn box_distance_squared(&self, other: &Self) -> T {
        box_distance_squared(self.corners(), other.corners())
    }
}

/// Squared distance between two boxes, each from its low to its high corner; 0 where they meet.
#[inline(always)]
pub(super) fn box_distance_squared<T: Real>(
    [low, high]: [[T; 3]; 2],
    [other_low, other_high]: [[T; 3]; 2],
) -> T {
    // All numbers are finite: one comparison each, where `max` would look for NaN.
    let larger = |a: T, b: T| if a > b { a } else { b };
    let gap = |a: usize| {
        larger(
            larger(low[a] - other_high[a], other_low[a] - high[a]),
            T::zero(),
        )
    };
    let (x, y, z) = (gap(0), gap(1), gap(2));
    x * x + y * y + z * z
}

/// `|a − b|²`, the one way in which every query of the index rounds it.
#[inline(always)]
pub(super) fn distance_squared<T: Real>(a: [T; 3], b: [T; 3]) -> T {
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

    pub(super) fn free_scratch(&mut self) {
        self.entries = Vec::new();
    }

    /// Sorts `points` (finite; fewer than 2³²) into cells: `O(N log N)` whatever their distribution.
    pub fn new(points: &[[T; 3]]) -> Self {
        let mut index = Self::default();
        index.rebuild(points);
        index
    }

    /// [`CellIndex::new`] in the memory of this index.
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
            coordinates.reserve_exact(points.len() + CELL);
            coordinates.extend(self.entries.iter().map(|entry| entry.point[a]));
            coordinates.extend([T::zero(); CELL]);
        }
    }

    /// The sorted positions in an order that does not depend on that of the input, except for equal points: cell by cell,
    /// and by coordinates within each.
    pub(crate) fn positions_by_place(&self, out: &mut Vec<u32>) {
        out.clear();
        out.extend(0..self.len() as u32);
        self.walk(&mut |_| true, &mut |cell| {
            let point = |position: &u32| self.point(*position as usize);
            out[cell.positions()].sort_by(|a, b| compare_points(point(a), point(b)));
        });
    }

    /// Number of points equal to another one, the first one in each place not counted. Equal points that are not close in the
    /// sorted order are missed.
    pub(crate) fn duplicates(&self) -> usize {
        let in_chunk = |chunk: usize| {
            let end = self.len().min((chunk + 1) * CHUNK);
            let mut points: Vec<[T; 3]> = (chunk * CHUNK..end).map(|p| self.point(p)).collect();
            points.sort_unstable_by(|&a, &b| compare_points(a, b));
            points.windows(2).filter(|pair| pair[0] == pair[1]).count()
        };
        let counts = parallel::map(self.len().div_ceil(CHUNK), in_chunk);
        counts.into_iter().sum()
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
        let [x, y, z] = &self.coordinates;
        [x[position], y[position], z[position]]
    }

    /// The coordinates of the points at sorted positions, an array for each axis.
    #[inline(always)]
    pub(super) fn coordinates_of(&self, cell: Range<usize>) -> [&[T]; 3] {
        let [x, y, z] = &self.coordinates;
        [&x[cell.clone()], &y[cell.clone()], &z[cell]]
    }

    /// Low and high corner of the box around all points; an empty box (low above high) for no points.
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
                self.scan(cell, query, limit, &mut |position, d2| {
                    visit(self.order[position] as usize, d2);
                });
            },
        );
    }

    /// Calls `visit(sorted position, distance²)` for every point of a cell within the distance whose square is `limit`.
    #[inline(always)]
    pub(super) fn scan(
        &self,
        cell: Place,
        query: [T; 3],
        limit: T,
        visit: &mut impl FnMut(usize, T),
    ) {
        let [x, y, z] = self.coordinates_of(cell.start..cell.start + CELL);
        let (mut squares, mut within) = ([T::zero(); CELL], 0u32);
        for l in 0..CELL {
            squares[l] = distance_squared([x[l], y[l], z[l]], query);
        }
        for l in 0..CELL {
            within |= u32::from(squares[l] <= limit) << l;
        }
        within &= (1 << (cell.end - cell.start)) - 1;
        while within != 0 {
            let l = within.trailing_zeros() as usize;
            visit(cell.start + l, squares[l]);
            within &= within - 1;
        }
    }

    /// Whether any point is within `radius` of `query`, or at it.
    pub fn any_within(&self, query: [T; 3], radius: T) -> bool {
        self.count_within(query, radius, 1) > 0
    }

    /// Number of points within `radius` of `query` (at the radius itself included), or `most` if there are more.
    pub fn count_within(&self, query: [T; 3], radius: T, most: usize) -> usize {
        let limit = radius * radius;
        let count = std::cell::Cell::new(0);
        self.walk(
            &mut |node| count.get() < most && node.distance_squared(query) <= limit,
            &mut |cell| {
                self.scan(cell, query, limit, &mut |_, _| count.set(count.get() + 1));
            },
        );
        count.get().min(most)
    }

    pub(super) fn root(&self) -> Place {
        Place {
            node: 0,
            start: 0,
            end: self.len(),
            levels: self.levels,
        }
    }

    /// Calls `visit` with every cell that `enter` does not rule out, in order.
    #[inline(always)]
    pub(super) fn walk(
        &self,
        enter: &mut impl FnMut(&Node<T>) -> bool,
        visit: &mut impl FnMut(Place),
    ) {
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
                visit(at);
                continue;
            }
            let [left, right] = at.children();
            open[depth] = right;
            open[depth + 1] = left;
            depth += 2;
        }
    }
}

/// Order of two finite points by their first coordinate, then the second, then the third.
#[inline(always)]
pub(super) fn compare_points<T: Real>(a: [T; 3], b: [T; 3]) -> Ordering {
    a.partial_cmp(&b).unwrap_or(Ordering::Equal)
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
    // Equal coordinates are told apart by the others, and equal points by index: the two halves are sets that neither
    // the order of the points nor the algorithm can change.
    let key = |entry: &Entry<T>| [0, 1, 2].map(|a| entry.point[(axis + a) % 3]);
    entries.select_nth_unstable_by(middle, |a, b| {
        compare_points(key(a), key(b)).then(a.index.cmp(&b.index))
    });
    let is_large = entries.len() > TASK;
    let (left, right) = entries.split_at_mut(middle);
    let (left_nodes, right_nodes) = below.split_at_mut((1 << levels) - 1);
    if is_large {
        parallel::join(
            || sort_into_cells(left, left_nodes, levels - 1),
            || sort_into_cells(right, right_nodes, levels - 1),
        );
    } else {
        sort_into_cells(left, left_nodes, levels - 1);
        sort_into_cells(right, right_nodes, levels - 1);
    }
}
