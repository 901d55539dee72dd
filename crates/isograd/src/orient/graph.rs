//! The neighbor graph and the coupling of the signs of neighbors.
//!
//! # Map
//! [`Axes`] and [`Neighborhoods`] → [`Graph`], on which the [automatic method](super::Method::Auto) spreads its
//! evidence. Formulas of single neighbors are those of [`coupling`] and `sheet`.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

use super::Axes;
pub use super::coupling::NEIGHBORS;
use super::coupling::{self, RING, ROUNDS};
use super::lattice::Lattice;
use super::lines;
use super::sheets::{self, Near, Sheets};
use super::sites::Sites;
use crate::neighbors::Neighborhoods;
use crate::normals::Plane;
use crate::parallel::{self, CHUNK};
use crate::{Real, vector};

/// Neighbors, axes and couplings, all in the order of the [`Sites`]; lengths are in sample spacings
/// ([`Neighborhoods::spacing`]) of the whole cloud, so that single precision serves any unit.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    /// `(N, 16)` sites of the nearest other samples, nearest first; where there are too few, the point
    /// itself.
    pub near: Vec<[u32; NEIGHBORS]>,
    /// `(N, 16, 3)` offset to each of them, in spacings.
    pub offset: Vec<[[f32; 3]; NEIGHBORS]>,
    /// `(N,)` how far the surface patch extends that each sample stands for, in spacings.
    pub reach: Vec<f32>,
    /// `(N, 3)` the normal axis, of unit length; its sign is arbitrary.
    pub axis: Vec<[f32; 3]>,
    /// `(N, 16)` in −1..1: above 0 where the two axes should have the sign they have, relative to each other.
    pub coupling: Vec<[f32; NEIGHBORS]>,
    /// `(N,)` how far the samples of its sheet lie off it, in spacings, where that is known; else 0.
    pub scatter: Vec<f32>,
    /// `(N,)` in 0..1, the share of the neighbors off its sheet that lie over or under it; 0 without a sheet.
    pub interleaved: Vec<f32>,
    /// `(N,)` the area of surface that each sample stands for, in squares of the spacing.
    pub area: Vec<f32>,
    /// `(N,)` how far samples lie off their common plane, where they scatter so much that the axis was sought in a
    /// wider neighborhood: root mean square, in spacings; else 0.
    pub spread: Vec<f32>,
    /// `(N,)` in −1..1: how clearly such a sample lies on the side of that plane that its axis points to; else 0.
    pub side: Vec<f32>,
    /// `(N,)` distance to the last sample of the ring, the sixth, in spacings.
    pub ring: Vec<f32>,
    /// `(N,)` typical distance of the nearest samples from the tangent plane, in spacings.
    pub thickness: Vec<f32>,
    /// `(N,)` cosine between the axis that was given and [`Self::axis`]; not negative.
    pub parallel: Vec<f32>,
    /// `(N,)` in 0..1, how far a sample lies on an open sheet, with air on both sides: there the winding number of the
    /// samples is not that of a body. Set by `expose`, not when the graph is built.
    pub exposed: Vec<f32>,
    pub(super) sheets: Sheets,
    /// Scratch for medians.
    pub(super) values: Vec<f32>,
}

/// A second sheet close to a sample; none where its evidence is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct SecondSheet {
    /// Evidence in −1..1 for the sign of the axis, if the sheet is the other side of a thin body, behind the sample:
    /// positive where the axis points away from it.
    pub evidence: f32,
    /// How far it is, in spacings.
    pub distance: f32,
}

impl Graph {
    /// Builds the graph, reusing its memory. The axes are those of the same points.
    ///
    /// # Panics
    /// There are fewer axes than points.
    pub fn build<T: Real>(
        &mut self,
        axes: &Axes<'_, T>,
        neighborhoods: &Neighborhoods<T>,
        sites: &Sites,
    ) {
        let n = neighborhoods.index.len();
        self.take_axes(axes, neighborhoods, sites);
        parallel::resize(&mut self.near, n, [0; NEIGHBORS]);
        self.find_neighbors(neighborhoods, sites);
        self.find_sheets(Lattice::find(neighborhoods, sites));
        self.measure();
        self.couple();
        self.measure_areas();
        lines::widen(&mut self.reach, neighborhoods, sites);
    }

    /// Frees the offsets and what they were for. [`Self::second_sheet`] and the parts of the graph must have been found.
    pub(super) fn free_offsets(&mut self) {
        self.offset = Vec::new();
        self.sheets = Sheets::default();
    }

    fn take_axes<T: Real>(
        &mut self,
        axes: &Axes<'_, T>,
        neighborhoods: &Neighborhoods<T>,
        sites: &Sites,
    ) {
        let order = sites.order();
        parallel::fill(&mut self.axis, order.len(), |p| {
            let axis = vector::normalized(vector::to_f64(axes.normals[order[p] as usize]));
            axis.unwrap_or([0.0; 3]).map(|a| a as f32)
        });
        let spacing = neighborhoods.spacing().f64();
        let scatter = |site: usize| {
            let i = order[site] as usize;
            let is_wide = axes
                .radius
                .get(i)
                .is_some_and(|&r| r > neighborhoods.radius[i]);
            match axes.planes.get(i) {
                Some(plane) if is_wide => scatter(plane, axes.normals[i], spacing),
                _ => (0.0, 0.0),
            }
        };
        parallel::resize(&mut self.spread, order.len(), 0.0);
        parallel::resize(&mut self.side, order.len(), 0.0);
        let chunks = self.spread.chunks_mut(CHUNK);
        let chunks = chunks.zip(self.side.chunks_mut(CHUNK));
        parallel::each(chunks, |chunk, (spread, side)| {
            for (i, (spread, side)) in spread.iter_mut().zip(side).enumerate() {
                (*spread, *side) = scatter(chunk * CHUNK + i);
            }
        });
    }

    fn find_neighbors<T: Real>(&mut self, neighborhoods: &Neighborhoods<T>, sites: &Sites) {
        let index = &neighborhoods.index;
        let radius = neighborhoods.common_radius;
        index.nearest_of_all(radius, sites.positions(), &mut self.near);
        let unit = 1.0 / neighborhoods.spacing().f64();
        let near = &self.near;
        parallel::fill_large(&mut self.offset, near.len(), &|site| {
            let point = index.point(sites.position(site));
            near[site].map(|near| {
                let d = vector::sub(index.point(near as usize), point);
                d.map(|x| (x.f64() * unit) as f32)
            })
        });
        parallel::for_each(&mut self.near, |_, near| {
            *near = near.map(|near| sites.of(index.order()[near as usize]));
        });
    }

    /// Takes the axis of its own sheet for each point whose neighbors lie on several.
    fn find_sheets(&mut self, lattice: Lattice) {
        let near = Near {
            near: &self.near,
            offset: &self.offset,
        };
        self.sheets.find(near, &self.axis, lattice);
        let sheets = self.sheets.sheets();
        parallel::fill(&mut self.scatter, sheets.len(), |p| sheets[p].scatter);
        let own = |p: usize, given: [f32; 3]| match sheets[p].scatter > 0.0 {
            true => sheets[p].axis,
            false => given,
        };
        let given = &self.axis;
        parallel::fill(&mut self.parallel, sheets.len(), |p| {
            vector::dot(given[p], own(p, given[p]))
        });
        parallel::for_each(&mut self.axis, |p, axis| *axis = own(p, *axis));
        let offset = &self.offset;
        parallel::fill(&mut self.interleaved, sheets.len(), |p| {
            sheets::interleaved(&offset[p], sheets[p])
        });
    }

    /// Reach and thickness of every point.
    fn measure(&mut self) {
        let (offset, axis) = (&self.offset, &self.axis);
        let n = offset.len();
        parallel::fill(&mut self.ring, n, |p| vector::norm(offset[p][RING - 1]));
        parallel::fill(&mut self.thickness, n, |p| {
            let mut height = [0.0; NEIGHBORS / 2];
            for (height, &d) in height.iter_mut().zip(&offset[p]) {
                *height = vector::dot(d, axis[p]).abs();
            }
            median(&mut height)
        });
        let (ring, near) = (&self.ring, &self.near);
        parallel::fill(&mut self.reach, n, |p| {
            let mut around = [0.0; RING];
            for (around, &q) in around.iter_mut().zip(&near[p]) {
                *around = ring[q as usize];
            }
            coupling::reach(ring[p], median(&mut around))
        });
    }

    fn couple(&mut self) {
        let mut coupling = std::mem::take(&mut self.coupling);
        let this = &*self;
        parallel::fill(&mut coupling, this.near.len(), |p| {
            std::array::from_fn(|slot| match this.near[p][slot] as usize {
                q if q == p => 0.0,
                q => this.tie(p, q, slot),
            })
        });
        self.coupling = coupling;
    }

    fn tie(&self, p: usize, q: usize, slot: usize) -> f32 {
        let (a, b, d) = (self.axis[p], self.axis[q], self.offset[p][slot]);
        let gap = self.least_gap(p, q);
        let spreads = self.spread[p] * self.spread[q];
        let thicknesses = self.thickness[p] * self.thickness[q];
        let blur = coupling::blur(self.reach[p], spreads, thicknesses, gap);
        let heights = vector::dot(a, d) * vector::dot(b, d);
        let square = vector::norm_squared(d) + blur;
        let interleaved = 0.5 * (self.interleaved[p] + self.interleaved[q]);
        let parallel = vector::dot(a, b);
        coupling::trusted(coupling::coupled(
            parallel,
            heights,
            square,
            gap,
            interleaved,
        ))
    }

    /// In layers with air on both sides, as far as they are that (`slab`, `(N,)` in 0..1), two samples hang together
    /// by their positions: on one side of the middle, or on both.
    ///
    /// # Panics
    /// There are fewer slabs than points.
    pub fn part_slabs(&mut self, slab: &[f32]) {
        let (near, axis, side) = (&self.near, &self.axis, &self.side);
        parallel::for_each(&mut self.coupling, |p, coupling| {
            for (coupling, &q) in coupling.iter_mut().zip(&near[p]) {
                let q = q as usize;
                let both = slab[p].min(slab[q]);
                if both > 0.0 && side[p] != 0.0 && side[q] != 0.0 {
                    let parallel = vector::dot(axis[p], axis[q]);
                    *coupling = coupling::parted(*coupling, both, parallel, side[p], side[q]);
                }
            }
        });
    }

    /// Sets how far each sample is [exposed](Self::exposed); a sample of a layer that scatters is not, since light leaks
    /// through such a layer.
    pub(super) fn expose(&mut self, exposed: impl Fn(usize) -> f32 + Sync) {
        let spread = &self.spread;
        parallel::fill(&mut self.exposed, spread.len(), |p| match spread[p] > 0.0 {
            true => 0.0,
            false => exposed(p),
        });
    }

    fn least_gap(&self, p: usize, q: usize) -> f32 {
        coupling::least_gap(self.scatter[p], self.scatter[q])
    }

    /// Whether the axis of a site comes from a wider neighborhood because samples scatter, and not because they lie on several
    /// sheets.
    ///
    /// # Panics
    /// There is no such point.
    pub fn scatters(&self, p: usize) -> bool {
        self.spread[p] > 0.0 && self.scatter[p] == 0.0
    }

    fn measure_areas(&mut self) {
        let mut areas = std::mem::take(&mut self.area);
        parallel::fill(&mut areas, self.near.len(), |p| {
            let scatters = self.scatters(p);
            let shares = match scatters {
                true => coupling::on_same_sheet,
                false => coupling::on_same_surface,
            };
            let ties = self.near[p].iter().zip(&self.coupling[p]);
            let same = ties.filter(|&(&q, &tie)| {
                shares(tie, vector::dot(self.axis[p], self.axis[q as usize]))
            });
            let (same, reach) = (same.count() as f32, self.reach[p]);
            if scatters {
                return coupling::scattered_area(reach, same);
            }
            let bound = match self.ring[p] {
                0.0 => 1.0,
                ring => reach / ring,
            };
            let farthest = vector::norm(self.offset[p][NEIGHBORS - 1]);
            coupling::area(bound * farthest, same)
        });
        self.area = areas;
        let areas = &self.area;
        parallel::fill(&mut self.values, areas.len(), |p| areas[p]);
        if !self.values.is_empty() {
            let median = median(&mut self.values);
            let areas = self.area.iter_mut();
            areas.for_each(|area| *area = coupling::bounded_area(*area, median));
        }
    }

    /// The second sheet close to a site: the samples of the other side of a thin body, or of a narrow gap.
    ///
    /// # Panics
    /// There is no such point.
    pub fn second_sheet(&self, p: usize) -> SecondSheet {
        let (mut signed, mut total, mut heights) = (0.0, 0.0, 0.0);
        for (slot, &d) in self.offset[p].iter().enumerate() {
            let square = vector::norm_squared(d);
            if square > 0.0 {
                let q = self.near[p][slot] as usize;
                let parallel = vector::dot(self.axis[p], self.axis[q]);
                let height = vector::dot(d, self.axis[p]);
                let across = coupling::across(height, square, parallel, self.least_gap(p, q));
                signed += across;
                total += across.abs();
                heights += across * height;
            }
        }
        SecondSheet {
            evidence: coupling::sheet_evidence(signed, total),
            distance: if total > 0.0 { heights / total } else { 0.0 },
        }
    }

    /// Propagates some kinds of evidence `(N, K)`, in −1..1, each by itself: repeated means of the beliefs of the neighbors
    /// of a point, weighted by coupling, and its own evidence, weighted by its magnitude. `next` is scratch.
    ///
    /// # Panics
    /// There is evidence of fewer or of more than the points of the graph.
    pub fn relax<const K: usize>(
        &self,
        evidence: &[[f32; K]],
        belief: &mut Vec<[f32; K]>,
        next: &mut Vec<[f32; K]>,
    ) {
        assert_eq!(evidence.len(), self.coupling.len());
        let mut weights = vec![[0.0; K]; evidence.len()];
        parallel::for_each(&mut weights, |p, weights| {
            *weights = weight(&evidence[p], &self.coupling[p]);
        });
        parallel::resize(belief, evidence.len(), [0.0; K]);
        parallel::for_each(belief, |p, belief| *belief = evidence[p]);
        parallel::resize(next, belief.len(), [0.0; K]);
        for _ in 0..ROUNDS {
            let before = &*belief;
            parallel::for_each(next, |p, next| {
                let sum = spread(&evidence[p], &self.coupling[p], &self.near[p], before);
                *next = std::array::from_fn(|e| coupling::belief(sum[e], weights[p][e]));
            });
            std::mem::swap(belief, next);
        }
    }
}

/// The weights of the own evidence and of all neighbors, in the order in which [`spread`] adds what they weight.
fn weight<const K: usize>(own: &[f32; K], coupling: &[f32; NEIGHBORS]) -> [f32; K] {
    own.map(|own| coupling.iter().fold(own.abs(), |sum, tie| sum + tie.abs()))
}

#[inline(always)]
fn spread<const K: usize>(
    own: &[f32; K],
    coupling: &[f32; NEIGHBORS],
    near: &[u32; NEIGHBORS],
    belief: &[[f32; K]],
) -> [f32; K] {
    let mut sum = own.map(coupling::held);
    for (&tie, &q) in coupling.iter().zip(near) {
        let other = &belief[q as usize];
        for (sum, other) in sum.iter_mut().zip(other) {
            *sum += tie * other;
        }
    }
    sum
}

/// Spread of the samples about the plane around one of them, in spacings, and the side of it on which that one lies.
fn scatter<T: Real>(plane: &Plane<T>, axis: [T; 3], spacing: f64) -> (f32, f32) {
    let spread = plane.eigenvalues[0].f64().sqrt();
    let height = -vector::dot(plane.centroid, axis).f64();
    match spread > 0.0 {
        true => (
            (spread / spacing) as f32,
            coupling::side((height / spread) as f32),
        ),
        false => (0.0, 0.0),
    }
}

/// The upper median.
fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Sampled, join, neighborhoods, plate, sphere};
    use super::*;
    use crate::normals;

    /// The sum of the areas of all samples.
    fn area((points, _): &Sampled) -> f64 {
        let near = neighborhoods(points);
        let (mut axes, mut sites) = (normals::Residual::default(), Sites::default());
        normals::forward(&near, &mut axes);
        sites.find(&near);
        let mut graph = Graph::default();
        graph.build(&Axes::from(&axes), &near, &sites);
        let sum: f64 = graph.area.iter().map(|&a| f64::from(a)).sum();
        sum * near.spacing().powi(2)
    }

    #[test]
    fn areas_of_samples_add_up_whether_sheets_are_close_or_not() {
        let ball = sphere(5000, [0.0; 3], 20.0, 3);
        let ball = (ball, 4.0 * std::f64::consts::PI * 400.0);
        let plate = |thickness, height, seed| plate([40.0, thickness], height, seed);
        let [a, b] = [plate(2.0, 0.0, 5), plate(2.0, 2.9, 7)];
        let stack = (join(a.0, b.0), a.1 + b.1);
        let all = [ball, plate(20.0, 0.0, 3), plate(1.5, 0.0, 3), stack];
        for (k, (sampled, expected)) in all.iter().enumerate() {
            let ratio = area(sampled) / expected;
            assert!((0.95..1.05).contains(&ratio), "{k}: {ratio}");
        }
    }
}
