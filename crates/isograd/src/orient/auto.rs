//! The default method: evidence from fills at two scales, spread along the neighbour graph.

use rayon::prelude::*;

use super::fill::{Fill, Lattice};
use super::graph::{Graph, NEIGHBORS};
use super::groups::Groups;
use super::settle::Settle;
use crate::Real;
use crate::neighbors::Neighborhoods;
use crate::parallel::CHUNK;
use crate::vector;

/// Cells of the two grids over the median reach of the samples, and what their evidence weighs.
const SCALES: [(f64, f32); 2] = [(0.8, 1.0), (1.6, 0.5)];

/// Most cells of a grid: for each sample, and in all; and what even a few samples may have.
const CELLS_PER_SAMPLE: usize = 64;
const FEWEST_CELLS: usize = 1 << 15;
const MOST_CELLS: usize = 1 << 24;

/// Discs grow with the cell, from this many median reaches on.
const FINE: f64 = 1.1;

/// What the evidence of a second sheet weighs.
const SHEET: f32 = 5.0;

/// Rounds in which every point takes the mean of its own evidence and what its neighbours say.
const ROUNDS: usize = 60;

/// Evidence from here on decides by itself.
const CLEAR: f32 = 0.1;

/// What decided the sign of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Decision {
    Evidence,
    Neighbors,
    Rule,
}

/// The outcome for one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdict {
    pub flip: bool,
    pub confidence: f32,
    pub by: Decision,
}

/// Scratch of the automatic method.
#[derive(Clone, Debug, Default)]
pub(super) struct Auto {
    graph: Graph,
    groups: Groups,
    fill: Fill,
    settle: Settle,
    /// In sorted order: own evidence, belief, and the belief of the next round.
    evidence: Vec<f32>,
    belief: Vec<f32>,
    next: Vec<f32>,
    reaches: Vec<f32>,
}

impl Auto {
    /// Finds the sign of each axis.
    pub(super) fn run<T: Real>(&mut self, axes: &[[T; 3]], neighborhoods: &Neighborhoods<T>) {
        self.graph.build(axes, neighborhoods);
        let point = |p: usize| vector::to_f64(neighborhoods.index.point(p));
        self.groups.find(&self.graph, point);
        self.gather_evidence(neighborhoods.spacing().f64(), point);
        self.relax();
        self.settle
            .run(&self.graph, &self.evidence, &self.belief, point);
    }

    /// What was found for the point at a sorted position.
    pub(super) fn verdict(&self, p: usize) -> Verdict {
        let sign = self.settle.sign[p];
        let confidence = (sign * self.belief[p]).max(0.0);
        let seen = sign * self.evidence[p] >= CLEAR;
        let by = match (confidence > 0.0, seen) {
            (true, true) => Decision::Evidence,
            (true, false) => Decision::Neighbors,
            (false, _) => Decision::Rule,
        };
        Verdict {
            flip: sign < 0.0,
            confidence,
            by,
        }
    }

    fn gather_evidence(&mut self, spacing: f64, point: impl Fn(usize) -> [f64; 3] + Sync) {
        let n = self.graph.near.len();
        self.evidence.clear();
        self.evidence.resize(n, 0.0);
        for (group, bounds) in self.groups.bounds.iter().enumerate() {
            let (graph, members) = (&self.graph, self.groups.members(group));
            let reach = spacing * median_reach(graph, members, &mut self.reaches);
            let budget = (CELLS_PER_SAMPLE * members.len()).clamp(FEWEST_CELLS, MOST_CELLS);
            for (scale, weight) in SCALES {
                let lattice = Lattice::new(bounds.low, bounds.high, scale * reach, budget);
                let growth = spacing * (scale / FINE).max(1.0);
                self.fill.run(&lattice, members.len(), |m| {
                    let p = members[m] as usize;
                    (point(p), graph.axis[p], growth * f64::from(graph.reach[p]))
                });
                for (&p, &evidence) in members.iter().zip(&self.fill.evidence) {
                    self.evidence[p as usize] += weight * evidence;
                }
            }
        }
        let graph = &self.graph;
        self.evidence
            .par_iter_mut()
            .enumerate()
            .for_each(|(p, evidence)| {
                *evidence = (*evidence + SHEET * graph.sheet_evidence(p)).clamp(-1.0, 1.0);
            });
    }

    /// Spreads the evidence: repeated weighted means, each point's own evidence held with its strength.
    fn relax(&mut self) {
        self.belief.clone_from(&self.evidence);
        self.next.resize(self.belief.len(), 0.0);
        for _ in 0..ROUNDS {
            let (graph, evidence, belief) = (&self.graph, &self.evidence, &self.belief);
            self.next
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each(|(chunk, next)| {
                    for (k, next) in next.iter_mut().enumerate() {
                        let p = chunk * CHUNK + k;
                        *next = spread(evidence[p], &graph.coupling[p], &graph.near[p], belief);
                    }
                });
            std::mem::swap(&mut self.belief, &mut self.next);
        }
    }
}

#[inline(always)]
fn spread(own: f32, coupling: &[f32; NEIGHBORS], near: &[u32; NEIGHBORS], belief: &[f32]) -> f32 {
    let mut sum = own * own.abs();
    let mut weight = own.abs();
    for slot in 0..NEIGHBORS {
        sum += coupling[slot] * belief[near[slot] as usize];
        weight += coupling[slot].abs();
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}

/// The median reach of the members that have any, in spacings of the cloud.
fn median_reach(graph: &Graph, members: &[u32], reaches: &mut Vec<f32>) -> f64 {
    let reach = members.iter().map(|&p| graph.reach[p as usize]);
    reaches.clear();
    reaches.extend(reach.filter(|&r| r > 0.0));
    if reaches.is_empty() {
        return 1.0;
    }
    let middle = reaches.len() / 2;
    f64::from(*reaches.select_nth_unstable_by(middle, f32::total_cmp).1)
}
