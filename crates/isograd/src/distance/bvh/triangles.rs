//! The triangles of a mesh in the order of its tree, each in its [`Frame`].

use std::sync::OnceLock;

use super::{Bvh, LANES, NearestTriangles, Points, Stack, WIDTH, corners, sort_descending};
use crate::distance::lanes;
use crate::distance::triangle::Frame;
use crate::{Mesh, Real};

/// Triangles whose frames are made together.
const RUN: usize = 64;

/// A mesh with its tree and the frames of its triangles. Those of a large mesh would take more memory than all else: they are
/// made when they are needed first, and are freed with this.
pub(in crate::distance) struct Triangles<'a, T> {
    pub mesh: &'a Mesh<T>,
    pub bvh: &'a Bvh,
    /// Frames of a large mesh, by runs of the tree's order.
    runs: Vec<OnceLock<Vec<Frame>>>,
}

impl<'a, T: Real> Triangles<'a, T> {
    /// `bvh` is that of `mesh`.
    pub(in crate::distance) fn new(mesh: &'a Mesh<T>, bvh: &'a Bvh) -> Self {
        let runs = match bvh.frames.is_empty() {
            true => bvh.len().div_ceil(RUN),
            false => 0,
        };
        Self {
            mesh,
            bvh,
            runs: (0..runs).map(|_| OnceLock::new()).collect(),
        }
    }

    /// The frame of the triangle at a place of the tree's order.
    #[inline(always)]
    pub(in crate::distance) fn frame(&self, place: u32) -> &Frame {
        match self.bvh.frames.get(place as usize) {
            Some(frame) => frame,
            None => self.made(place),
        }
    }

    #[inline(never)]
    fn made(&self, place: u32) -> &Frame {
        let run = place as usize / RUN;
        let make = || {
            let places = run * RUN..self.bvh.len().min((run + 1) * RUN);
            let frame = |place| self.bvh.frame_of(self.mesh, place as u32);
            places.map(frame).collect()
        };
        &self.runs[run].get_or_init(make)[place as usize % RUN]
    }

    /// Updates `found` with the nearest triangles of the whole tree. Nodes are visited nearest first.
    #[inline(always)]
    pub(in crate::distance) fn nearest(
        &self,
        points: &Points,
        found: &mut NearestTriangles,
        stack: &mut Stack,
    ) {
        let levels = &self.bvh.levels;
        stack.clear();
        stack.push((levels.len() as u32, 0, 0.0));
        while let Some((level, index, least)) = stack.pop() {
            if !(least < lanes::largest(&found.squared)) {
                continue;
            }
            if level == 0 {
                for place in self.bvh.leaf(index) {
                    found.try_triangle(self.frame(place), place, points);
                }
                continue;
            }
            let node = &levels[level as usize - 1][index as usize];
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

    /// Place of the triangle closest to one point, if its squared distance is below `within`.
    #[inline(always)]
    pub(in crate::distance) fn nearest_to(
        &self,
        q: [f64; 3],
        within: f64,
        stack: &mut Stack,
    ) -> Option<u32> {
        let levels = &self.bvh.levels;
        let mut best = (within, None);
        stack.clear();
        stack.push((levels.len() as u32, 0, 0.0));
        while let Some((level, index, least)) = stack.pop() {
            if !(least < best.0) {
                continue;
            }
            if level == 0 {
                for place in self.bvh.leaf(index) {
                    let [squared] = self.frame(place).distances(&q.map(|x| [x]));
                    if squared < best.0 {
                        best = (squared, Some(place));
                    }
                }
                continue;
            }
            let squared = levels[level as usize - 1][index as usize].distances_from(q);
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
}

impl Bvh {
    /// A copy of the frame of the triangle at a place of the sorted order.
    pub(in crate::distance) fn frame_of<T: Real>(&self, mesh: &Mesh<T>, place: u32) -> Frame {
        let made = || Frame::new(corners(mesh, self.face(place)));
        self.frames
            .get(place as usize)
            .copied()
            .unwrap_or_else(made)
    }
}
