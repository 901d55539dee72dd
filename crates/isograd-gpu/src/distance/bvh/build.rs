//! A hierarchy of boxes over triangles, made on the device.
//!
//! The triangles are put in the order of the Morton codes of their centers (30 bits; equal codes stay in the
//! order of the faces), and the hierarchy is a pyramid of aligned runs of that order, which lies as a heap does: entry 1
//! is that of all, and under entry `i` are `2i` and `2i + 1`. Nothing waits for anything, and there are no atomics.
//!
//! A box that leans is thick, and from afar hundreds of them seem to be as near as the closest triangle. So short runs
//! also have a slab: bounds of their corners along their mean normal, and how far the corners are from its axis.

use cubecl::prelude::*;
use isograd::Grid;

use super::super::triangle::{FRAME, corners, frame, load_frame, store_frame};
use super::super::{Error, Mesh, MeshArrays};
use super::morton::face_order;
use crate::device::{argument, launch};
use crate::grid::{Lattice, low_corner};
use crate::primitives::ends::ends;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Stands for a cell without a seed or a result.
pub(crate) const NONE: u32 = u32::MAX;

/// Triangles of a run that is not cut further.
pub(super) const RUN: u32 = 2;

/// Triangles of the longest run that has a slab, a power of two.
pub(super) const SLAB_RUN: u32 = 128;

/// Numbers of a slab: normal, bounds along it from the center of the box, distance from its axis.
pub(super) const SLAB: u32 = 6;

/// The hierarchy. Places are seen from the low corner of a grid.
pub(crate) struct Tree<T> {
    /// Boxes of aligned runs of triangles: low corner, high corner.
    pub pyramid: Buffer<T>,
    /// Slabs of those of at most [`SLAB_RUN`] triangles; see [`SLAB`].
    pub slabs: Buffer<T>,
    /// The frame of each triangle, in Morton order.
    pub frames: Buffer<T>,
    /// Its face.
    pub faces: Buffer<u32>,
}

/// [`Tree`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct TreeArrays<F: Float + CubeElement> {
    pub pyramid: Array<F>,
    pub slabs: Array<F>,
    pub frames: Array<F>,
    pub faces: Array<u32>,
}

argument!(
    Tree<T> => TreeArraysLaunch<T, R>:
    |of| of.pyramid.arg(), of.slabs.arg(), of.frames.arg(), of.faces.arg()
);

impl<T: Scalar> Tree<T> {
    /// The hierarchy over the faces of a mesh.
    pub fn new<R: Runtime>(
        device: &Device<R>,
        mesh: &Mesh<T>,
        grid: &Grid<T>,
    ) -> Result<Self, Error> {
        mesh.check()?;
        let bounds = ends(device, &mesh.vertices, 3)?;
        let places = face_order(device, mesh, &bounds)?.places;
        // A lone triangle stands twice, so that there is a run.
        let leaves = places.len().max(2);
        let width = leaves.next_power_of_two();
        let tree = Self {
            pyramid: device.empty(2 * width * 6)?,
            slabs: device.empty(width * SLAB as usize)?,
            frames: device.empty(leaves * FRAME)?,
            faces: device.empty(leaves)?,
        };
        launch!(device, width => place_triangles<T>(
            mesh, places, tree.frames, tree.faces, tree.pyramid, grid,
        ));
        let mut level = width / 2;
        while level > 0 {
            launch!(device, level => join_pairs<T>(tree.pyramid, level as u32));
            level /= 2;
        }
        launch!(device, width => find_slabs<T>(
            tree.pyramid, tree.frames, tree.slabs, leaves as u32, width as u32,
        ));
        Ok(tree)
    }

    /// Triangles that the pyramid has room for, a power of two.
    pub fn width(&self) -> usize {
        self.pyramid.len() / 12
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
    grid: Lattice<F>,
) {
    let width = pyramid.len() / 12;
    if ABSOLUTE_POS < width {
        let at = width + ABSOLUTE_POS;
        if ABSOLUTE_POS < face_of.len() {
            let face = places[min(ABSOLUTE_POS, places.len() - 1)];
            let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
            store_frame::<F>(frames, ABSOLUTE_POS, frame::<F>(t));
            face_of[ABSOLUTE_POS] = face;
            pyramid[at * 6] = min(t.a.x, min(t.b.x, t.c.x));
            pyramid[at * 6 + 1] = min(t.a.y, min(t.b.y, t.c.y));
            pyramid[at * 6 + 2] = min(t.a.z, min(t.b.z, t.c.z));
            pyramid[at * 6 + 3] = max(t.a.x, max(t.b.x, t.c.x));
            pyramid[at * 6 + 4] = max(t.a.y, max(t.b.y, t.c.y));
            pyramid[at * 6 + 5] = max(t.a.z, max(t.b.z, t.c.z));
        } else {
            for axis in 0..3usize {
                pyramid[at * 6 + axis] = F::new(3e38);
                pyramid[at * 6 + 3 + axis] = F::new(-3e38);
            }
        }
    }
}

/// Boxes of a level of the pyramid from those of the level below.
#[cube(launch)]
fn join_pairs<F: Float>(pyramid: &mut Array<F>, level: u32) {
    if ABSOLUTE_POS < level as usize {
        let at = level as usize + ABSOLUTE_POS;
        let (a, b) = (at * 12, at * 12 + 6);
        for axis in 0..3usize {
            pyramid[at * 6 + axis] = min(pyramid[a + axis], pyramid[b + axis]);
            pyramid[at * 6 + 3 + axis] = max(pyramid[a + 3 + axis], pyramid[b + 3 + axis]);
        }
    }
}

/// The slab of entry `ABSOLUTE_POS` of the pyramid, where its run is short enough.
#[cube(launch)]
fn find_slabs<F: Float + CubeElement>(
    pyramid: &Array<F>,
    frames: &Array<F>,
    slabs: &mut Array<F>,
    leaves: u32,
    width: u32,
) {
    let entry = ABSOLUTE_POS as u32;
    if entry < width && entry * comptime!(SLAB_RUN) >= width {
        // Of the run: as often as the entry can be doubled within the width.
        let mut run = 1u32.runtime();
        while entry * run < width {
            run *= 2u32;
        }
        let first = entry * run - width;
        let end = min(first + run, leaves);
        let middle = center_of_box::<F>(pyramid, entry);
        let mut sum = Vector3::<F>::zero();
        for place in first..end {
            let t = load_frame::<F>(frames, place);
            sum = sum.add(t.u.cross(t.v).scale((t.foot + t.back) * t.height));
        }
        let normal = sum.direction();
        let mut low = F::new(0.0);
        let mut high = F::new(0.0);
        let mut across = F::new(0.0);
        for place in first..end {
            let t = load_frame::<F>(frames, place);
            let a = t.origin.sub(middle);
            let b = a.add(t.u.scale(t.foot + t.back));
            let c = a.add(t.u.scale(t.foot)).add(t.v.scale(t.height));
            let (x, y, z) = (normal.dot(a), normal.dot(b), normal.dot(c));
            let begins = place == first;
            let (least, most) = (min(x, min(y, z)), max(x, max(y, z)));
            low = select(begins, least, min(low, least));
            high = select(begins, most, max(high, most));
            across = max(across, a.sub(normal.scale(x)).norm());
            across = max(across, b.sub(normal.scale(y)).norm());
            across = max(across, c.sub(normal.scale(z)).norm());
        }
        let at = (entry * comptime!(SLAB)) as usize;
        normal.store(slabs, at);
        slabs[at + 3] = low;
        slabs[at + 4] = high;
        slabs[at + 5] = across;
    }
}

/// The center of the box of an entry.
#[cube]
pub(super) fn center_of_box<F: Float>(pyramid: &Array<F>, entry: u32) -> Vector3<F> {
    let low = Vector3::<F>::at(pyramid, (entry * 2u32) as usize);
    let high = Vector3::<F>::at(pyramid, (entry * 2u32 + 1u32) as usize);
    low.add(high).scale(F::new(0.5))
}
