//! The neighbour graph: who is next to whom, and how the signs of two neighbours hang together.

use std::f32::consts::PI;

use rayon::prelude::*;

use super::{Axes, sheet};
use crate::neighbors::Neighborhoods;
use crate::normals::Plane;
use crate::parallel::CHUNK;
use crate::{Real, vector};

/// Neighbours of a point in the graph.
pub(super) const NEIGHBORS: usize = 16;

/// The reach of a sample is its distance to this neighbour: the first ring round it.
const RING: usize = 6;

/// A sample reaches at most this many times as far as its neighbours do at the median: an outlier
/// stands for no more surface than the samples that are nearest to it.
const REACH_GROWTH: f32 = 1.5;

/// Offsets shorter than this share of the reach have no direction to speak of.
const BLUNT: f32 = 0.22;

/// A sample lies off a sheet from this many times as far as the samples of the sheet scatter.
const APART: f32 = 3.0;

/// A neighbour of a coupling above this along the same direction lies on the same sheet; and the least share
/// of the neighbours that do.
const SAME_SHEET: f32 = 0.1;
const LEAST_SHARE: f32 = 1.0 / 3.0;

/// What the product of the spreads of two samples adds to the blur of their reflection.
const NOISE: f32 = 4.0;

/// How soon it is clear on which side of a plane a sample lies, by its height in spreads.
const SIDE: f32 = 2.0;

/// Couplings are raised to this odd power: a half-hearted one, as between a sample of one sheet and one
/// slantwise across on the other, is mostly wrong, and must not count for half.
const TRUST: i32 = 5;

/// Neighbours, axes and couplings, all in the sorted order of the neighbour index; lengths are in
/// sample spacings of the whole cloud, so that single precision serves any unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    /// The nearest other samples, nearest first; where there are too few, the point itself.
    pub near: Vec<[u32; NEIGHBORS]>,
    /// Offset to each of them.
    pub offset: Vec<[[f32; 3]; NEIGHBORS]>,
    /// How far the surface patch extends that this sample stands for.
    pub reach: Vec<f32>,
    /// The normal axis; its sign is arbitrary.
    pub axis: Vec<[f32; 3]>,
    /// In −1..1: above 0 where the two axes should have the sign they have, relative to each other.
    pub coupling: Vec<[f32; NEIGHBORS]>,
    /// How far the samples of its sheet lie off it, where that is known; else 0.
    pub scatter: Vec<f32>,
    /// The area of surface that this sample stands for.
    pub area: Vec<f32>,
    /// How far samples lie off their common plane, where they scatter so much that the axis was sought in a
    /// wider neighbourhood: root mean square; else 0.
    pub spread: Vec<f32>,
    /// In −1..1: how clearly such a sample lies on the side of that plane that its axis points to; else 0.
    pub side: Vec<f32>,
    /// Scratch: distance to the last sample of the ring.
    ring: Vec<f32>,
    /// Scratch: typical distance of the nearest samples from the tangent plane.
    thickness: Vec<f32>,
}

impl Graph {
    pub(super) fn build<T: Real>(&mut self, axes: &Axes<'_, T>, neighborhoods: &Neighborhoods<T>) {
        let n = neighborhoods.index.len();
        self.take_axes(axes, neighborhoods);
        self.near.resize(n, [0; NEIGHBORS]);
        self.offset.resize(n, [[0.0; 3]; NEIGHBORS]);
        self.coupling.resize(n, [0.0; NEIGHBORS]);
        for lengths in [
            &mut self.area,
            &mut self.reach,
            &mut self.ring,
            &mut self.thickness,
        ] {
            lengths.resize(n, 0.0);
        }
        self.find_neighbors(neighborhoods);
        self.find_sheets();
        self.measure();
        self.couple();
        self.measure_areas();
    }

    fn take_axes<T: Real>(&mut self, axes: &Axes<'_, T>, neighborhoods: &Neighborhoods<T>) {
        let order = neighborhoods.index.order();
        self.axis.clear();
        self.axis.extend(order.iter().map(|&i| {
            let axis = vector::normalized(vector::to_f64(axes.normals[i as usize]));
            axis.unwrap_or([0.0; 3]).map(|a| a as f32)
        }));
        let spacing = neighborhoods.spacing().f64();
        let scatter = |&i: &u32| {
            let i = i as usize;
            let is_wide = axes
                .radius
                .get(i)
                .is_some_and(|&r| r > neighborhoods.radius[i]);
            match axes.planes.get(i) {
                Some(plane) if is_wide => scatter(plane, axes.normals[i], spacing),
                _ => (0.0, 0.0),
            }
        };
        self.spread.clear();
        self.side.clear();
        for (spread, side) in order.iter().map(scatter) {
            self.spread.push(spread);
            self.side.push(side);
        }
    }

    fn find_neighbors<T: Real>(&mut self, neighborhoods: &Neighborhoods<T>) {
        let (index, position) = (&neighborhoods.index, neighborhoods.position());
        let unit = 1.0 / neighborhoods.spacing().f64();
        let near = self.near.par_chunks_mut(CHUNK);
        let offset = self.offset.par_chunks_mut(CHUNK);
        near.zip(offset)
            .enumerate()
            .for_each_init(Vec::new, |nearest, (chunk, (near, offset))| {
                for (k, (near, offset)) in near.iter_mut().zip(offset).enumerate() {
                    let own = chunk * CHUNK + k;
                    let point = index.point(own);
                    index.nearest(point, NEIGHBORS + 1, nearest);
                    *near = [own as u32; NEIGHBORS];
                    *offset = [[0.0; 3]; NEIGHBORS];
                    let others = nearest.iter().map(|&(i, _)| position[i as usize]);
                    for (slot, other) in others
                        .filter(|&q| q as usize != own)
                        .take(NEIGHBORS)
                        .enumerate()
                    {
                        near[slot] = other;
                        let d = vector::sub(index.point(other as usize), point);
                        offset[slot] = d.map(|x| (x.f64() * unit) as f32);
                    }
                }
            });
    }

    /// Takes the axis of its own sheet for each point whose neighbours lie on several.
    fn find_sheets(&mut self) {
        self.scatter.resize(self.offset.len(), 0.0);
        let points = self.axis.par_iter_mut().zip(&mut self.scatter);
        points
            .zip(&self.offset)
            .for_each(|((axis, scatter), offset)| {
                *scatter = 0.0;
                if let Some(found) = sheet::find(offset, *axis) {
                    *axis = found.axis;
                    *scatter = found.scatter;
                }
            });
    }

    /// Reach and thickness of every point.
    fn measure(&mut self) {
        let (offset, axis) = (&self.offset, &self.axis);
        self.ring.par_iter_mut().enumerate().for_each(|(p, ring)| {
            *ring = vector::norm(offset[p][RING - 1]);
        });
        self.thickness
            .par_iter_mut()
            .enumerate()
            .for_each(|(p, thickness)| {
                let mut height = [0.0; NEIGHBORS / 2];
                for (height, &d) in height.iter_mut().zip(&offset[p]) {
                    *height = vector::dot(d, axis[p]).abs();
                }
                *thickness = median(&mut height);
            });
        let (ring, near) = (&self.ring, &self.near);
        self.reach
            .par_iter_mut()
            .enumerate()
            .for_each(|(p, reach)| {
                let mut around = [0.0; RING];
                for (around, &q) in around.iter_mut().zip(&near[p]) {
                    *around = ring[q as usize];
                }
                *reach = ring[p].min(REACH_GROWTH * median(&mut around));
            });
    }

    fn couple(&mut self) {
        let mut coupling = std::mem::take(&mut self.coupling);
        let this = &*self;
        coupling
            .par_iter_mut()
            .enumerate()
            .for_each(|(p, coupling)| {
                for (slot, coupling) in coupling.iter_mut().enumerate() {
                    let q = this.near[p][slot] as usize;
                    *coupling = if q == p { 0.0 } else { this.tie(p, q, slot) };
                }
            });
        self.coupling = coupling;
    }

    fn tie(&self, p: usize, q: usize, slot: usize) -> f32 {
        let blunt = (BLUNT * self.reach[p]).powi(2);
        let gap = self.least_gap(p, q);
        // Where sheets are told apart, it is not noise.
        let noise = match gap.is_finite() {
            true => 0.0,
            false => NOISE * self.spread[p] * self.spread[q],
        };
        let blur = blunt + noise.max(self.thickness[p] * self.thickness[q]);
        coupled(self.axis[p], self.axis[q], self.offset[p][slot], blur, gap).powi(TRUST)
    }

    /// In layers with air on both sides, as far as they are that (`slab`, in 0..1), two samples hang together as
    /// they lie: on one side of the middle, or on both.
    pub(super) fn part_slabs(&mut self, slab: &[f32]) {
        let (near, axis, side) = (&self.near, &self.axis, &self.side);
        let all = self.coupling.par_iter_mut().enumerate();
        all.for_each(|(p, coupling)| {
            for (coupling, &q) in coupling.iter_mut().zip(&near[p]) {
                let q = q as usize;
                let both = slab[p].min(slab[q]);
                if both > 0.0 && side[p] != 0.0 && side[q] != 0.0 {
                    let tie = vector::dot(axis[p], axis[q]) * side[p] * side[q];
                    *coupling += both * (tie.powi(TRUST) - *coupling);
                }
            }
        });
    }

    /// The square of the height from which on one of two samples lies off the sheet of the other; infinite
    /// where a sheet is not known.
    fn least_gap(&self, p: usize, q: usize) -> f32 {
        let (a, b) = (self.scatter[p], self.scatter[q]);
        if a > 0.0 && b > 0.0 {
            (APART * a.max(b)).powi(2)
        } else {
            f32::INFINITY
        }
    }

    /// The area of surface that each sample stands for, in squares of the sample spacing.
    fn measure_areas(&mut self) {
        let (near, coupling, axis, reach) = (&self.near, &self.coupling, &self.axis, &self.reach);
        self.area.par_iter_mut().enumerate().for_each(|(p, area)| {
            // Neighbours on another sheet take nothing away from this one.
            let parallel = |&(slot, &q): &(usize, &u32)| {
                coupling[p][slot] * vector::dot(axis[p], axis[q as usize]) > SAME_SHEET
            };
            let own = 1 + near[p].iter().enumerate().filter(parallel).count();
            let share = (own as f32 / (NEIGHBORS + 1) as f32).max(LEAST_SHARE);
            *area = PI * reach[p] * reach[p] / ((RING as f32 + 0.5) * share);
        });
    }

    /// Evidence for the sign of each axis from a second sheet close by: the samples of the other side of
    /// a thin body lie behind this one. Positive where the axis points away from them.
    pub(super) fn sheet_evidence(&self, p: usize) -> f32 {
        let (mut signed, mut total) = (0.0, 0.0);
        for (slot, &d) in self.offset[p].iter().enumerate() {
            let square = vector::norm_squared(d);
            if square > 0.0 {
                let q = self.near[p][slot] as usize;
                let parallel = vector::dot(self.axis[p], self.axis[q]).powi(4);
                let height = vector::dot(d, self.axis[p]);
                let gap = self.least_gap(p, q);
                let off = if gap.is_finite() {
                    height * height / (height * height + gap)
                } else {
                    (height.abs() / square.sqrt()).powi(3)
                };
                let across = off.copysign(height) * parallel;
                signed += across;
                total += across.abs();
            }
        }
        if total > 0.0 {
            -signed * signed.abs() / (total * NEIGHBORS as f32)
        } else {
            0.0
        }
    }
}

/// Spread of the samples about the plane round one of them, in spacings, and the side of it on which that one lies.
fn scatter<T: Real>(plane: &Plane<T>, axis: [T; 3], spacing: f64) -> (f32, f32) {
    let spread = plane.eigenvalues[0].f64().sqrt();
    let height = -vector::dot(plane.centroid, axis).f64();
    match spread > 0.0 {
        true => (
            (spread / spacing) as f32,
            (SIDE * (height / spread) as f32).tanh(),
        ),
        false => (0.0, 0.0),
    }
}

/// How the signs of two neighbouring axes `a` and `b` hang together, `d` apart: `a` is reflected at the
/// plane half-way between the two samples and compared with `b`. Along a sheet that is `a·b`; round an
/// edge it turns with the surface; and two sheets that face each other, whether matter or air is
/// between them, have opposite outward normals. `blur` (a squared length) takes the reflection back
/// where `d` is too short to tell. Two parallel sheets much closer to each other than their samples are
/// face each other although `d` runs along them: there the reflection is full from the height whose square
/// is `gap` on.
///
/// Source: the reflected transfer of H. Xie, K. McDonnell, H. Qin, "Surface reconstruction of noisy
/// and defective data sets" (2004).
#[inline(always)]
fn coupled(a: [f32; 3], b: [f32; 3], d: [f32; 3], blur: f32, gap: f32) -> f32 {
    let parallel = vector::dot(a, b);
    let heights = vector::dot(a, d) * vector::dot(b, d);
    let mut square = vector::norm_squared(d) + blur;
    if gap < square && heights * parallel > 0.0 {
        let share = parallel.powi(8);
        square = square.min(share * (heights.abs() + gap) + (1.0 - share) * square);
    }
    let turned = if square > 0.0 {
        2.0 * heights / square
    } else {
        0.0
    };
    (parallel - turned).clamp(-1.0, 1.0)
}

/// The upper median.
fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}
