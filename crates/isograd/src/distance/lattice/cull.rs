//! From the lists of a block to those of its children.

use super::block::{Children, Extent, bit};
use super::kernels::{self, Boxes, CHILDREN, MARGIN};
use super::task::{Local, Task};
use super::workspace::Lists;
use crate::Real;
use crate::distance::bvh::{LANES, Points};
use crate::vector::{norm, sub};

impl<T: Real> Task<'_, T> {
    /// Coordinates in cells from `origin`, in single precision.
    pub(super) fn in_cells(&self, points: &Points, origin: [f64; 3]) -> [[f32; CHILDREN]; 3] {
        let per_cell = 1.0 / self.grid.spacing().f64();
        std::array::from_fn(|a| points[a].map(|x| ((x - origin[a]) * per_cell) as f32))
    }

    /// Fills the lists of the children from those of their parent.
    pub(super) fn cull(
        &self,
        local: &Local,
        lists: &Lists,
        children: &Children,
        feet: &[Option<[f64; 3]>; CHILDREN],
        kept: &mut [Lists; CHILDREN],
    ) {
        let mut boxes = Boxes::NOTHING;
        for l in 0..CHILDREN {
            kept[l].clear();
            if let (Some(extent), Some(foot)) = (&children[l].1, feet[l]) {
                self.set_box(&mut boxes, l, local, extent, foot);
                if !lists.large.is_empty() {
                    self.cull_large(&lists.large, extent, foot, &mut kept[l].large);
                }
            }
        }
        if !lists.sites.is_empty() {
            self.arch.dispatch(kernels::CullSites {
                sites: local.sites,
                list: &lists.sites,
                boxes: &boxes,
                lists: kept,
            });
        }
    }

    fn set_box(&self, boxes: &mut Boxes, l: usize, local: &Local, extent: &Extent, foot: [f64; 3]) {
        let per_cell = 1.0 / self.grid.spacing().f64();
        for a in 0..3 {
            boxes.centre[a][l] = ((extent.centre[a] - local.centre[a]) * per_cell) as f32;
            boxes.side[a][l] = ((extent.high[a] - extent.low[a]) * per_cell) as f32;
            boxes.foot[a][l] = ((foot[a] - local.centre[a]) * per_cell) as f32;
        }
        let away = norm(sub(extent.centre, foot));
        let far = away + 2.0 * extent.radius + local.radius;
        let margin = far * (MARGIN * far + self.rounding());
        boxes.bound[l] = ((away * away + margin) * per_cell * per_cell) as f32;
        let reach = (self.reach(extent.radius) + MARGIN * far) * per_cell;
        boxes.reach[l] = (reach * reach) as f32;
    }

    fn cull_large(&self, list: &[u32], extent: &Extent, foot: [f64; 3], kept: &mut Vec<u32>) {
        let mut corners: Points = [[0.0; LANES]; 3];
        let mut bound = [0.0; LANES];
        for l in 0..LANES {
            let q: [f64; 3] = std::array::from_fn(|a| {
                if bit(l, a) == 0 {
                    extent.low[a]
                } else {
                    extent.high[a]
                }
            });
            for a in 0..3 {
                corners[a][l] = q[a];
            }
            let away = norm(sub(q, foot));
            bound[l] = away * (away * (1.0 + 1e-12) + self.rounding());
        }
        let (bvh, corners, bound) = (self.bvh, &corners, &bound);
        self.arch.dispatch(kernels::CullLarge {
            bvh,
            list,
            corners,
            bound,
            kept,
        });
    }
}
