//! Distances in one block of cells.
//!
//! A block is halved along every axis down to 2×2×2 cells, and with it the list of what may be closest: each
//! child keeps what is not farther than one point of the mesh, its *foot*, from the whole of the child. The
//! last list is short, and every one of its triangles is measured from the eight cells at once.

use pulp::Arch;

use super::NO_TRIANGLE;
use super::block::{BLOCK, Block, Children, Extent, centres, children, closest_of};
use super::kernels::{self, CHILDREN, Site};
use super::sites::{LARGE, Sites};
use super::workspace::{Lists, Measured, Workspace};
use crate::distance::bvh::{Bvh, LANES, NOWHERE, Points, Region, Stack};
use crate::distance::triangle;
use crate::vector::{norm_squared, scale, sub, to_f64};
use crate::{Grid, Mesh, Real};

/// Where a distance is below this share of a triangle's longest edge, it is measured from the nearest corner.
const NEAR: f64 = 0.1;

/// What is the same for all blocks.
pub(super) struct Task<'a, T> {
    pub grid: &'a Grid<T>,
    pub mesh: &'a Mesh<T>,
    pub bvh: &'a Bvh,
    pub sites: &'a Sites,
    /// Width of the band, in the user's unit.
    pub width: f64,
    /// The largest absolute coordinate of the mesh and the grid.
    pub magnitude: f64,
    pub arch: Arch,
}

/// Results of a block, C order.
pub(super) struct Output<'a, T> {
    pub distance: &'a mut [T],
    pub closest: &'a mut [u32],
}

/// What is the same for one block of side [`BLOCK`].
pub(super) struct Local<'a> {
    /// Its first cell.
    origin: [usize; 3],
    pub sites: &'a [Site],
    /// The number of each of the sites.
    pub numbers: &'a [u32],
    pub centre: [f64; 3],
    pub radius: f64,
}

impl<T: Real> Task<'_, T> {
    /// Fills the results of a block of side [`BLOCK`].
    pub(super) fn solve(&self, block: &Block, workspace: &mut Workspace, output: &mut Output<T>) {
        output.distance.fill(T::of(self.width));
        output.closest.fill(NO_TRIANGLE);
        let extent = Extent::new(self.grid, block);
        let near = self.nearest_to_children(block, &extent, &mut workspace.stack);
        let feet = near.map(|place| match place {
            NOWHERE => None,
            _ => Some(self.bvh.frame(place).nearest(extent.centre)),
        });
        let Some(foot) = closest_of(feet, extent.centre) else {
            return;
        };
        self.gather(&extent, foot, workspace);
        let Workspace {
            sites,
            numbers,
            top,
            levels,
            measured,
            ..
        } = workspace;
        let local = Local {
            origin: block.start,
            sites,
            numbers,
            centre: extent.centre,
            radius: extent.radius,
        };
        self.refine(&local, block, top, levels, measured, output);
    }

    /// How far from the centre of a box of this radius the corner of a triangle may be that lies within the
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

    /// The triangle closest to the centre of each child.
    fn nearest_to_children(
        &self,
        block: &Block,
        extent: &Extent,
        stack: &mut Stack,
    ) -> [u32; LANES] {
        let points = centres(&children(self.grid, block), extent.centre);
        let reach = self.reach(extent.radius);
        let (bvh, points, reach) = (self.bvh, &points, reach * reach);
        self.arch
            .dispatch(kernels::Closest {
                bvh,
                points,
                reach,
                stack,
            })
            .triangle
    }

    /// Lists what may be closest to some cell of a block.
    fn gather(&self, extent: &Extent, foot: [f64; 3], workspace: &mut Workspace) {
        let Workspace {
            stack,
            leaves,
            sites,
            numbers,
            top,
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
        let (bvh, region) = (self.bvh, &region);
        self.arch.dispatch(kernels::Gather {
            bvh,
            region,
            stack,
            leaves,
        });
        sites.clear();
        numbers.clear();
        top.clear();
        let per_cell = 1.0 / self.grid.spacing().f64();
        for &leaf in leaves.iter() {
            numbers.extend(self.sites.of_leaf(leaf));
            sites.extend(
                self.sites
                    .of_leaf(leaf)
                    .map(|n| self.site(n, extent.centre, per_cell)),
            );
            if self.sites.any_large() {
                top.large
                    .extend(bvh.leaf(leaf).filter(|&place| self.sites.is_large(place)));
            }
        }
        top.sites.extend(0..sites.len() as u32);
    }

    #[inline(always)]
    fn site(&self, number: u32, centre: [f64; 3], per_cell: f64) -> Site {
        let slack = self.sites.slack(number) * per_cell * per_cell;
        Site {
            position: scale(sub(self.sites.position(number), centre), per_cell).map(|x| x as f32),
            slack: (slack * (1.0 + 2.0 * kernels::MARGIN)) as f32,
        }
    }

    /// Hands the lists of a block down to its children, or measures where there are none.
    fn refine(
        &self,
        local: &Local,
        block: &Block,
        lists: &Lists,
        levels: &mut [[Lists; CHILDREN]],
        measured: &mut Measured,
        output: &mut Output<T>,
    ) {
        let Some((kept, deeper)) = levels.split_first_mut() else {
            return self.finish(local, block, lists, measured, output);
        };
        let children = children(self.grid, block);
        let feet = self.feet(local, lists, &children);
        self.cull(local, lists, &children, &feet, kept);
        for l in 0..CHILDREN {
            if !kept[l].is_empty() {
                self.refine(local, &children[l].0, &kept[l], deeper, measured, output);
            }
        }
    }

    /// A point of the mesh close to the centre of each child, where the lists hold one.
    fn feet(
        &self,
        local: &Local,
        lists: &Lists,
        children: &Children,
    ) -> [Option<[f64; 3]>; CHILDREN] {
        let centres = centres(children, local.centre);
        let site = (!lists.sites.is_empty()).then(|| {
            self.arch.dispatch(kernels::ClosestSites {
                sites: local.sites,
                list: &lists.sites,
                centre: &self.in_cells(&centres, local.centre),
            })
        });
        let large = (!lists.large.is_empty()).then(|| {
            self.arch.dispatch(kernels::ClosestListed {
                bvh: self.bvh,
                list: &lists.large,
                points: &centres,
            })
        });
        std::array::from_fn(|l| {
            let centre = children[l].1?.centre;
            let on_site = site.map(|site| {
                let place = self.closest_in_star(local.numbers[site[l] as usize], centre);
                self.bvh.frame(place).nearest(centre)
            });
            let on_large = large.map(|found| self.bvh.frame(found.triangle[l]).nearest(centre));
            closest_of([on_site, on_large], centre)
        })
    }

    /// The small triangle round a site whose centroid is closest to `q`.
    fn closest_in_star(&self, site: u32, q: [f64; 3]) -> u32 {
        let mut best = (f64::INFINITY, NOWHERE);
        for &place in self.sites.star(site) {
            let squared = norm_squared(sub(self.bvh.frame(place).centroid(), q));
            if squared < best.0 {
                best = (squared, place);
            }
        }
        best.1
    }

    /// Measures what is left in the list of a block of side 2.
    fn finish(
        &self,
        local: &Local,
        block: &Block,
        lists: &Lists,
        measured: &mut Measured,
        output: &mut Output<T>,
    ) {
        let stars = lists
            .sites
            .iter()
            .map(|&site| self.sites.star(local.numbers[site as usize]));
        measured.collect(&lists.large, stars, self.bvh.len());
        let mut points: Points = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let c = self.grid.center_f64(block.cell(l));
            for a in 0..3 {
                points[a][l] = c[a];
            }
        }
        let found = self.arch.dispatch(kernels::ClosestListed {
            bvh: self.bvh,
            list: &measured.list,
            points: &points,
        });
        for l in 0..LANES {
            let cell = block.cell(l);
            let at: [usize; 3] = std::array::from_fn(|a| cell[a] - local.origin[a]);
            let index = (at[0] * BLOCK + at[1]) * BLOCK + at[2];
            let q = [points[0][l], points[1][l], points[2][l]];
            let distance = self.measure(q, found.triangle[l], found.squared[l]);
            if distance <= self.width {
                output.distance[index] = T::of(distance);
                output.closest[index] = self.bvh.face(found.triangle[l]);
            }
        }
    }

    fn measure(&self, q: [f64; 3], place: u32, squared: f64) -> f64 {
        let edge = NEAR * self.bvh.frame(place).longest_edge();
        if squared >= edge * edge {
            return squared.sqrt();
        }
        let face = self.bvh.face(place);
        triangle::closest_point(q, self.mesh.corners(face as usize).map(to_f64)).distance
    }
}
