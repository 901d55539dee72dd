//! The inner loops over the triangles of a block, as operations that `pulp::Arch` dispatches: the body of
//! `with_simd` is compiled once for each instruction set.

use pulp::{Simd, WithSimd};

use super::block::Cells;
use super::packet::{Packet, Search};
use super::workspace::Measured;
use crate::distance::bvh::{Bvh, Found, LANES, Points, Region, Stack};

/// Relative error of squares that culling allows its single precision for (a dozen times over).
pub(super) const MARGIN: f64 = 2e-5;

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

/// What is closest to the cells of a packet, whose number in its block is `index`.
pub(super) struct Closest<'a> {
    pub search: &'a Search<'a>,
    pub cells: &'a Cells,
    pub index: usize,
    /// Origin of the packet's frame.
    pub origin: [f64; 3],
    /// Places of sites near its halves.
    pub seeds: [u32; 2],
    pub measured: &'a mut Measured,
    pub found: &'a mut [Found; 2],
}

impl WithSimd for Closest<'_> {
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
