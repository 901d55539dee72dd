//! The inner loops over the triangles of a block, as operations that `pulp::Arch` dispatches: the body of
//! `with_simd` is compiled once for each instruction set.

use pulp::{Simd, WithSimd};

use super::workspace::Lists;
use crate::distance::bvh::{Bvh, Found, LANES, Points, Region, Stack};

/// Relative error of squares that culling allows its single precision for (a dozen times over).
pub(super) const MARGIN: f64 = 2e-5;

/// Boxes handled together: the eight children of a block.
pub(super) const CHILDREN: usize = 8;

/// A vertex as culling sees it, in cells from the centre of the block.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(super) struct Site {
    pub position: [f32; 3],
    /// The largest slack of its triangles (see `Frame`).
    pub slack: f32,
}

/// The children of a block as culling sees them, `[axis][child]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boxes {
    /// Centres.
    pub centre: [[f32; CHILDREN]; 3],
    /// Sides.
    pub side: [[f32; CHILDREN]; 3],
    /// A point of the mesh near each.
    pub foot: [[f32; CHILDREN]; 3],
    /// `|centre − foot|²` and what rounding may have taken.
    pub bound: [f32; CHILDREN],
    /// Squares of the distances from the centres beyond which nothing matters.
    pub reach: [f32; CHILDREN],
}

impl Boxes {
    pub(super) const NOTHING: Self = Self {
        centre: [[0.0; CHILDREN]; 3],
        side: [[0.0; CHILDREN]; 3],
        foot: [[0.0; CHILDREN]; 3],
        bound: [f32::NEG_INFINITY; CHILDREN],
        reach: [f32::INFINITY; CHILDREN],
    };
}

/// For every centre, the listed site closest to it.
pub(super) struct ClosestSites<'a> {
    pub sites: &'a [Site],
    pub list: &'a [u32],
    pub centre: &'a [[f32; CHILDREN]; 3],
}

impl WithSimd for ClosestSites<'_> {
    type Output = [u32; CHILDREN];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [u32; CHILDREN] {
        let mut best = [f32::INFINITY; CHILDREN];
        let mut found = [self.list.first().copied().unwrap_or(0); CHILDREN];
        for &index in self.list {
            let v = self.sites[index as usize].position;
            for l in 0..CHILDREN {
                let d = [
                    v[0] - self.centre[0][l],
                    v[1] - self.centre[1][l],
                    v[2] - self.centre[2][l],
                ];
                let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let closer = squared < best[l];
                best[l] = if closer { squared } else { best[l] };
                found[l] = if closer { index } else { found[l] };
            }
        }
        found
    }
}

/// Appends to the list of every child the sites whose triangles may be closest to one of its points.
pub(super) struct CullSites<'a> {
    pub sites: &'a [Site],
    pub list: &'a [u32],
    pub boxes: &'a Boxes,
    pub lists: &'a mut [Lists; CHILDREN],
}

impl WithSimd for CullSites<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for &index in self.list {
            let mut kept = undominated(&self.sites[index as usize], self.boxes);
            while kept != 0 {
                self.lists[kept.trailing_zeros() as usize].sites.push(index);
                kept &= kept - 1;
            }
        }
    }
}

/// The children for which a site matters, as bits.
///
/// For a point `v`, `|q − foot|² − |q − v|²` is linear in `q`: over the box it is at most
/// `|c − foot|² − |c − v|² + Σ side |v − foot|`. A triangle adds at most its slack.
#[inline(always)]
fn undominated(site: &Site, boxes: &Boxes) -> u32 {
    let v = site.position;
    let mut excess = [0.0f32; CHILDREN];
    for l in 0..CHILDREN {
        let mut squared = 0.0;
        let mut gain = 0.0;
        for a in 0..3 {
            let d = v[a] - boxes.centre[a][l];
            gain += boxes.side[a][l] * (v[a] - boxes.foot[a][l]).abs();
            squared += d * d;
        }
        let closer = gain - squared + site.slack + boxes.bound[l];
        let within = boxes.reach[l] - squared;
        excess[l] = if closer < within { closer } else { within };
    }
    let mut bits = [0; CHILDREN];
    for l in 0..CHILDREN {
        // What is not a number stays.
        bits[l] = if excess[l] < 0.0 { 0 } else { 1 << l };
    }
    bits.into_iter().fold(0, |all, bit| all | bit)
}

/// Appends to the list of a child the large triangles that may be closest to one of its points: those that
/// are closer than the foot to one of the corners of its box.
pub(super) struct CullLarge<'a> {
    pub bvh: &'a Bvh,
    pub list: &'a [u32],
    pub corners: &'a Points,
    /// Squares of the distances from the corners to the foot, and what rounding may have taken.
    pub bound: &'a [f64; LANES],
    pub kept: &'a mut Vec<u32>,
}

impl WithSimd for CullLarge<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for &place in self.list {
            let mut found = Found::NOTHING;
            found.try_triangle(self.bvh.frame(place), place, self.corners);
            if (0..LANES).any(|l| !(found.squared[l] > self.bound[l])) {
                self.kept.push(place);
            }
        }
    }
}

/// The closest of the listed triangles to each point.
pub(super) struct ClosestListed<'a> {
    pub bvh: &'a Bvh,
    pub list: &'a [u32],
    pub points: &'a Points,
}

impl WithSimd for ClosestListed<'_> {
    type Output = Found;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Found {
        let mut found = Found::NOTHING;
        for &place in self.list {
            found.try_triangle(self.bvh.frame(place), place, self.points);
        }
        found
    }
}

/// The closest triangle to each point, of all.
pub(super) struct Closest<'a> {
    pub bvh: &'a Bvh,
    pub points: &'a Points,
    /// Square of the distance beyond which nothing matters.
    pub reach: f64,
    pub stack: &'a mut Stack,
}

impl WithSimd for Closest<'_> {
    type Output = Found;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Found {
        let mut found = Found::within(self.reach);
        self.bvh.nearest(self.points, &mut found, self.stack);
        found
    }
}

/// Appends the leaves that may hold what is closest to a point of the region.
pub(super) struct Gather<'a> {
    pub bvh: &'a Bvh,
    pub region: &'a Region,
    pub stack: &'a mut Stack,
    pub leaves: &'a mut Vec<u32>,
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.bvh.undominated(self.region, self.stack, self.leaves);
    }
}
