//! Segments: pieces of domains, which choose their signs anew where those contradict each other.
//!
//! A single strong coupling joins two samples. So a patch with wrong evidence, such as a face beside a hole, can be part
//! of a domain that is right elsewhere, and the couplings across the border of the patch contradict its signs. Then
//! the cloud is cut into segments of limited size along its weakest couplings, and the couplings, the evidence and
//! the winding number decide between them as between domains: first large segments, then smaller ones. Signs change
//! only if that is clearly better by the sum of all three.

use super::{DomainSigns, Graph, Place, STRONG, Ties, number};
use crate::parallel::{self, CHUNK};
use crate::union_find::{root, settle};

/// A segment holds at most one sample in so many, first and then.
const SHARES: [usize; 3] = [50, 200, 500];

/// Samples that a segment may hold in any case.
const FEW: usize = 16;

/// Share of contradicted couplings that is doubtful, times the square root of the number of samples: a wrong patch shows
/// along its border, the samples of which grow with that root.
const CONTRADICTED: f64 = 0.25;

/// Share of noisy samples from which couplings and winding number are not reliable enough.
const NOISY: f64 = 0.2;

/// Gain for each turned sample, in units of evidence. Wrong patches gained 2 to 15; differences below 1 are
/// as often wrong as right.
const GAIN: f64 = 1.0;

/// Levels of coupling between [`STRONG`] and 1, by which segments grow, from the strongest on.
const LEVELS: usize = 16;

impl DomainSigns {
    /// Corrects the signs of patches within domains. `evidence` and `winding` as in [`DomainSigns::run`].
    pub(super) fn correct_patches(
        &mut self,
        graph: &Graph,
        evidence: &[f32],
        winding: f64,
        place: &impl Place,
    ) {
        if !self.is_contradicted(graph) || is_noisy(graph) {
            return;
        }
        // The first patch has a border that explains the contradictions; then its outline is refined.
        let mut least = self.sign.len().isqrt() / 2;
        for share in SHARES {
            let segments = self.cut(graph, (self.sign.len() / share).max(FEW));
            let (ties, outcome) = self.solve(graph, evidence, segments, winding, place);
            if !self.turn_segments(&ties, &outcome, least) {
                return;
            }
            least = 1;
        }
    }

    /// Coupling of a sample with each neighbor, above 0 where their signs agree with it.
    fn agreements<'a>(&'a self, graph: &'a Graph, p: usize) -> impl Iterator<Item = (u32, f32)> {
        let couplings = graph.near[p].iter().zip(&graph.coupling[p]);
        couplings.map(move |(&q, c)| (q, c * self.sign[p] * self.sign[q as usize]))
    }

    fn is_contradicted(&self, graph: &Graph) -> bool {
        let [against, all] = parallel::sum_array(self.sign.len(), |p| {
            let agreements = self.agreements(graph, p).map(|(_, a)| f64::from(a));
            agreements.fold([0.0; 2], |[against, all], a| {
                [against + (-a).max(0.0), all + a.abs()]
            })
        });
        against * (self.sign.len() as f64).sqrt() > CONTRADICTED * all
    }

    /// Cuts the cloud into segments of at most `limit` samples, and returns their number.
    fn cut(&mut self, graph: &Graph, limit: usize) -> usize {
        let n = self.sign.len();
        let mut parent: Vec<u32> = (0..n as u32).collect();
        let mut size = vec![1; n];
        // Segments that are joined, or too large to be joined, stay so: each coupling is examined on its own level alone.
        let couplings = self.by_level(graph);
        let on_level = |level: usize| couplings.iter().flat_map(move |part| &part[level]);
        for &(p, q) in (0..LEVELS).rev().flat_map(on_level) {
            let (a, b) = (root(&mut parent, p), root(&mut parent, q));
            let (low, high) = (a.min(b) as usize, a.max(b) as usize);
            if low != high && size[low] + size[high] <= limit {
                parent[high] = low as u32;
                size[low] += size[high];
            }
        }
        settle(&mut parent);
        number(&mut self.domain, n, |p| parent[p])
    }

    /// Samples and neighbors of strong couplings that the signs agree with, for some samples after the other, and for each
    /// level.
    fn by_level(&self, graph: &Graph) -> Vec<[Vec<(u32, u32)>; LEVELS]> {
        let n = self.sign.len();
        let of_samples = |_, first: usize| {
            let mut couplings = [(); LEVELS].map(|()| Vec::new());
            for p in first..n.min(first + CHUNK) {
                for (q, agreement) in self.agreements(graph, p) {
                    if agreement >= STRONG {
                        let level = (agreement - STRONG) / (1.0 - STRONG) * LEVELS as f32;
                        couplings[(level as usize).min(LEVELS - 1)].push((p as u32, q));
                    }
                }
            }
            couplings
        };
        parallel::map_each((0..n).step_by(CHUNK), of_samples)
    }

    /// Turns the segments whose sign in `outcome` is −1, relative to the evidence, if these are at least so many samples
    /// and that gains enough; returns whether it does.
    fn turn_segments(&mut self, ties: &Ties, outcome: &[(u32, f32)], least: usize) -> bool {
        let (ground, sign) = outcome[outcome.len() - 1];
        let is_turned: Vec<bool> = outcome
            .iter()
            .map(|&(cluster, turn)| cluster == ground && turn * sign < 0.0)
            .collect();
        let mut gain = 0.0;
        for (_, tied) in is_turned.iter().zip(ties).filter(|(turned, _)| **turned) {
            let parted = tied.iter().filter(|&(&b, _)| !is_turned[b as usize]);
            gain -= 2.0 * parted.map(|(_, weight)| weight).sum::<f64>();
        }
        let turned = |&domain: &u32| is_turned[domain as usize];
        let count = self.domain.iter().filter(|domain| turned(domain)).count();
        if count < least || gain <= GAIN * count as f64 {
            return false;
        }
        for (p, domain) in self.domain.iter().enumerate() {
            if turned(domain) {
                self.sign[p] = -self.sign[p];
                self.overruled[p] = !self.overruled[p];
            }
        }
        true
    }
}

/// Whether many samples [scatter](Graph::scatters).
fn is_noisy(graph: &Graph) -> bool {
    let samples = graph.spread.len();
    let noisy = (0..samples).filter(|&p| graph.scatters(p));
    noisy.count() as f64 > NOISY * samples as f64
}

#[cfg(test)]
mod tests {
    use super::super::super::shapes::{graph, sphere};
    use super::super::{Domains, Misfit};
    use super::*;

    const WINDING: f64 = 4.0;

    /// Samples of a sphere, in units of their spacing, and their signs.
    struct Scene {
        points: Vec<[f64; 3]>,
        graph: Graph,
        evidence: Vec<f32>,
        signs: DomainSigns,
    }

    impl Scene {
        /// The polar cap has wrong signs, and evidence for them.
        fn with_wrong_cap() -> Self {
            let n = 2000;
            let radius = (n as f64 / (4.0 * std::f64::consts::PI)).sqrt();
            let sampled = sphere(n, [0.0; 3], radius, 5);
            let graph = graph(&sampled);
            let (points, normals) = sampled;
            let cap: Vec<bool> = normals.iter().map(|n| n[2] > 0.4).collect();
            let signed = |size: f32| {
                cap.iter()
                    .map(|&cap| if cap { -size } else { size })
                    .collect()
            };
            let (evidence, sign) = (signed(0.3), signed(1.0));
            Self {
                graph,
                points,
                evidence,
                signs: DomainSigns {
                    sign,
                    overruled: vec![false; n],
                    ..DomainSigns::default()
                },
            }
        }

        fn correct(&mut self) {
            let Self {
                points,
                graph,
                evidence,
                signs,
            } = self;
            signs.correct_patches(graph, evidence, WINDING, points);
        }

        fn wrong(&self) -> usize {
            self.signs.sign.iter().filter(|&&sign| sign < 0.0).count()
        }

        /// The sum that the signs should maximize, sample by sample.
        fn total(&self) -> f64 {
            let all = 0..self.points.len();
            let coupled: f64 = all
                .clone()
                .flat_map(|p| self.signs.agreements(&self.graph, p))
                .map(|(_, a)| f64::from(a))
                .sum();
            let seen = |p: usize| {
                f64::from(self.signs.sign[p] * self.evidence[p] * self.evidence[p].abs())
            };
            let whole = vec![0; self.points.len()];
            let domains = Domains {
                domain: &whole,
                sign: &self.signs.sign,
                count: 1,
            };
            let misfit = Misfit::new(&self.graph, &self.points, &domains).total();
            coupled + all.map(seen).sum::<f64>() - WINDING * misfit
        }
    }

    #[test]
    fn a_patch_with_wrong_evidence_is_turned_back_and_marked() {
        let mut scene = Scene::with_wrong_cap();
        let (before, cap) = (scene.total(), scene.wrong());
        assert!(cap > 500, "{cap}");
        scene.correct();
        assert_eq!(scene.wrong(), 0);
        let turned = scene.signs.overruled.iter().filter(|&&turned| turned);
        assert_eq!(turned.count(), cap);
        assert!(scene.total() > before + GAIN * cap as f64);
    }

    #[test]
    fn consistent_signs_and_noisy_samples_are_left_alone() {
        let mut consistent = Scene::with_wrong_cap();
        consistent.signs.sign.fill(1.0);
        consistent.correct();
        assert_eq!(consistent.wrong(), 0);
        let mut noisy = Scene::with_wrong_cap();
        noisy.graph.spread.fill(0.5);
        let before = noisy.wrong();
        noisy.correct();
        assert_eq!(noisy.wrong(), before);
    }

    #[test]
    fn segments_are_limited_and_end_where_signs_contradict_each_other() {
        let mut scene = Scene::with_wrong_cap();
        let segments = scene.signs.cut(&scene.graph, 40);
        let mut sums = vec![(0, 0.0); segments];
        for (&segment, &sign) in scene.signs.domain.iter().zip(&scene.signs.sign) {
            let (size, sum) = &mut sums[segment as usize];
            *size += 1;
            *sum += sign;
        }
        for &(size, sum) in &sums {
            assert!(
                (1..=40).contains(&size) && sum.abs() == size as f32,
                "{size} {sum}"
            );
        }
        assert!(segments < 2000 / 10, "{segments}");
    }
}
