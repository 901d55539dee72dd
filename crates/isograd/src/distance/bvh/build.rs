//! Construction of the tree.

use rayon::slice::ParallelSliceMut;

use super::node::{EMPTY_BOX, Node, including, joined};
use super::{Bvh, LEAF, WIDTH};
use crate::distance::Error;
use crate::large::is_large;
use crate::parallel;
use crate::vector::{add, scale, sub, to_f64};
use crate::{Mesh, Real};

/// Lengths whose squares and their sums stay far from the ends of `f64`.
const LENGTHS: std::ops::Range<f64> = 1e-140..1e140;

impl Bvh {
    /// Builds the tree of `mesh`, reusing the memory.
    pub(in crate::distance) fn rebuild<T: Real>(&mut self, mesh: &Mesh<T>) -> Result<(), Error> {
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
        let mut frames = std::mem::take(&mut self.frames);
        if !is_large(self.len()) {
            parallel::fill_large(&mut frames, self.len(), &|place| {
                self.frame_of(mesh, place as u32)
            });
            self.frames = frames;
        }
        self.build_levels(mesh);
        Ok(())
    }

    fn sort<T: Real>(&mut self, mesh: &Mesh<T>) {
        let mut keys = parallel::map(mesh.faces().len(), |face| {
            let face = face as u32;
            let [a, b, c] = corners(mesh, face);
            let centroid = scale(add(add(a, b), c), 1.0 / 3.0);
            (morton_code(self.to_morton(centroid)), face)
        });
        // The keys differ in the face, so an unstable sort has one result.
        keys.par_sort_unstable();
        parallel::fill(&mut self.faces, keys.len(), |place| keys[place].1);
    }

    /// A point in cells of the Morton curve over the box of the mesh.
    pub(in crate::distance) fn to_morton(&self, p: [f64; 3]) -> [f64; 3] {
        scale(sub(p, self.low), self.per_unit)
    }

    fn build_levels<T: Real>(&mut self, mesh: &Mesh<T>) {
        let order = &self.faces;
        let leaf_box = |leaf: usize| {
            let faces = &order[leaf * LEAF..order.len().min((leaf + 1) * LEAF)];
            faces.iter().fold(EMPTY_BOX, |bounds, &face| {
                corners(mesh, face).into_iter().fold(bounds, including)
            })
        };
        let depth = depth(order.len());
        self.levels.resize_with(depth, Vec::new);
        for level in 0..depth {
            let (below, rest) = self.levels.split_at_mut(level);
            match below.last() {
                None => fill_level(&mut rest[0], order.len().div_ceil(LEAF), leaf_box),
                Some(below) => fill_level(&mut rest[0], below.len(), |node| below[node].bounds()),
            }
        }
    }
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

/// Fills a level with the nodes above `children` boxes.
fn fill_level(
    level: &mut Vec<Node>,
    children: usize,
    child: impl Fn(usize) -> [[f64; 3]; 2] + Sync,
) {
    parallel::fill_large(level, children.div_ceil(WIDTH), &|node| {
        Node::new(|slot| {
            let index = node * WIDTH + slot;
            if index < children {
                child(index)
            } else {
                EMPTY_BOX
            }
        })
    });
}

/// The corners of a face in double precision.
#[inline(always)]
pub(in crate::distance) fn corners<T: Real>(mesh: &Mesh<T>, face: u32) -> [[f64; 3]; 3] {
    mesh.corners(face as usize).map(to_f64)
}

fn bounds<T: Real>(mesh: &Mesh<T>) -> ([f64; 3], [f64; 3]) {
    let of_face = |face: usize| {
        let corners = corners(mesh, face as u32).into_iter();
        corners.fold(EMPTY_BOX, including)
    };
    parallel::reduce(mesh.faces().len(), EMPTY_BOX, of_face, joined).into()
}

/// Cells of the Morton curve along an axis: 21 bits each.
const MORTON_CELLS: f64 = ((1 << 21) - 1) as f64;

/// Place along the Morton curve of a point in its cells; points outside count as on the border.
pub(in crate::distance) fn morton_code(p: [f64; 3]) -> u64 {
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
