//! The inner loops over the triangles of a block, as operations that `pulp::Arch` dispatches: the body of
//! `with_simd` is compiled once for each instruction set.

use pulp::{Simd, WithSimd};

use super::block::Cells;
use super::packet::{BlockCandidates, Packet};
use super::workspace::Candidates;
use crate::Real;
use crate::distance::bvh::{Bvh, LANES, NearestTriangles, Points, Region, Stack, Triangles};

/// Margin of culling for the relative error of squares in single precision, a dozen times that error.
pub(super) const MARGIN: f64 = 2e-5;

/// Appends to the list of a child the large triangles that may be closest to one of its points: those closer than
/// the foot to a corner of its box.
pub(super) struct CullLarge<'a, T> {
    pub triangles: &'a Triangles<'a, T>,
    pub list: &'a [u32],
    pub corners: &'a Points,
    /// Squared distances from the corners to the foot, plus a bound of rounding.
    pub bound: &'a [f64; LANES],
    pub kept: &'a mut Vec<u32>,
}

impl<T: Real> WithSimd for CullLarge<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for &place in self.list {
            let mut found = NearestTriangles::NOTHING;
            found.try_triangle(self.triangles.frame(place), place, self.corners);
            if (0..LANES).any(|l| !(found.squared[l] > self.bound[l])) {
                self.kept.push(place);
            }
        }
    }
}

/// The closest of the listed triangles to each point.
pub(super) struct ClosestListed<'a, T> {
    pub triangles: &'a Triangles<'a, T>,
    pub list: &'a [u32],
    pub points: &'a Points,
}

impl<T: Real> WithSimd for ClosestListed<'_, T> {
    type Output = NearestTriangles;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> NearestTriangles {
        let mut found = NearestTriangles::NOTHING;
        for &place in self.list {
            found.try_triangle(self.triangles.frame(place), place, self.points);
        }
        found
    }
}

/// Appends the leaves that may contain the closest triangle of a point of the region.
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

/// Finds the closest triangles of the cells of packet `index` of a block.
pub(super) struct Closest<'a, T> {
    pub search: &'a BlockCandidates<'a, T>,
    pub cells: &'a Cells,
    pub index: usize,
    /// Origin of the packet's frame.
    pub origin: [f64; 3],
    /// Places of sites near its halves.
    pub seeds: [u32; 2],
    pub measured: &'a mut Candidates,
    pub found: &'a mut [NearestTriangles; 2],
}

impl<T: Real> WithSimd for Closest<'_, T> {
    type Output = Packet;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Packet {
        let packet = Packet::new(self.cells, self.index, self.origin, self.search.per_cell);
        let (measured, found) = (self.measured, self.found);
        self.search
            .closest::<S>(&packet, self.seeds, measured, found);
        packet
    }
}
