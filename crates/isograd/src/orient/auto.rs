//! The default method: evidence from fills at two scales, spread along the neighbor graph.

use super::Axes;
use super::clusters::Clusters;
use super::evidence::{self, of_view};
use super::fill::Fill;
use super::graph::{Graph, SecondSheet};
use super::layers::{self, Surroundings};
use super::signs::{Interpretation, Place, Signs, Verdict};
use super::sites::Sites;
use crate::large::is_large;
use crate::neighbors::Neighborhoods;
use crate::vector;
use crate::{Real, parallel};

/// Scratch of the automatic method; all in the order of the sites.
#[derive(Clone, Debug, Default)]
pub(super) struct Auto {
    sites: Sites,
    graph: Graph,
    clusters: Clusters,
    fill: Fill,
    evidence: Evidence,
    /// Evidence and beliefs for each [`Interpretation`], and beliefs of the next round.
    observed: Vec<[f32; 2]>,
    beliefs: Vec<[f32; 2]>,
    next: Vec<[f32; 2]>,
    signs: Signs,
    reaches: Vec<f32>,
}

/// Evidence at each sample.
#[derive(Clone, Debug, Default)]
struct Evidence {
    /// Evidence of the exterior fill, and the light on both sides of each axis.
    filled: Vec<f32>,
    light: Vec<[f32; 2]>,
    /// Second sheets close by.
    sheets: Vec<SecondSheet>,
    /// Whether a third sheet is on the other side of the sample.
    between: Vec<bool>,
    /// Light on the darker side of each sample: 0..1.
    slabs: Vec<f32>,
    /// Evidence of sensors; empty without them.
    views: Vec<f32>,
}

/// Positions of the points, in the order of the sites.
struct Places<'a, T> {
    neighborhoods: &'a Neighborhoods<T>,
    sites: &'a Sites,
}

impl<T: Real> Place for Places<'_, T> {
    fn user(&self, p: usize) -> [f64; 3] {
        vector::to_f64(self.neighborhoods.index.point(self.sites.position(p)))
    }

    fn spacing(&self) -> f64 {
        self.neighborhoods.spacing().f64()
    }
}

impl<T: Real> Surroundings for Places<'_, T> {
    fn for_each_within(&self, center: [f64; 3], radius: f64, mut visit: impl FnMut(usize)) {
        let (center, radius) = (center.map(T::of), T::of(radius));
        let visit = |i: usize, _| visit(self.sites.of(i as u32) as usize);
        self.neighborhoods
            .index
            .for_each_within(center, radius, visit);
    }
}

impl Auto {
    /// Finds the sign of each axis. `views`, in input order, are cosines between axes and lines of sight, if known; see
    /// [`sensors`](super::sensors).
    pub(super) fn run<T: Real>(
        &mut self,
        axes: &Axes<'_, T>,
        neighborhoods: &Neighborhoods<T>,
        views: Option<&[f32]>,
    ) {
        let mut sites = std::mem::take(&mut self.sites);
        sites.find(neighborhoods);
        let place = Places {
            neighborhoods,
            sites: &sites,
        };
        self.graph.build(axes, neighborhoods, &sites);
        self.clusters.find(&self.graph, |p| place.user(p));
        self.find_second_sheets();
        let is_large = is_large(neighborhoods.index.len());
        if is_large {
            self.graph.free_offsets();
        }
        self.collect(&place);
        if is_large {
            self.fill = Fill::default();
        }
        let of_sensors = &mut self.evidence.views;
        of_sensors.clear();
        if let Some(views) = views {
            let order = sites.order().iter();
            of_sensors.extend(order.map(|&i| of_view(views[i as usize])));
        }
        let sensors = views.is_some();
        let ambiguous = !sensors && self.evidence.is_ambiguous();
        self.spread();
        let observed = (&*self.observed, &*self.beliefs);
        let graph = &self.graph;
        self.signs.find(graph, &place, sensors, ambiguous, observed);
        self.sites = sites;
    }

    /// Spreads the evidence of both interpretations at once: reading the graph takes longer than what is done with it.
    fn spread(&mut self) {
        let (graph, collected) = (&self.graph, &self.evidence);
        let both = [Interpretation::Careful, Interpretation::Bold];
        let total = |p: usize| both.map(|of| collected.total(p, graph, of));
        parallel::fill(&mut self.observed, graph.near.len(), total);
        graph.relax(&self.observed, &mut self.beliefs, &mut self.next);
    }

    /// Input index and sign of every point, and the cosine between its axis and the one that the sign was found for.
    pub(super) fn verdicts(&self) -> impl Iterator<Item = (usize, Verdict, f32)> {
        let order = self.sites.order().iter().enumerate();
        order.map(|(p, &i)| (i as usize, self.signs.verdict(p), self.graph.parallel[p]))
    }

    fn find_second_sheets(&mut self) {
        let (graph, sheets) = (&self.graph, &mut self.evidence.sheets);
        parallel::fill_large(sheets, graph.near.len(), &|p| graph.second_sheet(p));
    }

    /// Collects the evidence of the fills, and of third sheets beside the second ones.
    fn collect(&mut self, place: &impl Surroundings) {
        let n = self.graph.near.len();
        let Evidence {
            filled,
            light,
            sheets,
            between,
            slabs,
            ..
        } = &mut self.evidence;
        for values in [&mut *filled, &mut *slabs] {
            values.clear();
            parallel::resize(values, n, 0.0);
        }
        parallel::fill(light, n, |_| [1.0; 2]);
        for cluster in 0..self.clusters.bounds.len() {
            let (graph, members) = (&self.graph, self.clusters.members(cluster));
            let scales = self
                .clusters
                .scales(cluster, graph, place, &mut self.reaches);
            for scale in scales {
                self.fill.run(&scale.lattice, members.len(), |m| {
                    let p = members[m] as usize;
                    let reach = scale.growth * f64::from(graph.reach[p]);
                    (place.user(p), graph.axis[p], reach)
                });
                for (&p, sides) in members.iter().zip(self.fill.evidence()) {
                    let p = p as usize;
                    filled[p] += scale.weight * sides.evidence;
                    slabs[p] = slabs[p].max(sides.light[0].min(sides.light[1]));
                    light[p] = [0, 1].map(|side| light[p][side].min(sides.light[side]));
                }
            }
        }
        self.graph.part_slabs(slabs);
        self.graph
            .expose(|p| evidence::exposed(slabs[p], sheets[p].evidence));
        let graph = &self.graph;
        parallel::fill(between, n, |p| {
            layers::is_between(graph, place, p, sheets[p])
        });
    }
}

impl Evidence {
    /// Evidence of all kinds, from −1 to 1.
    fn total(&self, p: usize, graph: &Graph, interpretation: Interpretation) -> f32 {
        let openness = match interpretation {
            Interpretation::Careful => self.openness(p),
            Interpretation::Bold => 1.0,
        };
        let view = self.views.get(p).copied().unwrap_or(0.0);
        let (filled, sheet, slab) = (self.filled[p], self.sheets[p].evidence, self.slabs[p]);
        let found = evidence::weighed(filled, sheet, openness, slab, graph.side[p]);
        evidence::with_view(evidence::kept(graph.exposed[p]) * found, view)
    }

    /// In 0..1, the openness of the side that a second sheet behind the point makes the outer one.
    fn openness(&self, p: usize) -> f32 {
        if self.between[p] {
            return 0.0;
        }
        let side = usize::from(self.sheets[p].evidence < 0.0);
        evidence::openness(self.light[p][side])
    }

    /// Whether the two interpretations differ anywhere.
    fn is_ambiguous(&self) -> bool {
        let differs = |p: usize| evidence::differs(self.sheets[p].evidence, self.openness(p));
        parallel::first(self.sheets.len(), differs).is_some()
    }
}
