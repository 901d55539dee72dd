//! Bounding volume hierarchy over the triangles of a mesh.
//!
//! The triangles are sorted along a Morton curve and cut into leaves of [`LEAF`]; every [`WIDTH`] leaves, or
//! nodes, have one node above them. So the tree is a few flat arrays: no pointers, built in parallel, the
//! same for any number of threads, and rebuilt in the same memory.

mod build;
mod node;
mod triangles;

use super::triangle::Frame;
pub(super) use build::{corners, morton_code};
use node::Node;
pub(super) use node::Region;
pub(super) use triangles::Triangles;

/// Triangles in a leaf.
pub(super) const LEAF: usize = 4;
/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Points that traverse the tree together.
pub(super) const LANES: usize = 8;

/// Coordinates of [`LANES`] points, `[axis][point]`.
pub(super) type Points = [[f64; LANES]; 3];

/// Nearest triangles of [`LANES`] points so far: squared distances and triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestTriangles {
    /// Squared distances.
    pub squared: [f64; LANES],
    /// Places of the triangles in the sorted order.
    pub triangle: [u32; LANES],
}

impl NearestTriangles {
    pub(super) const NOTHING: Self = Self {
        squared: [f64::INFINITY; LANES],
        triangle: [NOWHERE; LANES],
    };
}

/// Place of no triangle.
pub(super) const NOWHERE: u32 = u32::MAX;

/// A node still to be visited: its level, its place in the level, and the least squared distance from it to
/// any of the points.
type Waiting = (u32, u32, f64);

/// Scratch buffer of a traversal.
pub(super) type Stack = Vec<Waiting>;

/// Bounding volume hierarchy; see the head of this file.
#[derive(Clone, Debug, Default)]
pub(super) struct Bvh {
    /// The faces along the Morton curve.
    faces: Vec<u32>,
    /// Their frames; none of a large mesh, see [`Triangles`].
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
    /// Places of the triangles of a leaf.
    #[inline(always)]
    pub(super) fn leaf(&self, leaf: u32) -> std::ops::Range<u32> {
        let first = leaf * LEAF as u32;
        first..(self.len() as u32).min(first + LEAF as u32)
    }

    /// The face of the mesh at a place of the sorted order.
    #[inline(always)]
    pub(super) fn face(&self, place: u32) -> u32 {
        self.faces[place as usize]
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        let nodes: usize = self.levels.iter().map(Vec::capacity).sum();
        self.faces.capacity() + self.frames.capacity() + nodes
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> usize {
        self.faces.len()
    }

    /// Cells of the Morton curve per unit of length; 0 for a mesh without extent.
    pub(super) fn per_unit(&self) -> f64 {
        self.per_unit
    }

    /// The largest absolute coordinate of the mesh.
    pub(super) fn magnitude(&self) -> f64 {
        self.magnitude
    }

    /// Whether the box of some leaf is closer to a point than the square root of `within`.
    pub(super) fn has_box_within(&self, q: [f64; 3], within: f64) -> bool {
        self.has_box_below(self.levels.len() - 1, 0, q, within)
    }

    fn has_box_below(&self, level: usize, index: usize, q: [f64; 3], within: f64) -> bool {
        let squared = self.levels[level][index].distances_from(q);
        (0..WIDTH).any(|slot| {
            squared[slot] < within
                && (level == 0 || self.has_box_below(level - 1, index * WIDTH + slot, q, within))
        })
    }

    /// Appends the leaves that may contain the closest triangle of some point of the box `region`.
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

impl NearestTriangles {
    /// Updates the points that are closer to this triangle. Of equally close triangles the last in the sorted order is
    /// taken, in whichever order they are tried.
    #[inline(always)]
    pub(super) fn try_triangle(&mut self, frame: &Frame, place: u32, points: &Points) {
        let squared = frame.distances(points);
        // Both arrays are written whole: a store of some lanes would hold up the next load.
        for l in 0..LANES {
            let old = self.triangle[l];
            // Nothing is after `NOWHERE`.
            let tied = (squared[l] == self.squared[l]) & (place > old);
            self.triangle[l] = if (squared[l] < self.squared[l]) | tied {
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
