//! Distances in one block of cells.
//!
//! A block is halved along every axis down to 4×4×4 cells. Each child keeps the vertices of its parent whose
//! triangles may be closest: it rejects those that are farther from the whole of the child than one point of the mesh,
//! its *foot*. The last lists are short, and [`packet`] searches them for sixteen cells at once.

use pulp::Arch;

use super::NO_TRIANGLE;
use super::block::{BLOCK, Block, CHILDREN, Cells, Extent, PACKETS, children};
use super::kernels;
use super::packet::{self, BlockCandidates, CELLS, Packet};
use super::site_list::Site;
use super::sites::{LARGE, Sites};
use super::workspace::{Candidates, ChildCandidates, Lists, Workspace};
use crate::distance::bvh::{LANES, NOWHERE, NearestTriangles, Region, Stack, Triangles};
use crate::distance::triangle;
use crate::simd::vectorized;
use crate::vector::{scale, sub, to_f64};
use crate::{Grid, Real};

/// Where a distance is below this share of a triangle's longest edge, it is measured from the nearest corner.
pub(super) const NEAR: f64 = 0.1;

/// Inputs and constants of all blocks.
pub(super) struct Task<'a, T> {
    pub grid: &'a Grid<T>,
    pub triangles: &'a Triangles<'a, T>,
    pub sites: &'a Sites,
    /// Width of the band, in the user's unit.
    pub width: f64,
    /// Square of a distance above which no triangle is [`NEAR`].
    pub near: f64,
    /// The largest absolute coordinate of the mesh and the grid.
    pub magnitude: f64,
    pub arch: Arch,
}

/// Results of a block, C order.
pub(super) struct Output<'a, T> {
    pub distance: &'a mut [T],
    pub closest: &'a mut [u32],
}

/// Frame and sites of one block of side [`BLOCK`].
pub(super) struct Local<'a> {
    /// Its first cell.
    origin: [usize; 3],
    pub sites: &'a [Site],
    pub center: [f64; 3],
    pub radius: f64,
}

impl<T: Real> Task<'_, T> {
    /// Fills the results of a block of side [`BLOCK`].
    pub(super) fn solve(&self, block: &Block, workspace: &mut Workspace, output: &mut Output<T>) {
        output.distance.fill(T::of(self.width));
        output.closest.fill(NO_TRIANGLE);
        let extent = Extent::new(self.grid, block);
        let Some(foot) = self.foot(&extent, &mut workspace.stack) else {
            return;
        };
        self.gather(&extent, foot, workspace);
        let Workspace {
            sites,
            listed,
            large,
            levels,
            measured,
            ..
        } = workspace;
        let local = Local {
            origin: block.start,
            sites,
            center: extent.center,
            radius: extent.radius,
        };
        let lists = Lists {
            sites: listed,
            large,
        };
        self.refine(&local, block, lists, levels, measured, output);
    }

    /// Greatest distance from the center of a box of this radius to the nearest corner of a triangle that is within the
    /// band of some point of the box.
    pub(super) fn reach(&self, radius: f64) -> f64 {
        (self.width * self.width + self.largest_slack()).sqrt() + radius
    }

    /// The largest slack of triangles that are culled by their corners.
    fn largest_slack(&self) -> f64 {
        let h = self.grid.spacing().f64();
        LARGE * h * h
    }

    /// A few units in the last place of the largest coordinate.
    pub(super) fn rounding(&self) -> f64 {
        1e-14 * self.magnitude
    }

    /// The point of the mesh closest to the center of a block; `None` if the block is beyond the band.
    fn foot(&self, extent: &Extent, stack: &mut Stack) -> Option<[f64; 3]> {
        let reach = self.reach(extent.radius);
        let place = vectorized!(
            self.arch,
            self.triangles
                .nearest_to(extent.center, reach * reach, stack)
        )?;
        Some(self.triangles.frame(place).nearest(extent.center))
    }

    /// Lists the sites and large triangles that may be closest to some cell of a block.
    fn gather(&self, extent: &Extent, foot: [f64; 3], workspace: &mut Workspace) {
        let Workspace {
            stack,
            leaves,
            sites,
            listed,
            large,
            ..
        } = workspace;
        let region = Region::new(
            [extent.low, extent.high],
            foot,
            self.reach(extent.radius),
            self.largest_slack(),
            self.rounding(),
        );
        leaves.clear();
        let (bvh, region) = (self.triangles.bvh, &region);
        self.arch.dispatch(kernels::Gather {
            bvh,
            region,
            stack,
            leaves,
        });
        sites.clear();
        large.clear();
        for &leaf in leaves.iter() {
            sites.extend(
                self.sites
                    .of_leaf(leaf)
                    .map(|number| self.site(number, extent.center)),
            );
            if self.sites.any_large() {
                large.extend(bvh.leaf(leaf).filter(|&place| self.sites.is_large(place)));
            }
        }
        listed.clear();
        listed.extend(0..sites.len() as u32);
    }

    #[inline(always)]
    fn site(&self, number: u32, center: [f64; 3]) -> Site {
        let per_cell = 1.0 / self.grid.spacing().f64();
        let slack = self.sites.slack(number) * per_cell * per_cell;
        let v = scale(sub(self.sites.position(number), center), per_cell).map(|x| x as f32);
        let slack = (slack * (1.0 + 2.0 * kernels::MARGIN)) as f32;
        Site {
            position: v,
            slack,
            power: v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - slack,
            number,
        }
    }

    /// Culls the lists of a block for its children, recursively; blocks of side 4 are searched.
    fn refine(
        &self,
        local: &Local,
        block: &Block,
        lists: Lists,
        levels: &mut [ChildCandidates],
        measured: &mut Candidates,
        output: &mut Output<T>,
    ) {
        let Some((kept, deeper)) = levels.split_first_mut() else {
            return self.finish(local, block, lists, measured, output);
        };
        let children = children(self.grid, block);
        self.cull(local, lists, &children, kept);
        for l in 0..CHILDREN {
            let lists = kept.of(l);
            if !lists.is_empty() {
                self.refine(local, &children[l].0, lists, deeper, measured, output);
            }
        }
    }

    /// Searches the lists of a block of side 4.
    fn finish(
        &self,
        local: &Local,
        block: &Block,
        lists: Lists,
        measured: &mut Candidates,
        output: &mut Output<T>,
    ) {
        let per_cell = 1.0 / self.grid.spacing().f64();
        let width = self.width * per_cell;
        let search = BlockCandidates {
            triangles: self.triangles,
            sites: self.sites,
            all: local.sites,
            listed: lists.sites,
            large: lists.large,
            // The longest edge of a small triangle is below 2 √LARGE.
            way: (2.0 * local.radius * per_cell + 2.0 * LARGE.sqrt() + 1.0) as f32,
            per_cell,
            width: (width * width) as f32,
        };
        let cells = Cells::new(self.grid, block);
        let seeds = self.closest_sites(local, lists, &cells.centers_of_children());
        for index in (0..PACKETS).filter(|&index| cells.contain(Cells::packet(index))) {
            let seeds = [seeds[2 * index], seeds[2 * index + 1]];
            let mut found = [NearestTriangles::NOTHING; 2];
            let packet = self.arch.dispatch(kernels::Closest {
                search: &search,
                cells: &cells,
                index,
                origin: local.center,
                seeds,
                measured,
                found: &mut found,
            });
            let first = Cells::packet(index);
            self.write(local, block, &cells, (first, &packet), &found, output);
        }
    }

    /// Writes the result of a packet whose first cell is `first`, from that of the block.
    fn write(
        &self,
        local: &Local,
        block: &Block,
        cells: &Cells,
        (first, packet): ([usize; 3], &Packet),
        found: &[NearestTriangles; 2],
        output: &mut Output<T>,
    ) {
        let at: [usize; 3] = std::array::from_fn(|a| block.start[a] - local.origin[a] + first[a]);
        for lane in 0..CELLS {
            let (half, l) = (lane / LANES, lane % LANES);
            let (place, squared) = (found[half].triangle[l], found[half].squared[l]);
            let [x, y, z] = packet::offset(lane);
            if place == NOWHERE || !cells.contain([first[0] + x, first[1] + y, z]) {
                continue;
            }
            let distance = if squared > self.near {
                squared.sqrt()
            } else {
                self.measure(packet.points[half].map(|x| x[l]), place, squared)
            };
            if distance <= self.width {
                let index = ((at[0] + x) * BLOCK + at[1] + y) * BLOCK + at[2] + z;
                output.distance[index] = T::of(distance);
                // The facet is in the cache; the tree's entry of the face is not.
                output.closest[index] = self.sites.facets()[place as usize].face;
            }
        }
    }

    fn measure(&self, q: [f64; 3], place: u32, squared: f64) -> f64 {
        let edge = NEAR * self.triangles.frame(place).longest_edge();
        if squared >= edge * edge {
            return squared.sqrt();
        }
        let face = self.sites.facets()[place as usize].face;
        triangle::closest_point(q, self.triangles.mesh.corners(face as usize).map(to_f64)).distance
    }
}
