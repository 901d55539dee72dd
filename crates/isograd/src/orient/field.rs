//! Patches of doubtful samples, turned where the field of the whole cloud wants them the other way.
//!
//! Signed samples are dipoles, and the winding number `w` is their potential. With the right signs it falls along every
//! normal: the slope `−n·∇w`, of all other samples, is positive. The sum of slopes over samples, weighted by area, is the
//! Dirichlet energy of `w`, and the right signs give the largest: their normals are the gradient of an indicator, and
//! nothing of it is lost in `w`.
//!
//! The winding number itself cannot tell the two sides of a flat patch from each other, since it is 0 all over the plane of
//! a patch. The slope can: the walls below the top of a rib make it. So patches that are narrow and have edges all round,
//! where couplings and evidence often fail, are decided here. A patch is a set of neighbors that face the same way, most of them
//! doubtful; it turns if energy, couplings and evidence together gain clearly. Of patches next to each other the one that
//! gains most turns first.
//!
//! Source: the energy is that of S. Lin et al., "Fast and globally consistent normal orientation based on the winding number
//! normal consistency" (2024), who move the normals of all samples.

use super::domains::STRONG;
use super::graph::Graph;
use super::signs::{Domains, Place};
use super::winding::tree::Tree;
use super::winding::{dipole, spread_evenly};
use crate::{parallel, simd, union_find, vector};

/// A sample of a patch has less confidence than this, and all of them in the mean less than that.
const SURE: f32 = 0.9;
const UNSURE: f64 = 0.25;

/// Least cosine between the normals of neighbors of a patch: 45°.
const SMOOTH: f32 = 0.7;

/// Weight of a slope of 1, relative to evidence of 1. In the middle of a smooth surface it is ½.
const WEIGHT: f64 = 16.0;

/// Least gain for each turned sample, and for each patch, in units of evidence. Slopes of random samples deviate by 0.1, and
/// the fewer they are, the less such deviations cancel.
const GAIN: f64 = 1.0;
const GAIN_OF_PATCH: f64 = 4.0;

/// Most samples of a patch at which slopes are computed.
const PROBES: usize = 256;

/// Rounds, in each of which patches turn that are not next to each other; few patches turn after the third.
const ROUNDS: usize = 8;

/// Turns patches, and returns their samples. `(N,)` `evidence` and `sign` are from −1 to 1, `confidence` from 0 to 1.
pub(super) fn turn_patches(
    graph: &Graph,
    place: &impl Place,
    evidence: &[f32],
    confidence: &[f32],
    sign: &mut [f32],
) -> Vec<u32> {
    let mut patches = Patches::find(graph, place, confidence, sign);
    for _ in 0..ROUNDS {
        let turned = patches.choose(graph, evidence, sign);
        if turned.is_empty() {
            break;
        }
        patches.turn(graph, place, &turned, sign);
    }
    let turned = (0..patches.turn.len()).filter(|&k| patches.turn[k] < 0.0);
    turned.flat_map(|k| patches.members[k].clone()).collect()
}

/// The patches of a cloud.
struct Patches {
    /// `(N,)` the patch of each sample; [`Domains::NONE`] for a sample of none.
    patch: Vec<u32>,
    /// The samples of each patch.
    members: Vec<Vec<u32>>,
    /// Samples of each patch, spread evenly over it, and how many each of them stands for.
    probes: Vec<(u32, f64)>,
    /// The slope at each probe along its axis, of all samples but those of its own patch.
    slope: Vec<f64>,
    /// The samples of each patch, with their first signs.
    own: Vec<Tree>,
    /// −1 for a patch that is turned, else 1.
    turn: Vec<f32>,
}

impl Patches {
    fn find(graph: &Graph, place: &impl Place, confidence: &[f32], sign: &[f32]) -> Self {
        let mut members = join(graph, confidence, sign);
        members.retain(|members| {
            let sum: f64 = members
                .iter()
                .map(|&p| f64::from(confidence[p as usize]))
                .sum();
            sum < UNSURE * members.len() as f64
        });
        let mut patch = vec![Domains::NONE; sign.len()];
        for (k, members) in (0..).zip(&members) {
            members.iter().for_each(|&p| patch[p as usize] = k);
        }
        let dipole = |p: usize| dipole(graph, place, p, sign[p]);
        let own = parallel::map_each(&members, |_, members| {
            Tree::new(members.iter().map(|&p| dipole(p as usize)).collect())
        });
        let probes: Vec<(u32, f64)> = members.iter().flat_map(|m| probes(m)).collect();
        let all = match probes.is_empty() {
            true => Tree::default(),
            false => Tree::of_each(sign.len(), &dipole),
        };
        let mut patches = Self {
            slope: vec![0.0; probes.len()],
            turn: vec![1.0; members.len()],
            patch,
            members,
            probes,
            own,
        };
        patches.add(graph, place, &all, |_| -1.0);
        patches
    }

    /// Adds the slopes of a tree, and those of the own patch by a factor.
    fn add(
        &mut self,
        graph: &Graph,
        place: &impl Place,
        tree: &Tree,
        factor: impl Fn(usize) -> f64 + Sync,
    ) {
        let Self {
            probes,
            patch,
            own,
            slope,
            ..
        } = self;
        let arch = pulp::Arch::new();
        parallel::for_each(slope, |i, slope| {
            let p = probes[i].0 as usize;
            let (at, along) = (place.in_spacings(p), graph.axis[p]);
            let of = |tree: &Tree| simd::vectorized!(arch, tree.slope(at, along));
            let k = patch[p] as usize;
            *slope += of(tree);
            match factor(k) {
                0.0 => {}
                factor => *slope += factor * of(&own[k]),
            }
        });
    }

    /// Energy, couplings and evidence in favor of the sign of each patch; negative where it should turn.
    fn scores(&self, graph: &Graph, evidence: &[f32], sign: &[f32]) -> Vec<f64> {
        let stays = |(&turn, members): (&f32, &Vec<u32>)| {
            f64::from(turn) * (GAIN * members.len() as f64 + GAIN_OF_PATCH)
        };
        let mut scores: Vec<f64> = self.turn.iter().zip(&self.members).map(stays).collect();
        let mut add = |p: usize, outward: f64| {
            scores[self.patch[p] as usize] += f64::from(sign[p]) * outward;
        };
        for (&(p, count), slope) in self.probes.iter().zip(&self.slope) {
            let p = p as usize;
            add(p, WEIGHT * count * f64::from(graph.area[p]) * slope);
        }
        for &p in self.members.iter().flatten() {
            let p = p as usize;
            let beside = self.beside(graph, p);
            let coupled: f32 = beside.map(|(q, coupling)| coupling * sign[q]).sum();
            add(p, f64::from(coupled + evidence[p] * evidence[p].abs()));
        }
        scores
    }

    /// Neighbors of a sample that are not of its patch, and their couplings.
    fn beside<'a>(&'a self, graph: &'a Graph, p: usize) -> impl Iterator<Item = (usize, f32)> + 'a {
        let near = graph.near[p].iter().zip(&graph.coupling[p]);
        let near = near.map(|(&q, &coupling)| (q as usize, coupling));
        near.filter(move |&(q, _)| self.patch[q] != self.patch[p])
    }

    /// The patches to turn: of those next to each other only the one that gains most.
    fn choose(&self, graph: &Graph, evidence: &[f32], sign: &[f32]) -> Vec<usize> {
        let scores = self.scores(graph, evidence, sign);
        let mut turns: Vec<bool> = scores.iter().map(|&score| score < 0.0).collect();
        for &p in self.members.iter().flatten() {
            let p = p as usize;
            let a = self.patch[p] as usize;
            for (q, _) in self.beside(graph, p) {
                let b = self.patch[q] as usize;
                if let Some(&other) = scores.get(b)
                    && scores[a].max(other) < 0.0
                {
                    let a_first = (scores[a], a) < (other, b);
                    turns[if a_first { b } else { a }] = false;
                }
            }
        }
        (0..turns.len()).filter(|&k| turns[k]).collect()
    }

    fn turn(&mut self, graph: &Graph, place: &impl Place, turned: &[usize], sign: &mut [f32]) {
        let mut changed = vec![0.0; self.turn.len()];
        let mut dipoles = Vec::new();
        for &k in turned {
            self.turn[k] = -self.turn[k];
            changed[k] = -2.0 * f64::from(self.turn[k]);
            for &p in &self.members[k] {
                let p = p as usize;
                sign[p] = -sign[p];
                dipoles.push(dipole(graph, place, p, 2.0 * sign[p]));
            }
        }
        self.add(graph, place, &Tree::new(dipoles), |k| changed[k]);
    }
}

/// Samples of a patch at which slopes are computed, and how many each of them stands for.
fn probes(members: &[u32]) -> impl Iterator<Item = (u32, f64)> + '_ {
    let share = members.len().min(PROBES);
    let count = members.len() as f64 / share as f64;
    spread_evenly(members, share).map(move |p| (p, count))
}

/// Neighbors that face the same way and are not sure, joined.
fn join(graph: &Graph, confidence: &[f32], sign: &[f32]) -> Vec<Vec<u32>> {
    let is_unsure = |p: usize| confidence[p] < SURE;
    let face_the_same_way = |p: usize, q: usize, coupling: f32| {
        let signs = sign[p] * sign[q];
        let cosine = signs * vector::dot(graph.axis[p], graph.axis[q]);
        signs * coupling > STRONG && cosine > SMOOTH
    };
    let mut parent = Vec::new();
    union_find::find(&mut parent, sign.len(), |p| {
        let ties = graph.near[p].iter().zip(&graph.coupling[p]);
        let joined = ties.filter(move |&(&near, &coupling)| {
            let q = near as usize;
            is_unsure(p) && is_unsure(q) && face_the_same_way(p, q, coupling)
        });
        joined.map(|(&q, _)| q)
    });
    let (mut domain, mut count) = (vec![Domains::NONE; sign.len()], 0);
    for p in (0..sign.len()).filter(|&p| is_unsure(p)) {
        // A root comes before all others of its set.
        let root = parent[p] as usize;
        domain[p] = if root == p { count } else { domain[root] };
        count += u32::from(root == p);
    }
    let joined = Domains {
        domain: &domain,
        sign,
        count: count as usize,
    };
    joined.members()
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Sampled, cuboid, graph, join as both};
    use super::*;

    /// A wall three spacings thick, with one sample for each unit of area.
    fn wall() -> Sampled {
        cuboid(1032, [15.0, 6.0, 1.5], 7)
    }

    /// Turns patches of doubtful samples, those that `is_doubtful`; returns the signs and the samples that were turned.
    fn turned(
        sampled: &Sampled,
        mut sign: Vec<f32>,
        is_doubtful: impl Fn(usize) -> bool,
    ) -> (Vec<f32>, Vec<u32>) {
        let confidence: Vec<f32> = (0..sign.len())
            .map(|p| if is_doubtful(p) { 0.1 } else { 0.9 })
            .collect();
        let evidence = vec![0.0; sign.len()];
        let graph = graph(sampled);
        let turned = turn_patches(&graph, &sampled.0, &evidence, &confidence, &mut sign);
        (sign, turned)
    }

    #[test]
    fn narrow_faces_of_a_wall_turn_outward() {
        // Couplings add up to 0.8 for each sample: too little to turn it.
        let wall = wall();
        let faces: [fn(&[f64; 3]) -> bool; 3] = [
            |n| n[0] > 0.5,
            |n| n[1] < -0.5,
            |n| n[0] > 0.5 || n[1] < -0.5,
        ];
        for is_wrong in faces {
            let wrong = |p: usize| is_wrong(&wall.1[p]);
            let sign = (0..wall.0.len()).map(|p| if wrong(p) { -1.0 } else { 1.0 });
            let (sign, turned) = turned(&wall, sign.collect(), wrong);
            assert!(sign.iter().all(|&s| s == 1.0));
            assert!(turned.len() > 30);
            assert!(turned.iter().all(|&p| wrong(p as usize)));
        }
    }

    #[test]
    fn the_sign_of_all_samples_is_left_to_others() {
        let wall = wall();
        for all in [1.0, -1.0] {
            let (sign, turned) = turned(&wall, vec![all; wall.0.len()], |_| true);
            assert!(turned.is_empty());
            assert!(sign.iter().all(|&s| s == all));
        }
    }

    #[test]
    fn certain_samples_never_turn() {
        let wall = wall();
        let wrong: Vec<f32> = wall
            .1
            .iter()
            .map(|n| if n[0] > 0.5 { -1.0 } else { 1.0 })
            .collect();
        assert_eq!(turned(&wall, wrong.clone(), |_| false), (wrong, Vec::new()));
    }

    #[test]
    fn evidence_outweighs_the_field_where_it_is_strong_enough() {
        let wall = wall();
        let graph = graph(&wall);
        let wrong = |p: usize| wall.1[p][1] > 0.5;
        let start = |p| if wrong(p) { -1.0 } else { 1.0 };
        let confidence: Vec<f32> = (0..wall.0.len()).map(|p| f32::from(!wrong(p))).collect();
        let with = |size: f32| {
            let mut sign: Vec<f32> = (0..wall.0.len()).map(start).collect();
            let evidence: Vec<f32> = sign.iter().map(|s| s * size).collect();
            turn_patches(&graph, &wall.0, &evidence, &confidence, &mut sign).len()
        };
        let all = (0..wall.0.len()).filter(|&p| wrong(p)).count();
        assert_eq!(with(0.0), all);
        assert_eq!(with(0.3), all);
        assert_eq!(with(10.0), 0);
    }

    #[test]
    fn slopes_follow_the_signs() {
        let wall = both(wall(), cuboid(258, [7.5, 3.0, 0.75], 3));
        let graph = graph(&wall);
        let confidence = vec![0.0; wall.0.len()];
        let mut sign: Vec<f32> = (0..wall.0.len())
            .map(|p| {
                if wall.1[p][0] > 0.5 || p % 7 == 0 {
                    -1.0
                } else {
                    1.0
                }
            })
            .collect();
        let mut patches = Patches::find(&graph, &wall.0, &confidence, &sign);
        let count = patches.members.len();
        for turned in [vec![0, 3, 5], vec![1, 3], (0..count).collect()] {
            patches.turn(&graph, &wall.0, &turned, &mut sign);
        }
        let at = |p: usize| wall.0.in_spacings(p);
        for (&(p, _), &slope) in patches.probes.iter().zip(&patches.slope) {
            let p = p as usize;
            let others = (0..sign.len()).filter(|&q| patches.patch[q] != patches.patch[p]);
            let slopes = others.map(|q| {
                let one = Tree::new(vec![dipole(&graph, &wall.0, q, sign[q])]);
                one.slope(at(p), graph.axis[p])
            });
            let expected: f64 = slopes.sum();
            assert!((slope - expected).abs() < 0.02, "{slope} {expected}");
        }
    }
}
