//! The default method: evidence from fills at two scales, spread along the neighbor graph.

use std::convert::Infallible;

use rayon::prelude::*;

use super::Axes;
use super::decide::{Beliefs, Domains, Place, Reading, Signs, Verdict};
use super::evidence::{self, of_view};
use super::fill::Fill;
use super::graph::Graph;
use super::groups::Groups;
use super::winding;
use crate::Real;
use crate::neighbors::Neighborhoods;
use crate::vector;

/// Scratch of the automatic method; all in sorted order.
#[derive(Clone, Debug, Default)]
pub(super) struct Auto {
    graph: Graph,
    groups: Groups,
    fill: Fill,
    seen: Seen,
    /// Beliefs of the next round.
    next: Vec<f32>,
    signs: Signs,
    reaches: Vec<f32>,
}

/// What there is to see at each sample.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// What the fills say, the light on both sides of each axis, and what sheets say.
    filled: Vec<f32>,
    ends: Vec<[f32; 2]>,
    sheets: Vec<f32>,
    /// How much light there is on both sides of samples that scatter: 0..1.
    slabs: Vec<f32>,
    /// What sensors know; empty without them.
    views: Vec<f32>,
}

/// The samples' own voices, and how they are spread.
struct Voices<'a, P> {
    graph: &'a Graph,
    seen: &'a Seen,
    next: &'a mut Vec<f32>,
    place: &'a P,
}

/// Where the points are.
struct Sorted<'a, T>(&'a Neighborhoods<T>);

impl<T: Real> Place for Sorted<'_, T> {
    fn user(&self, p: usize) -> [f64; 3] {
        vector::to_f64(self.0.index.point(p))
    }

    fn spacing(&self) -> f64 {
        self.0.spacing().f64()
    }
}

impl Auto {
    /// Finds the sign of each axis. `views`, in input order, say from which side each point was seen, where
    /// that is known; see [`sensors`](super::sensors).
    pub(super) fn run<T: Real>(
        &mut self,
        axes: &Axes<'_, T>,
        neighborhoods: &Neighborhoods<T>,
        views: Option<&[f32]>,
    ) {
        let place = Sorted(neighborhoods);
        self.graph.build(axes, neighborhoods);
        self.groups.find(&self.graph, |p| place.user(p));
        self.look(&place);
        let known = &mut self.seen.views;
        known.clear();
        if let Some(views) = views {
            let order = neighborhoods.index.order().iter();
            known.extend(order.map(|&i| of_view(views[i as usize])));
        }
        let mut voices = Voices {
            graph: &self.graph,
            seen: &self.seen,
            next: &mut self.next,
            place: &place,
        };
        let Ok(()) = self
            .signs
            .find(&self.graph, &mut voices, views.is_some(), &place);
    }

    /// What was found for the point at a sorted position.
    pub(super) fn verdict(&self, p: usize) -> Verdict {
        self.signs.verdict(p)
    }

    /// Gathers what there is to see.
    fn look(&mut self, place: &impl Place) {
        let n = self.graph.near.len();
        let Seen {
            filled,
            ends,
            sheets,
            slabs,
            ..
        } = &mut self.seen;
        for values in [&mut *filled, &mut *slabs] {
            values.clear();
            values.resize(n, 0.0);
        }
        ends.clear();
        ends.resize(n, [1.0; 2]);
        for group in 0..self.groups.bounds.len() {
            let (graph, members) = (&self.graph, self.groups.members(group));
            let scales = self.groups.scales(group, graph, place, &mut self.reaches);
            for scale in scales {
                self.fill.run(&scale.lattice, members.len(), |m| {
                    let p = members[m] as usize;
                    let reach = scale.growth * f64::from(graph.reach[p]);
                    (place.user(p), graph.axis[p], reach)
                });
                for (&p, sights) in members.iter().zip(self.fill.sights()) {
                    let p = p as usize;
                    filled[p] += scale.weight * sights.evidence;
                    slabs[p] = slabs[p].max(sights.ends[0].min(sights.ends[1]));
                    ends[p] = [0, 1].map(|side| ends[p][side].min(sights.ends[side]));
                }
            }
        }
        self.graph.part_slabs(slabs);
        let (graph, all) = (&self.graph, (0..n).into_par_iter());
        all.map(|p| graph.sheet_evidence(p))
            .collect_into_vec(sheets);
    }
}

impl<P> Voices<'_, P> {
    fn weighed(&self, p: usize, reading: Reading) -> f32 {
        let Seen {
            filled,
            sheets,
            slabs,
            views,
            ..
        } = self.seen;
        let open = match reading {
            Reading::Careful => self.open(p),
            Reading::Bold => 1.0,
        };
        let seen = views.get(p).copied().unwrap_or(0.0);
        evidence::weighed(
            filled[p],
            sheets[p],
            open,
            slabs[p],
            self.graph.side[p],
            seen,
        )
    }

    /// In 0..1, how open the side is that a second sheet behind the point makes the outer one.
    fn open(&self, p: usize) -> f32 {
        let side = usize::from(self.seen.sheets[p] < 0.0);
        evidence::openness(self.seen.ends[p][side])
    }
}

impl<P: Place> Beliefs for Voices<'_, P> {
    type Error = Infallible;

    fn hear(
        &mut self,
        reading: Reading,
        evidence: &mut Vec<f32>,
        belief: &mut Vec<f32>,
    ) -> Result<(), Infallible> {
        let all = 0..self.seen.sheets.len();
        evidence.clear();
        evidence.extend(all.map(|p| self.weighed(p, reading)));
        self.graph.relax(evidence, belief, self.next);
        Ok(())
    }

    fn differ(&mut self) -> Result<bool, Infallible> {
        let sheets = self.seen.sheets.iter().enumerate();
        let mut differing = sheets.filter(|&(p, &sheet)| evidence::differs(sheet, self.open(p)));
        Ok(differing.next().is_some())
    }

    fn winding(&mut self, domains: &Domains<'_>, probes: &[u32]) -> Result<Vec<f64>, Infallible> {
        Ok(winding::numbers(self.graph, self.place, domains, probes))
    }
}
