//! Culling: from the candidates of a block to those of its children.

use super::block::{CHILDREN, Children, Extent, bit, centers, closest_of};
use super::kernels::{self, MARGIN};
use super::site_list::{Boxes, closest};
use super::task::{Local, Task};
use super::workspace::{ChildCandidates, Lists};
use crate::Real;
use crate::distance::bvh::{LANES, Points};
use crate::simd::vectorized;
use crate::vector::{norm, sub};

impl<T: Real> Task<'_, T> {
    /// Fills the lists of the children from those of their parent.
    pub(super) fn cull(
        &self,
        local: &Local,
        lists: Lists,
        children: &Children,
        kept: &mut ChildCandidates,
    ) {
        let feet = self.feet(local, lists, children);
        let mut boxes = Boxes::NOTHING;
        for l in 0..CHILDREN {
            kept.large[l].clear();
            if let (Some(extent), Some(foot)) = (&children[l].1, feet[l]) {
                self.set_box(&mut boxes, l, local, extent, foot);
                if !lists.large.is_empty() {
                    self.cull_large(lists.large, extent, foot, &mut kept.large[l]);
                }
            }
        }
        vectorized!(self.arch, kept.sites.cull(local.sites, lists.sites, &boxes));
    }

    /// A point of the mesh close to the center of each child, where the lists hold one.
    fn feet(
        &self,
        local: &Local,
        lists: Lists,
        children: &Children,
    ) -> [Option<[f64; 3]>; CHILDREN] {
        let centers = centers(children, local.center);
        let sites = (!lists.sites.is_empty()).then(|| self.closest_sites(local, lists, &centers));
        let large = (!lists.large.is_empty()).then(|| {
            self.arch.dispatch(kernels::ClosestListed {
                triangles: self.triangles,
                list: lists.large,
                points: &centers,
            })
        });
        std::array::from_fn(|l| {
            let center = children[l].1?.center;
            let site =
                sites.map(|sites| self.sites.position(local.sites[sites[l] as usize].number));
            let on_large =
                large.map(|found| self.triangles.frame(found.triangle[l]).nearest(center));
            closest_of([site, on_large], center)
        })
    }

    /// Places of the listed sites closest to some points.
    pub(super) fn closest_sites(
        &self,
        local: &Local,
        lists: Lists,
        points: &Points,
    ) -> [u32; LANES] {
        let per_cell = 1.0 / self.grid.spacing().f64();
        let mut in_cells = [[0.0; LANES]; 3];
        for a in 0..3 {
            for l in 0..LANES {
                in_cells[a][l] = ((points[a][l] - local.center[a]) * per_cell) as f32;
            }
        }
        vectorized!(self.arch, closest(local.sites, lists.sites, &in_cells))
    }

    fn set_box(&self, boxes: &mut Boxes, l: usize, local: &Local, extent: &Extent, foot: [f64; 3]) {
        let per_cell = 1.0 / self.grid.spacing().f64();
        for a in 0..3 {
            boxes.center[a][l] = ((extent.center[a] - local.center[a]) * per_cell) as f32;
            boxes.side[a][l] = ((extent.high[a] - extent.low[a]) * per_cell) as f32;
            boxes.foot[a][l] = ((foot[a] - local.center[a]) * per_cell) as f32;
        }
        let away = norm(sub(extent.center, foot));
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
        let (triangles, corners, bound) = (self.triangles, &corners, &bound);
        self.arch.dispatch(kernels::CullLarge {
            triangles,
            list,
            corners,
            bound,
            kept,
        });
    }
}
