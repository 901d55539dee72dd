//! Packets of sixteen cells, searched together.
//!
//! Single precision selects candidates; their distances are computed in double precision.

use pulp::Simd;

use super::block::Cells;
use super::site_list::Site;
use super::sites::Sites;
use super::workspace::Candidates;
use crate::Real;
use crate::distance::bvh::{LANES, NearestTriangles, Points, Triangles};
use crate::simd::multiply_add;

/// Cells of a packet, in halves of [`LANES`].
pub(super) const CELLS: usize = 2 * LANES;

/// Bounds the error of single precision, when multiplied by the way from the center of the block to a cell and
/// on to a triangle.
///
/// In units of 2⁻²⁴: the offset of a cell from a corner has an error of 2, its coordinates in the frame of
/// the triangle by 13, and the parts of the distance by 21; so the square of a distance `d` by `46 d`, and a
/// difference of two by `92 d`. Where a product and a sum are rounded at once, it is less.
const ERROR: f32 = 128.0 / (1u32 << 24) as f32;

/// The centers of the cells of a packet.
pub(super) struct Packet {
    /// In the user's unit, by halves.
    pub points: [Points; 2],
    /// In cells from the center of the block, `[axis][cell]`.
    local: [[f32; CELLS]; 3],
}

impl Packet {
    /// A packet of the cells of a block, in a frame with this origin.
    #[inline(always)]
    pub(super) fn new(cells: &Cells, index: usize, origin: [f64; 3], per_cell: f64) -> Self {
        let first = Cells::packet(index);
        let mut packet = Self {
            points: [[[0.0; LANES]; 3]; 2],
            local: [[0.0; CELLS]; 3],
        };
        for a in 0..3 {
            let local = cells.centers[a].map(|center| ((center - origin[a]) * per_cell) as f32);
            for l in 0..CELLS {
                let step = first[a] + offset(l)[a];
                packet.points[l / LANES][a][l % LANES] = cells.centers[a][step];
                packet.local[a][l] = local[step];
            }
        }
        packet
    }
}

/// Offset of a cell in its packet.
#[inline(always)]
pub(super) fn offset(lane: usize) -> [usize; 3] {
    [
        lane >> 2 & 1,
        lane >> 1 & 1,
        (lane & 1) + 2 * (lane / LANES),
    ]
}

/// Candidate lists and constants that the packets of a block share.
pub(super) struct BlockCandidates<'a, T> {
    pub triangles: &'a Triangles<'a, T>,
    pub sites: &'a Sites,
    /// All sites of the block of side 16.
    pub all: &'a [Site],
    /// Places of the candidates.
    pub listed: &'a [u32],
    /// Large triangles, by their places in the tree.
    pub large: &'a [u32],
    /// In cells, with the distance to a triangle, more than that from the center of the block to a cell and to
    /// any corner of the triangle together.
    pub way: f32,
    pub per_cell: f64,
    /// Square of the width of the band, in cells.
    pub width: f32,
}

impl<T: Real> BlockCandidates<'_, T> {
    /// The closest triangle to each cell.
    #[inline(always)]
    pub(super) fn closest<S: Simd>(
        &self,
        packet: &Packet,
        seeds: [u32; 2],
        measured: &mut Candidates,
        found: &mut [NearestTriangles; 2],
    ) {
        for half in 0..2 {
            self.try_all(self.large, &packet.points[half], &mut found[half]);
        }
        let mut best = self.bounds(found);
        measured.clear(self.triangles.bvh.len());
        if !self.listed.is_empty() {
            self.filter::<S>(packet, seeds, &mut best, measured);
        }
        let limit = self.limits(&best);
        for half in 0..2 {
            measured.choose(half, &limit);
            self.try_all(measured.chosen(), &packet.points[half], &mut found[half]);
        }
    }

    /// Measures triangles in double precision.
    #[inline(always)]
    fn try_all(&self, places: &[u32], points: &Points, found: &mut NearestTriangles) {
        // In registers: in memory, what one triangle stores for some points would hold up the load of the next.
        let mut nearest = *found;
        for &place in places {
            nearest.try_triangle(self.triangles.frame(place), place, points);
        }
        *found = nearest;
    }

    /// In squared cells and single precision.
    #[inline(always)]
    fn bounds(&self, found: &[NearestTriangles; 2]) -> [f32; CELLS] {
        let scale = self.per_cell * self.per_cell;
        let mut best = [self.width; CELLS];
        for l in 0..CELLS {
            let squared = (found[l / LANES].squared[l % LANES] * scale) as f32;
            best[l] = if squared < best[l] { squared } else { best[l] };
        }
        best
    }

    /// Squared distances above which a triangle is not closest.
    #[inline(always)]
    fn limits(&self, best: &[f32; CELLS]) -> [f32; CELLS] {
        let mut limit = *best;
        for l in 0..CELLS {
            let d = best[l].sqrt();
            let way = self.way + d;
            limit[l] += ERROR * way * (d + ERROR * way);
        }
        limit
    }

    /// Measures all small triangles that may be closest to a cell. `seeds` are places of sites near its halves.
    #[inline(always)]
    fn filter<S: Simd>(
        &self,
        packet: &Packet,
        seeds: [u32; 2],
        best: &mut [f32; CELLS],
        measured: &mut Candidates,
    ) {
        for seed in seeds {
            self.collect_star(seed, measured);
        }
        self.measure::<S>(packet, 0, best, measured);
        let first = measured.length;
        self.collect_near::<S>(packet, best, measured);
        self.measure::<S>(packet, first, best, measured);
    }

    /// Lists the small triangles around a site.
    #[inline(always)]
    fn collect_star(&self, place: u32, measured: &mut Candidates) {
        let site = &self.all[place as usize];
        measured.extend(self.sites.star(site.number), site.position);
    }

    /// Lists the small triangles around the sites that matter.
    #[inline(always)]
    fn collect_near<S: Simd>(
        &self,
        packet: &Packet,
        best: &[f32; CELLS],
        measured: &mut Candidates,
    ) {
        let limit = self.limits(best);
        let [x, y, z] = &packet.local;
        // |q − v|² − slack ≤ limit where (|v|² − slack) − 2 q·v ≤ limit − |q|²
        let (mut minus_twice, mut most) = (packet.local, limit);
        for l in 0..CELLS {
            let way = self.way + limit[l].sqrt();
            let radius = limit[l] + ERROR * way * way;
            most[l] = radius - (x[l] * x[l] + y[l] * y[l] + z[l] * z[l]);
            for a in 0..3 {
                minus_twice[a][l] = -2.0 * packet.local[a][l];
            }
        }
        if measured.near.len() < self.listed.len() {
            measured.near.resize(self.listed.len(), 0);
        }
        let (all, kept) = (self.all, &mut measured.near[..self.listed.len()]);
        let mut length = 0;
        for &place in self.listed {
            let site = &all[place as usize];
            let v = site.position;
            let mut near = false;
            for l in 0..CELLS {
                let last = multiply_add::<S>(minus_twice[2][l], v[2], site.power);
                let two = multiply_add::<S>(minus_twice[1][l], v[1], last);
                near |= multiply_add::<S>(minus_twice[0][l], v[0], two) <= most[l];
            }
            // Written in any case, kept if near: a branch would be mispredicted.
            kept[length] = place;
            length += usize::from(near);
        }
        for index in 0..length {
            self.collect_star(measured.near[index], measured);
        }
    }

    /// Measures the triangles listed from `first` on.
    #[inline(always)]
    fn measure<S: Simd>(
        &self,
        packet: &Packet,
        first: usize,
        best: &mut [f32; CELLS],
        measured: &mut Candidates,
    ) {
        let range = first..measured.length;
        let candidates = &measured.candidates[range.clone()];
        let facets = self.sites.facets();
        for (candidate, squared) in candidates.iter().zip(&mut measured.squared[range]) {
            let mut from = packet.local;
            for a in 0..3 {
                for l in 0..CELLS {
                    from[a][l] -= candidate.from[a];
                }
            }
            *squared =
                facets[candidate.place as usize].distances::<S, CELLS>(candidate.corner, &from);
            for l in 0..CELLS {
                best[l] = if squared[l] < best[l] {
                    squared[l]
                } else {
                    best[l]
                };
            }
        }
    }
}
