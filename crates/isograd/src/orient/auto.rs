//! The default method: evidence from fills at two scales, spread along the neighbour graph.

use rayon::prelude::*;

use super::Axes;
use super::fill::{Fill, Lattice};
use super::graph::Graph;
use super::groups::Groups;
use super::sensors;
use super::settle::{Place, Settle};
use crate::Real;
use crate::neighbors::Neighborhoods;
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
const SHEET: f32 = 4.0;

/// What the side weighs on which a sample lies in a layer that scatters.
const SLAB: f32 = 2.0;

/// What a sample at which the winding number is wrong by 1 weighs, beside evidence of 1.
const WINDING: f64 = 4.0;

/// Evidence of a second sheet below this makes no difference.
const SLIGHT: f32 = 0.05;

/// What beliefs are worth, the other way round, where they were overruled as a whole.
const OVERRULED: f32 = 0.5;

/// Evidence from here on decides by itself.
const CLEAR: f32 = 0.1;

/// How sheets close to each other are read: as the two sides of a thin body, or of a narrow gap.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reading {
    /// A thin body, unless there seems to be matter on the far side of the sheet.
    Careful,
    /// A thin body.
    Bold,
}

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

/// One way of orienting the whole cloud, in sorted order.
#[derive(Clone, Debug, Default)]
struct Solution {
    sign: Vec<f32>,
    evidence: Vec<f32>,
    belief: Vec<f32>,
}

/// Scratch of the automatic method.
#[derive(Clone, Debug, Default)]
pub(super) struct Auto {
    graph: Graph,
    groups: Groups,
    fill: Fill,
    settle: Settle,
    /// In sorted order: what the fills say, the light on both sides of each axis, and what sheets say.
    filled: Vec<f32>,
    ends: Vec<[f32; 2]>,
    sheets: Vec<f32>,
    /// How much light there is on both sides of samples that scatter: 0..1.
    slabs: Vec<f32>,
    /// What sensors know; empty without them.
    seen: Vec<f32>,
    /// Own evidence, belief, and the belief of the next round.
    evidence: Vec<f32>,
    belief: Vec<f32>,
    next: Vec<f32>,
    best: Solution,
    reaches: Vec<f32>,
}

/// Where the points are, relative to one of them.
struct Sorted<'a, T> {
    neighborhoods: &'a Neighborhoods<T>,
    origin: [f64; 3],
    spacing: f64,
}

impl<T: Real> Place for Sorted<'_, T> {
    fn user(&self, p: usize) -> [f64; 3] {
        vector::to_f64(self.neighborhoods.index.point(p))
    }

    fn in_spacings(&self, p: usize) -> [f32; 3] {
        let offset = vector::sub(self.user(p), self.origin);
        offset.map(|x| (x / self.spacing) as f32)
    }
}

impl Auto {
    /// Finds the sign of each axis. `views`, in input order, say from which side each point was seen, where
    /// that is known; see [`sensors`].
    ///
    /// Two sheets close to each other are the two sides of a thin body or of a narrow gap, and nothing near
    /// them says which. So where it matters both are tried, and the winding number of the whole decides;
    /// where sensors know, they do.
    pub(super) fn run<T: Real>(
        &mut self,
        axes: &Axes<'_, T>,
        neighborhoods: &Neighborhoods<T>,
        views: Option<&[f32]>,
    ) {
        let place = Sorted {
            neighborhoods,
            origin: vector::to_f64(neighborhoods.index.point(0)),
            spacing: neighborhoods.spacing().f64(),
        };
        self.graph.build(axes, neighborhoods);
        self.groups.find(&self.graph, |p| place.user(p));
        self.gather_evidence(place.spacing, |p| place.user(p));
        self.seen.clear();
        if let Some(views) = views {
            let order = neighborhoods.index.order().iter();
            self.seen
                .extend(order.map(|&i| sensors::evidence(views[i as usize])));
        }
        self.solve(Reading::Careful, &place);
        if views.is_none() && (0..self.sheets.len()).any(|p| self.differs(p)) {
            let careful = self.settle.misfit(&self.graph, &place);
            self.keep();
            self.solve(Reading::Bold, &place);
            if self.settle.misfit(&self.graph, &place) < careful {
                self.keep();
            }
        } else {
            self.keep();
        }
    }

    fn solve(&mut self, reading: Reading, place: &impl Place) {
        let mut evidence = std::mem::take(&mut self.evidence);
        evidence.clear();
        evidence.extend((0..self.sheets.len()).map(|p| self.weighed(p, reading)));
        self.evidence = evidence;
        self.graph
            .relax(&self.evidence, &mut self.belief, &mut self.next);
        let winding = if self.seen.is_empty() { WINDING } else { 0.0 };
        self.settle
            .run(&self.graph, &self.evidence, &self.belief, winding, place);
    }

    fn keep(&mut self) {
        self.best.sign.clone_from(&self.settle.sign);
        self.best.evidence.clone_from(&self.evidence);
        let overruled = self.settle.overruled.iter();
        let heard =
            |(&belief, &over): (&f32, &bool)| if over { -OVERRULED * belief } else { belief };
        self.best.belief.clear();
        self.best
            .belief
            .extend(self.belief.iter().zip(overruled).map(heard));
    }

    /// What was found for the point at a sorted position.
    pub(super) fn verdict(&self, p: usize) -> Verdict {
        let sign = self.best.sign[p];
        let confidence = (sign * self.best.belief[p]).max(0.0);
        let seen = sign * self.best.evidence[p] >= CLEAR;
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
        self.filled.clear();
        self.filled.resize(n, 0.0);
        self.slabs.clear();
        self.slabs.resize(n, 0.0);
        self.ends.clear();
        self.ends.resize(n, [1.0; 2]);
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
                for (&p, sights) in members.iter().zip(&self.fill.sights) {
                    let (filled, ends) = (&mut self.filled[p as usize], &mut self.ends[p as usize]);
                    *filled += weight * sights.evidence;
                    let slab = &mut self.slabs[p as usize];
                    *slab = slab.max(sights.ends[0].min(sights.ends[1]));
                    *ends = [0, 1].map(|side| ends[side].min(sights.ends[side]));
                }
            }
        }
        self.graph.part_slabs(&self.slabs);
        let (graph, all) = (&self.graph, (0..n).into_par_iter());
        all.map(|p| graph.sheet_evidence(p))
            .collect_into_vec(&mut self.sheets);
    }

    fn weighed(&self, p: usize, reading: Reading) -> f32 {
        let open = match reading {
            Reading::Careful => self.open(p),
            Reading::Bold => 1.0,
        };
        let found = self.filled[p] + SHEET * open * self.sheets[p] + self.slab_evidence(p);
        let found = found.clamp(-1.0, 1.0);
        let seen = self.seen.get(p).copied().unwrap_or(0.0);
        seen + (1.0 - seen.abs()) * found
    }

    /// In 0..1, how open the side is that a second sheet behind the point makes the outer one.
    fn open(&self, p: usize) -> f32 {
        let side = usize::from(self.sheets[p] < 0.0);
        (1.0 + self.ends[p][side]).clamp(0.0, 1.0)
    }

    /// Where noise has made one layer of the two sides of a thin body, which is seen by the open air on both
    /// sides of it, a sample on one side of its middle belongs to that side.
    fn slab_evidence(&self, p: usize) -> f32 {
        SLAB * self.slabs[p] * self.graph.side[p]
    }

    fn differs(&self, p: usize) -> bool {
        (1.0 - self.open(p)) * self.sheets[p].abs() > SLIGHT
    }
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
