//! A tree of boxes over the triangles of a mesh.
//!
//! The triangles are sorted along a Morton curve and cut into leaves of [`LEAF`]; every [`WIDTH`] leaves, or
//! nodes, have one node above them. So the tree is a few flat arrays: no pointers, built in parallel, the
//! same for any number of threads, and rebuilt in the same memory.

use rayon::prelude::*;

use super::triangle::Frame;
use super::{Error, lanes};
use crate::vector::{add, norm, scale, sub, to_f64};
use crate::{Mesh, Real};

/// Triangles in a leaf.
pub(super) const LEAF: usize = 4;
/// Children of a node.
const WIDTH: usize = 8;
/// Points walked down the tree together.
pub(super) const LANES: usize = 8;

/// Lengths whose squares and their sums stay far from the ends of `f64`.
const LENGTHS: std::ops::Range<f64> = 1e-140..1e140;

/// Boxes of the children of a node, `[axis][child]`. A child that is not there has an inverted infinite box,
/// infinitely far from everything.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [[f64; WIDTH]; 3],
    high: [[f64; WIDTH]; 3],
}

/// Coordinates of [`LANES`] points, `[axis][point]`.
pub(super) type Points = [[f64; LANES]; 3];

/// The closest triangles found so far for [`LANES`] points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Squared distances.
    pub squared: [f64; LANES],
    /// Places of the triangles in the sorted order.
    pub triangle: [u32; LANES],
}

impl Found {
    pub(super) const NOTHING: Self = Self {
        squared: [f64::INFINITY; LANES],
        triangle: [NOWHERE; LANES],
    };
}

/// The place of a triangle that was not found.
pub(super) const NOWHERE: u32 = u32::MAX;

/// A node still to be visited: its level, its place in the level, and the least squared distance from it to
/// any of the points.
type Waiting = (u32, u32, f64);

/// Memory of a walk down the tree.
pub(super) type Stack = Vec<Waiting>;

/// See the head of this file.
#[derive(Clone, Debug, Default)]
pub(super) struct Bvh {
    /// Morton code and face, sorted.
    keys: Vec<(u64, u32)>,
    frames: Vec<Frame>,
    /// From the nodes above the leaves up to the root.
    levels: Vec<Vec<Node>>,
    /// The largest absolute coordinate.
    magnitude: f64,
    low: [f64; 3],
    /// Cells of the Morton curve per unit of length.
    per_unit: f64,
}

impl Bvh {
    /// Puts the tree of `mesh` in place of what was here.
    pub(super) fn rebuild<T: Real>(&mut self, mesh: &Mesh<T>) -> Result<(), Error> {
        if mesh.faces().is_empty() {
            return Err(Error::Empty);
        }
        let (low, high) = bounds(mesh);
        self.magnitude = (0..3).fold(0.0, |m: f64, a| m.max(low[a].abs()).max(high[a].abs()));
        let extent = (0..3).fold(0.0, |m: f64, a| m.max(high[a] - low[a]));
        if self.magnitude >= LENGTHS.end || (extent > 0.0 && extent < LENGTHS.start) {
            return Err(Error::Range {
                magnitude: self.magnitude,
                extent,
            });
        }
        self.low = low;
        self.per_unit = if extent > 0.0 {
            MORTON_CELLS / extent
        } else {
            0.0
        };
        self.sort(mesh);
        let order = &self.keys;
        order
            .par_iter()
            .map(|&(_, face)| Frame::new(corners(mesh, face)))
            .collect_into_vec(&mut self.frames);
        self.build_levels(mesh);
        Ok(())
    }

    fn sort<T: Real>(&mut self, mesh: &Mesh<T>) {
        let mut keys = std::mem::take(&mut self.keys);
        (0..mesh.faces().len() as u32)
            .into_par_iter()
            .map(|face| {
                let [a, b, c] = corners(mesh, face);
                let centroid = scale(add(add(a, b), c), 1.0 / 3.0);
                (morton_code(self.to_morton(centroid)), face)
            })
            .collect_into_vec(&mut keys);
        // The keys differ in the face, so an unstable sort has one result.
        keys.par_sort_unstable();
        self.keys = keys;
    }

    /// A point in cells of the Morton curve over the box of the mesh.
    pub(super) fn to_morton(&self, p: [f64; 3]) -> [f64; 3] {
        scale(sub(p, self.low), self.per_unit)
    }

    fn build_levels<T: Real>(&mut self, mesh: &Mesh<T>) {
        let keys = &self.keys;
        let leaf_box = |leaf: usize| {
            let faces = &keys[leaf * LEAF..keys.len().min((leaf + 1) * LEAF)];
            faces.iter().fold(EMPTY_BOX, |bounds, &(_, face)| {
                corners(mesh, face).into_iter().fold(bounds, including)
            })
        };
        let depth = depth(keys.len());
        self.levels.resize_with(depth, Vec::new);
        for level in 0..depth {
            let (below, rest) = self.levels.split_at_mut(level);
            match below.last() {
                None => fill_level(&mut rest[0], keys.len().div_ceil(LEAF), leaf_box),
                Some(below) => fill_level(&mut rest[0], below.len(), |node| below[node].bounds()),
            }
        }
    }

    /// The triangle at a place of the sorted order.
    #[inline(always)]
    pub(super) fn frame(&self, place: u32) -> &Frame {
        &self.frames[place as usize]
    }

    /// Places of the triangles of a leaf.
    #[inline(always)]
    pub(super) fn leaf(&self, leaf: u32) -> std::ops::Range<u32> {
        let first = leaf * LEAF as u32;
        first..(self.frames.len() as u32).min(first + LEAF as u32)
    }

    /// The face of the mesh at a place of the sorted order.
    #[inline(always)]
    pub(super) fn face(&self, place: u32) -> u32 {
        self.keys[place as usize].1
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        let nodes: usize = self.levels.iter().map(Vec::capacity).sum();
        self.keys.capacity() + self.frames.capacity() + nodes
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }

    /// The largest absolute coordinate of the mesh.
    pub(super) fn magnitude(&self) -> f64 {
        self.magnitude
    }

    /// Replaces in `found` whatever has a closer triangle. Nodes are visited nearest first.
    #[inline(always)]
    pub(super) fn nearest(&self, points: &Points, found: &mut Found, stack: &mut Stack) {
        stack.clear();
        stack.push((self.levels.len() as u32, 0, 0.0));
        while let Some((level, index, least)) = stack.pop() {
            if !(least < lanes::largest(&found.squared)) {
                continue;
            }
            if level == 0 {
                self.nearest_in_leaf(points, index, found);
                continue;
            }
            let node = &self.levels[level as usize - 1][index as usize];
            let top = stack.len();
            for slot in 0..WIDTH {
                let distances = node.distances(slot, points);
                if (0..LANES).any(|l| distances[l] < found.squared[l]) {
                    let child = index * WIDTH as u32 + slot as u32;
                    stack.push((level - 1, child, lanes::least(&distances)));
                }
            }
            sort_descending(&mut stack[top..]);
        }
    }

    /// The triangle closest to one point, by its place, if one is within a distance (squared).
    #[inline(always)]
    pub(super) fn nearest_to(&self, q: [f64; 3], within: f64, stack: &mut Stack) -> Option<u32> {
        let mut best = (within, None);
        stack.clear();
        stack.push((self.levels.len() as u32, 0, 0.0));
        while let Some((level, index, least)) = stack.pop() {
            if !(least < best.0) {
                continue;
            }
            if level == 0 {
                for place in self.leaf(index) {
                    let [squared] = self.frame(place).distances(&q.map(|x| [x]));
                    if squared < best.0 {
                        best = (squared, Some(place));
                    }
                }
                continue;
            }
            let squared = self.levels[level as usize - 1][index as usize].distances_from(q);
            let top = stack.len();
            for slot in 0..WIDTH {
                if squared[slot] < best.0 {
                    let child = index * WIDTH as u32 + slot as u32;
                    stack.push((level - 1, child, squared[slot]));
                }
            }
            sort_descending(&mut stack[top..]);
        }
        best.1
    }

    #[inline(always)]
    fn nearest_in_leaf(&self, points: &Points, leaf: u32, found: &mut Found) {
        for place in self.leaf(leaf) {
            found.try_triangle(self.frame(place), place, points);
        }
    }

    /// Appends the leaves that may hold what is closest to some point of the box `region`.
    ///
    /// The rule: let `y` be any point of the mesh. `|q|² − d²(q, S)` is convex in `q` for every set `S`, and
    /// `|q|² − |q − y|²` is linear; so where a set is farther than `y` from all eight corners of the box, it
    /// is farther than `y` from every point of the box. For a set that is a box itself the worst corner is
    /// found one axis at a time.
    #[inline(always)]
    pub(super) fn undominated(&self, region: &Region, stack: &mut Stack, leaves: &mut Vec<u32>) {
        stack.clear();
        stack.push((self.levels.len() as u32, 0, 0.0));
        while let Some((level, index, _)) = stack.pop() {
            if level == 0 {
                leaves.push(index);
                continue;
            }
            let kept = self.levels[level as usize - 1][index as usize].undominated(region);
            for slot in 0..WIDTH {
                if kept[slot] {
                    stack.push((level - 1, index * WIDTH as u32 + slot as u32, 0.0));
                }
            }
        }
    }
}

impl Found {
    /// Takes the triangle for every point to which it is closer than what was found.
    #[inline(always)]
    pub(super) fn try_triangle(&mut self, frame: &Frame, place: u32, points: &Points) {
        let squared = frame.distances(points);
        // Both arrays are written whole: a store of some lanes would hold up the next load.
        for l in 0..LANES {
            let old = self.triangle[l];
            self.triangle[l] = if squared[l] < self.squared[l] {
                place
            } else {
                old
            };
        }
        for l in 0..LANES {
            let old = self.squared[l];
            self.squared[l] = if squared[l] < old { squared[l] } else { old };
        }
    }
}

/// A box of queries, `low..=high`, and a point of the mesh near it.
pub(super) struct Region {
    /// Squares of the way from `y` to the low and high faces of the box, per axis.
    to_faces: [[f64; 2]; 3],
    low: [f64; 3],
    high: [f64; 3],
    /// Slack, and what rounding may have taken from a difference of squares.
    margin: f64,
    /// Sets farther than this (squared) from the centre are of no interest.
    reach: f64,
}

impl Region {
    /// `reach` is a distance from the centre of the box, infinite for no limit; `slack` is how much closer
    /// (squared) than a set something may be that counts with it; `rounding` is the error of the coordinates.
    pub(super) fn new(
        [low, high]: [[f64; 3]; 2],
        y: [f64; 3],
        reach: f64,
        slack: f64,
        rounding: f64,
    ) -> Self {
        let to_faces = std::array::from_fn(|a| {
            let (to_low, to_high) = (low[a] - y[a], high[a] - y[a]);
            [to_low * to_low, to_high * to_high]
        });
        let centre = scale(add(low, high), 0.5);
        let radius = norm(sub(centre, y)) + norm(sub(high, low));
        Self {
            to_faces,
            low,
            high,
            // Squares carry a few ε of themselves, coordinates theirs.
            margin: slack + radius * (1e-13 * radius + rounding),
            reach: reach * reach,
        }
    }
}

impl Node {
    fn new(child: impl Fn(usize) -> [[f64; 3]; 2]) -> Self {
        let mut node = Self {
            low: [[0.0; WIDTH]; 3],
            high: [[0.0; WIDTH]; 3],
        };
        for slot in 0..WIDTH {
            let [low, high] = child(slot);
            for a in 0..3 {
                node.low[a][slot] = low[a];
                node.high[a][slot] = high[a];
            }
        }
        node
    }

    fn bounds(&self) -> [[f64; 3]; 2] {
        [
            self.low
                .map(|lows| lows.into_iter().fold(f64::INFINITY, f64::min)),
            self.high
                .map(|highs| highs.into_iter().fold(f64::NEG_INFINITY, f64::max)),
        ]
    }

    /// Squared distances from the points to one child.
    #[inline(always)]
    fn distances(&self, slot: usize, points: &Points) -> [f64; LANES] {
        let mut squared = [0.0; LANES];
        for a in 0..3 {
            let (low, high) = (self.low[a][slot], self.high[a][slot]);
            for l in 0..LANES {
                let d = interval_distance(low, high, points[a][l]);
                squared[l] += d * d;
            }
        }
        squared
    }

    /// Squared distances from a point to the children.
    #[inline(always)]
    fn distances_from(&self, q: [f64; 3]) -> [f64; WIDTH] {
        let mut squared = [0.0; WIDTH];
        for a in 0..3 {
            for s in 0..WIDTH {
                let d = interval_distance(self.low[a][s], self.high[a][s], q[a]);
                squared[s] += d * d;
            }
        }
        squared
    }

    /// Which children may hold a closest point of the region.
    #[inline(always)]
    fn undominated(&self, region: &Region) -> [bool; WIDTH] {
        let mut excess = [region.margin; WIDTH];
        let mut squared = [0.0; WIDTH];
        for a in 0..3 {
            let centre = 0.5 * (region.low[a] + region.high[a]);
            for s in 0..WIDTH {
                let (low, high) = (self.low[a][s], self.high[a][s]);
                let from_low = interval_distance(low, high, region.low[a]);
                let from_high = interval_distance(low, high, region.high[a]);
                let at_low = region.to_faces[a][0] - from_low * from_low;
                let at_high = region.to_faces[a][1] - from_high * from_high;
                excess[s] += if at_low > at_high { at_low } else { at_high };
                let d = interval_distance(low, high, centre);
                squared[s] += d * d;
            }
        }
        let mut kept = [false; WIDTH];
        for s in 0..WIDTH {
            kept[s] = (excess[s] >= 0.0) & (squared[s] <= region.reach);
        }
        kept
    }
}

/// Distance from `x` to `low..=high` on a line.
#[inline(always)]
fn interval_distance(low: f64, high: f64, x: f64) -> f64 {
    let (below, above) = (low - x, x - high);
    let d = if below > above { below } else { above };
    if d > 0.0 { d } else { 0.0 }
}

/// Levels of nodes above the leaves of a number of triangles: the last one is a single node.
fn depth(triangles: usize) -> usize {
    let mut nodes = triangles.div_ceil(LEAF).div_ceil(WIDTH);
    let mut depth = 1;
    while nodes > 1 {
        nodes = nodes.div_ceil(WIDTH);
        depth += 1;
    }
    depth
}

/// Makes the nodes above `children` boxes.
fn fill_level(
    level: &mut Vec<Node>,
    children: usize,
    child: impl Fn(usize) -> [[f64; 3]; 2] + Sync,
) {
    (0..children.div_ceil(WIDTH))
        .into_par_iter()
        .map(|node| {
            Node::new(|slot| {
                let index = node * WIDTH + slot;
                if index < children {
                    child(index)
                } else {
                    EMPTY_BOX
                }
            })
        })
        .collect_into_vec(level);
}

const EMPTY_BOX: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

fn including([low, high]: [[f64; 3]; 2], p: [f64; 3]) -> [[f64; 3]; 2] {
    [
        std::array::from_fn(|a| low[a].min(p[a])),
        std::array::from_fn(|a| high[a].max(p[a])),
    ]
}

/// The corners of a face in double precision.
#[inline(always)]
pub(super) fn corners<T: Real>(mesh: &Mesh<T>, face: u32) -> [[f64; 3]; 3] {
    mesh.corners(face as usize).map(to_f64)
}

fn bounds<T: Real>(mesh: &Mesh<T>) -> ([f64; 3], [f64; 3]) {
    let [low, high] = (0..mesh.faces().len() as u32)
        .flat_map(|face| corners(mesh, face))
        .fold(EMPTY_BOX, including);
    (low, high)
}

/// Cells of the Morton curve along an axis: 21 bits each.
const MORTON_CELLS: f64 = ((1 << 21) - 1) as f64;

/// Place along the Morton curve of a point in its cells; points outside count as on the border.
pub(super) fn morton_code(p: [f64; 3]) -> u64 {
    let [x, y, z] = p.map(|x| spread_bits(x.clamp(0.0, MORTON_CELLS) as u64));
    x << 2 | y << 1 | z
}

/// Puts two zeros before each of the lowest 21 bits.
fn spread_bits(x: u64) -> u64 {
    let x = x & 0x1f_ffff;
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Insertion sort: there are at most [`WIDTH`].
#[inline(always)]
fn sort_descending(waiting: &mut [Waiting]) {
    for i in 1..waiting.len() {
        let mut j = i;
        while j > 0 && waiting[j - 1].2 < waiting[j].2 {
            waiting.swap(j - 1, j);
            j -= 1;
        }
    }
}
