//! A hierarchy of boxes over triangles, made on the device.
//!
//! The triangles are put in the order of the Morton codes of their centers (30 bits; equal codes stay in the
//! order of the faces), and the hierarchy is the radix tree of that order, every node of it made on its own
//! (T. Karras, *Maximizing parallelism in the construction of BVHs, octrees, and k-d trees*, 2012). The box of
//! a node is that of a run of triangles, put together from the aligned runs of a pyramid: nothing waits for
//! anything, and there are no atomics.

use cubecl::prelude::*;
use isograd::Grid;

use super::super::triangle::{FRAME, corners, frame, store_frame};
use super::super::{Error, Mesh, MeshArrays};
use super::morton::face_order;
use crate::device::{argument, launch};
use crate::grid::{Lattice, low_corner};
use crate::primitives::ends::ends;
use crate::{Buffer, Device, Scalar};

/// Stands in `lowest` where there is no triangle; and for a cell without a seed or a result.
pub(crate) const NONE: u32 = u32::MAX;

/// Marks a child that is a run of triangles: above it, one less than their number, from bit 28 on; below, the
/// first of them.
pub(super) const LEAF: u32 = 1 << 31;

/// Triangles of a run that is not cut further.
const RUN: u32 = 2;

/// The hierarchy. Places are seen from the low corner of a grid.
pub(crate) struct Tree<T> {
    /// For each node the boxes of its two children: low corner, high corner. Node 0 is the root.
    pub boxes: Buffer<T>,
    /// For each node: its two children, and the lowest face below each.
    pub children: Buffer<u32>,
    /// The frame of each triangle, in Morton order.
    pub frames: Buffer<T>,
    /// Its face.
    pub faces: Buffer<u32>,
    /// Boxes of aligned runs of them, as a heap: entry 1 is that of all.
    pub pyramid: Buffer<T>,
}

/// [`Tree`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct TreeArrays<F: Float + CubeElement> {
    pub boxes: Array<F>,
    pub children: Array<u32>,
    pub frames: Array<F>,
    pub faces: Array<u32>,
    pub pyramid: Array<F>,
}

argument!(
    Tree<T> => TreeArraysLaunch<T, R>:
    |of| of.boxes.arg(), of.children.arg(), of.frames.arg(), of.faces.arg(), of.pyramid.arg()
);

impl<T: Scalar> Tree<T> {
    /// The hierarchy over the faces of a mesh.
    pub fn new<R: Runtime>(
        device: &Device<R>,
        mesh: &Mesh<T>,
        grid: &Grid<T>,
    ) -> Result<Self, Error> {
        let triangles = mesh.check()?;
        let bounds = ends(device, &mesh.vertices, 3)?;
        let order = face_order(device, mesh, &bounds)?;
        let placed = Placed::new(device, mesh, grid, &order.places)?;
        let leaves = placed.faces.len();
        let boxes = device.empty((leaves - 1) * 12)?;
        let children = device.empty((leaves - 1) * 4)?;
        launch!(device, leaves - 1 => make_nodes<T>(
            order.keys, placed.pyramid, placed.lowest, boxes, children, leaves as u32,
            triangles as u32, RUN,
        ));
        Ok(Self {
            boxes,
            children,
            frames: placed.frames,
            faces: placed.faces,
            pyramid: placed.pyramid,
        })
    }

    /// Triangles that the pyramid has room for, a power of two.
    pub fn width(&self) -> usize {
        self.pyramid.len() / 12
    }
}

/// The triangles in their order, and the pyramid over them.
struct Placed<T> {
    frames: Buffer<T>,
    faces: Buffer<u32>,
    pyramid: Buffer<T>,
    /// The lowest face in each entry of the pyramid.
    lowest: Buffer<u32>,
}

impl<T: Scalar> Placed<T> {
    fn new<R: Runtime>(
        device: &Device<R>,
        mesh: &Mesh<T>,
        grid: &Grid<T>,
        places: &Buffer<u32>,
    ) -> Result<Self, Error> {
        // A lone triangle stands twice, so that there is a node.
        let leaves = places.len().max(2);
        let width = leaves.next_power_of_two();
        let placed = Self {
            frames: device.empty(leaves * FRAME)?,
            faces: device.empty(leaves)?,
            pyramid: device.empty(2 * width * 6)?,
            lowest: device.empty(2 * width)?,
        };
        launch!(device, width => place_triangles<T>(
            mesh, places, placed.frames, placed.faces, placed.pyramid, placed.lowest, grid,
        ));
        let mut level = width / 2;
        while level > 0 {
            launch!(device, level => join_pairs<T>(placed.pyramid, placed.lowest, level as u32));
            level /= 2;
        }
        Ok(placed)
    }
}

/// Frames and boxes of the triangles in Morton order; boxes of nothing to the width of the pyramid.
#[cube(launch)]
fn place_triangles<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    places: &Array<u32>,
    frames: &mut Array<F>,
    face_of: &mut Array<u32>,
    pyramid: &mut Array<F>,
    lowest: &mut Array<u32>,
    grid: Lattice<F>,
) {
    let width = lowest.len() / 2;
    if ABSOLUTE_POS < width {
        let at = width + ABSOLUTE_POS;
        if ABSOLUTE_POS < face_of.len() {
            let face = places[min(ABSOLUTE_POS, places.len() - 1)];
            let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
            store_frame::<F>(frames, ABSOLUTE_POS, frame::<F>(t));
            face_of[ABSOLUTE_POS] = face;
            lowest[at] = face;
            pyramid[at * 6] = min(t.a.x, min(t.b.x, t.c.x));
            pyramid[at * 6 + 1] = min(t.a.y, min(t.b.y, t.c.y));
            pyramid[at * 6 + 2] = min(t.a.z, min(t.b.z, t.c.z));
            pyramid[at * 6 + 3] = max(t.a.x, max(t.b.x, t.c.x));
            pyramid[at * 6 + 4] = max(t.a.y, max(t.b.y, t.c.y));
            pyramid[at * 6 + 5] = max(t.a.z, max(t.b.z, t.c.z));
        } else {
            lowest[at] = NONE;
            for axis in 0..3usize {
                pyramid[at * 6 + axis] = F::new(3e38);
                pyramid[at * 6 + 3 + axis] = F::new(-3e38);
            }
        }
    }
}

/// The pyramid lies as a heap does: entry 1 is the box of all, and under entry `i` are `2i` and `2i + 1`.
#[cube(launch)]
fn join_pairs<F: Float>(pyramid: &mut Array<F>, lowest: &mut Array<u32>, level: u32) {
    if ABSOLUTE_POS < level as usize {
        let at = level as usize + ABSOLUTE_POS;
        let (a, b) = (at * 12, at * 12 + 6);
        for axis in 0..3usize {
            pyramid[at * 6 + axis] = min(pyramid[a + axis], pyramid[b + axis]);
            pyramid[at * 6 + 3 + axis] = max(pyramid[a + 3 + axis], pyramid[b + 3 + axis]);
        }
        lowest[at] = min(lowest[at * 2], lowest[at * 2 + 1]);
    }
}

/// One more than the leading bits that the keys of two places in the order share, and 0 where the second is
/// none: of the codes, and of the places where these are equal.
#[cube]
fn shared_bits(codes: &Array<u32>, a: i32, b: i32, leaves: i32, triangles: i32) -> i32 {
    let mut bits = 0i32.runtime();
    if b >= 0i32 && b < leaves {
        let last = triangles - 1i32;
        let differ = codes[min(a, last) as usize] ^ codes[min(b, last) as usize];
        if differ == 0u32 {
            bits = 33i32 + u32::leading_zeros(a as u32 ^ b as u32) as i32;
        } else {
            bits = 1i32 + u32::leading_zeros(differ) as i32;
        }
    }
    bits
}

/// The node that begins or ends at place `ABSOLUTE_POS`: how far it reaches, and where it is cut in two.
#[cube(launch)]
fn make_nodes<F: Float>(
    codes: &Array<u32>,
    pyramid: &Array<F>,
    lowest: &Array<u32>,
    boxes: &mut Array<F>,
    children: &mut Array<u32>,
    leaves: u32,
    triangles: u32,
    #[comptime] run: u32,
) {
    if ABSOLUTE_POS < leaves as usize - 1 {
        let width = (lowest.len() / 2) as u32;
        let (n, m) = (leaves as i32, triangles as i32);
        let i = ABSOLUTE_POS as i32;
        let after = shared_bits(codes, i, i + 1i32, n, m);
        let before = shared_bits(codes, i, i - 1i32, n, m);
        let way = select(after > before, 1i32, 0i32 - 1i32);
        let outside = min(after, before);
        // The reach: a bound by doubling, then bisection.
        let mut bound = 2i32.runtime();
        while shared_bits(codes, i, i + bound * way, n, m) > outside {
            bound *= 2i32;
        }
        let mut reach = 0i32.runtime();
        let mut step = bound / 2i32;
        while step > 0i32 {
            if shared_bits(codes, i, i + (reach + step) * way, n, m) > outside {
                reach += step;
            }
            step /= 2i32;
        }
        let end = i + reach * way;
        // The cut: the last place that shares more with this one than the end does.
        let inside = shared_bits(codes, i, end, n, m);
        let mut split = 0i32.runtime();
        let mut half = reach;
        let mut going = true;
        while going {
            half = (half + 1i32) / 2i32;
            if shared_bits(codes, i, i + (split + half) * way, n, m) > inside {
                split += half;
            }
            going = half > 1i32;
        }
        let cut = (i + split * way + min(way, 0i32)) as u32;
        let first = min(i, end) as u32;
        let last = max(i, end) as u32;
        let node = ABSOLUTE_POS;
        children[node * 4] = name_child(first, cut, cut, run);
        children[node * 4 + 1] = name_child(cut + 1u32, last, cut + 1u32, run);
        children[node * 4 + 2] =
            join_range::<F>(pyramid, lowest, boxes, node * 12, first, cut, width);
        children[node * 4 + 3] = join_range::<F>(
            pyramid,
            lowest,
            boxes,
            node * 12 + 6,
            cut + 1u32,
            last,
            width,
        );
    }
}

/// A child that has the places from `first` to `last`: a run, or the node `node`.
#[cube]
fn name_child(first: u32, last: u32, node: u32, #[comptime] run: u32) -> u32 {
    let more = last - first;
    select(more < run, LEAF | (more << 28u32) | first, node)
}

/// Writes the box of the places from `first` to `last` at `to`, and returns the lowest face among them.
#[cube]
fn join_range<F: Float>(
    pyramid: &Array<F>,
    lowest: &Array<u32>,
    boxes: &mut Array<F>,
    to: usize,
    first: u32,
    last: u32,
    width: u32,
) -> u32 {
    let mut low = Array::<F>::new(3usize);
    let mut high = Array::<F>::new(3usize);
    for axis in 0..3usize {
        low[axis] = F::new(3e38);
        high[axis] = F::new(-3e38);
    }
    let mut face = NONE.runtime();
    // The aligned runs that make up the range, from both its ends.
    let mut left = first + width;
    let mut right = last + width + 1u32;
    while left < right {
        if left % 2u32 == 1u32 {
            join_entry::<F>(pyramid, &mut low, &mut high, left);
            face = min(face, lowest[left as usize]);
            left += 1u32;
        }
        if right % 2u32 == 1u32 {
            right -= 1u32;
            join_entry::<F>(pyramid, &mut low, &mut high, right);
            face = min(face, lowest[right as usize]);
        }
        left /= 2u32;
        right /= 2u32;
    }
    for axis in 0..3usize {
        boxes[to + axis] = low[axis];
        boxes[to + 3 + axis] = high[axis];
    }
    face
}

#[cube]
fn join_entry<F: Float>(pyramid: &Array<F>, low: &mut Array<F>, high: &mut Array<F>, entry: u32) {
    let at = entry as usize * 6;
    for axis in 0..3usize {
        low[axis] = min(low[axis], pyramid[at + axis]);
        high[axis] = max(high[axis], pyramid[at + 3 + axis]);
    }
}
