//! From beliefs to signs: domains that agree within themselves, and conflicts between them.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::graph::Graph;
use super::signs::{Domains, Place};
use super::winding::Misfit;
use crate::{parallel, union_find, vector};

mod segments;
mod ties;

use ties::Ties;

/// Neighbors whose coupling is at least this strong belong to one domain if their beliefs agree.
pub(super) const STRONG: f32 = 0.5;

/// Fewest points of a domain whose winding number is computed, and the largest number of such domains: the
/// others have too little surface to matter.
const SMALLEST: usize = 12;
const MOST_DOMAINS: usize = 512;

/// A domain is overruled if the beliefs against its signs outweigh those for them by this factor.
const MOSTLY: f64 = 3.0;

/// A belief below this is none.
const NEGLIGIBLE: f32 = 1e-2;

/// Turns beliefs into one sign for each point; all in sorted order.
#[derive(Clone, Debug, Default)]
pub(super) struct DomainSigns {
    /// `+1` where the axis points outward, `−1` where it points inward.
    pub sign: Vec<f32>,
    /// Whether the domain of a point was turned against what its points believed.
    pub overruled: Vec<bool>,
    domains: SignedUnionFind,
    /// The domain of each point.
    domain: Vec<u32>,
}

/// Union-find in which every point knows its sign relative to its root.
#[derive(Clone, Debug, Default)]
struct SignedUnionFind {
    parent: Vec<u32>,
    /// Sign relative to the parent.
    relative: Vec<f32>,
    /// Whether the domain of this root holds a belief.
    has_belief: Vec<bool>,
}

impl SignedUnionFind {
    /// Root of `p`, and the sign of `p` relative to it.
    fn root(&mut self, mut p: u32) -> (u32, f32) {
        let mut sign = 1.0;
        while self.parent[p as usize] != p {
            let up = self.parent[p as usize] as usize;
            self.relative[p as usize] *= self.relative[up];
            self.parent[p as usize] = self.parent[up];
            sign *= self.relative[p as usize];
            p = self.parent[p as usize];
        }
        (p, sign)
    }

    /// Like [`root`](Self::root), after all joins.
    fn settled_root(&self, mut p: u32) -> (u32, f32) {
        let mut sign = 1.0;
        while self.parent[p as usize] != p {
            sign *= self.relative[p as usize];
            p = self.parent[p as usize];
        }
        (p, sign)
    }

    /// Joins two domains so that the signs of `p` and `q` have the given product.
    fn join(&mut self, (a, sign_a): (u32, f32), (b, sign_b): (u32, f32), product: f32) {
        if a != b {
            let (low, high) = (a.min(b) as usize, a.max(b) as usize);
            self.parent[high] = low as u32;
            self.relative[high] = sign_a * sign_b * product;
            self.has_belief[low] |= self.has_belief[high];
        }
    }
}

impl DomainSigns {
    /// Finds the signs, from the `evidence` and the `belief` of each sample. `winding` is the weight of a sample at which
    /// the winding number is wrong by 1, relative to evidence of 1.
    ///
    /// Neighbors that agree form domains, which are oriented as a whole, the strongest tie first: to the evidence, or to
    /// the domain next to them. So a part whose evidence is weak follows the neighbors on which it borders, however large
    /// it is. A domain that is tied to no evidence at all turns its axes away from its centroid.
    pub(super) fn run(
        &mut self,
        graph: &Graph,
        (evidence, belief): (&[f32], &[f32]),
        winding: f64,
        place: &impl Place,
    ) {
        self.join_agreeing(graph, belief);
        self.join_undecided(graph, belief);
        let domains = self.number_domains();
        let (_, outcome) = self.solve(graph, evidence, domains, winding, place);
        self.apply(&outcome);
        self.find_overruled(domains, belief);
        self.turn_from_centroids(graph, &outcome, |p| place.user(p));
        if winding > 0.0 {
            self.correct_patches(graph, evidence, winding, place);
        }
    }

    /// Ties of the domains, and the cluster and sign of each that satisfy them best.
    fn solve(
        &self,
        graph: &Graph,
        evidence: &[f32],
        domains: usize,
        winding: f64,
        place: &impl Place,
    ) -> (Ties, Vec<(u32, f32)>) {
        let mut ties = self.ties(graph, evidence, domains);
        if winding > 0.0 {
            self.add_winding(graph, place, winding, &mut ties);
        }
        let outcome = ties::satisfy(&ties);
        (ties, outcome)
    }

    fn join_agreeing(&mut self, graph: &Graph, belief: &[f32]) {
        let product = |p: usize, q: u32| belief[p].signum() * belief[q as usize].signum();
        let parent = &mut self.domains.parent;
        union_find::find(parent, belief.len(), |p| {
            let ties = graph.near[p].iter().zip(&graph.coupling[p]);
            let agreeing = ties.filter(move |&(&q, &coupling)| {
                let least = belief[p].abs().min(belief[q as usize].abs());
                least >= NEGLIGIBLE && coupling * product(p, q) >= STRONG
            });
            agreeing.map(|(&q, _)| q)
        });
        // All signs are those of the beliefs.
        let SignedUnionFind {
            parent,
            relative,
            has_belief,
        } = &mut self.domains;
        parallel::fill(relative, belief.len(), |p| product(p, parent[p]));
        parallel::fill(has_belief, belief.len(), |p| belief[p].abs() >= NEGLIGIBLE);
    }

    /// Points that the evidence has not reached follow their strongest couplings, strongest first.
    fn join_undecided(&mut self, graph: &Graph, belief: &[f32]) {
        let is_decided = |p: usize| belief[p].abs() >= NEGLIGIBLE;
        let strong = |p: usize| {
            let ties = graph.near[p].iter().zip(&graph.coupling[p]);
            ties.filter_map(move |(&q, &coupling)| {
                let undecided = !(is_decided(p) && is_decided(q as usize));
                (undecided && coupling.abs() >= STRONG).then_some((coupling, p as u32, q))
            })
        };
        let mut undecided = parallel::flat_map(belief.len(), strong);
        undecided.sort_unstable_by(|a, b| {
            let stronger = b.0.abs().total_cmp(&a.0.abs());
            stronger.then((a.1, a.2).cmp(&(b.1, b.2)))
        });
        for (coupling, p, q) in undecided {
            let (a, b) = (self.domains.root(p), self.domains.root(q));
            // Points without belief must not join domains with strong evidence of their own.
            if !(self.domains.has_belief[a.0 as usize] && self.domains.has_belief[b.0 as usize]) {
                self.domains.join(a, b, coupling.signum());
            }
        }
    }

    /// Numbers the domains and takes each point's sign relative to the root of its domain.
    fn number_domains(&mut self) -> usize {
        let (domains, points) = (&self.domains, self.domains.parent.len());
        let root = |p: usize| domains.settled_root(p as u32);
        parallel::fill(&mut self.sign, points, |p| root(p).1);
        number(&mut self.domain, points, |p| root(p).0)
    }

    /// Sums of couplings between domains, and of evidence for each of them (the tie to node `domains`).
    fn ties(&self, graph: &Graph, evidence: &[f32], domains: usize) -> Ties {
        let ground = domains as u32;
        let mut ties = vec![BTreeMap::new(); domains + 1];
        let mut tie = |a: u32, b: u32, weight: f32| {
            if a != b && weight != 0.0 {
                *ties[a as usize].entry(b).or_insert(0.0) += f64::from(weight);
                *ties[b as usize].entry(a).or_insert(0.0) += f64::from(weight);
            }
        };
        let mut own = vec![0.0; domains];
        for (p, &domain) in self.domain.iter().enumerate() {
            own[domain as usize] += self.sign[p] * evidence[p] * evidence[p].abs();
        }
        let between = parallel::flat_map(self.domain.len(), |p| {
            let ties = graph.near[p].iter().zip(&graph.coupling[p]);
            ties.filter_map(move |(&q, &coupling)| {
                let (a, b) = (self.domain[p], self.domain[q as usize]);
                let weight = coupling * self.sign[p] * self.sign[q as usize];
                (a != b).then_some((a, b, weight))
            })
        });
        for (a, b, weight) in between {
            tie(a, b, weight);
        }
        for (a, &own) in (0u32..).zip(&own) {
            tie(a, ground, own);
        }
        ties
    }

    /// Adds the ties of the winding number, of the larger domains and between them.
    fn add_winding(&self, graph: &Graph, place: &impl Place, winding: f64, ties: &mut Ties) {
        let ground = ties.len() - 1;
        let large = self.large_domains(ground);
        let mut row = vec![Domains::NONE; ground];
        for (k, &domain) in (0..).zip(&large) {
            row[domain] = k;
        }
        let domain = parallel::map(self.domain.len(), |p| row[self.domain[p] as usize]);
        let misfit = Misfit::new(graph, place, &self.signed(&domain, large.len()));
        let mut tie = |a: usize, b: usize, weight: f64| {
            *ties[a].entry(b as u32).or_insert(0.0) += weight;
            *ties[b].entry(a as u32).or_insert(0.0) += weight;
        };
        for (k, &a) in large.iter().enumerate() {
            tie(a, ground, winding * misfit.pull[k]);
            for (l, &b) in large[..k].iter().enumerate() {
                tie(a, b, -2.0 * winding * misfit.gram[k * large.len() + l]);
            }
        }
    }

    fn signed<'a>(&'a self, domain: &'a [u32], count: usize) -> Domains<'a> {
        Domains {
            domain,
            sign: &self.sign,
            count,
        }
    }

    /// The domains whose winding numbers are computed, largest first.
    fn large_domains(&self, domains: usize) -> Vec<usize> {
        let mut size = vec![0; domains];
        self.domain.iter().for_each(|&d| size[d as usize] += 1);
        let mut large: Vec<usize> = (0..domains).filter(|&d| size[d] >= SMALLEST).collect();
        large.sort_by_key(|&d| (Reverse(size[d]), d));
        large.truncate(MOST_DOMAINS);
        large
    }

    /// Marks the domains whose signs contradict most beliefs of their points, because of the winding number of all
    /// domains together or of their neighbors.
    fn find_overruled(&mut self, domains: usize, belief: &[f32]) {
        let mut totals = vec![[0.0; 2]; domains];
        for (p, &domain) in self.domain.iter().enumerate() {
            let signed = f64::from(self.sign[p] * belief[p]);
            totals[domain as usize][usize::from(signed < 0.0)] += signed.abs();
        }
        let overruled = |[agree, against]: &[f64; 2]| *against > MOSTLY * agree;
        let overruled: Vec<bool> = totals.iter().map(overruled).collect();
        let domain = &self.domain;
        parallel::fill(&mut self.overruled, domain.len(), |p| {
            overruled[domain[p] as usize]
        });
    }

    fn apply(&mut self, outcome: &[(u32, f32)]) {
        let ground = outcome[outcome.len() - 1].1;
        let domain = &self.domain;
        parallel::for_each(&mut self.sign, |p, sign| {
            *sign *= outcome[domain[p] as usize].1 * ground;
        });
    }

    /// The rule for clusters without evidence: on the sum, axes point away from the centroid.
    fn turn_from_centroids(
        &mut self,
        graph: &Graph,
        outcome: &[(u32, f32)],
        point: impl Fn(usize) -> [f64; 3],
    ) {
        let ground = outcome[outcome.len() - 1].0;
        let mut isolated: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (p, &domain) in self.domain.iter().enumerate() {
            let cluster = outcome[domain as usize].0;
            if cluster != ground {
                isolated.entry(cluster).or_default().push(p);
            }
        }
        for members in isolated.values() {
            let total = members
                .iter()
                .fold([0.0; 3], |sum, &p| vector::add(sum, point(p)));
            let centroid = vector::scale(total, 1.0 / members.len() as f64);
            let outward = |&p: &usize| {
                let axis = vector::to_f64(graph.axis[p]);
                f64::from(self.sign[p]) * vector::dot(axis, vector::sub(point(p), centroid))
            };
            if members.iter().map(outward).sum::<f64>() < 0.0 {
                members.iter().for_each(|&p| self.sign[p] = -self.sign[p]);
            }
        }
    }
}

/// Deviation of the winding number of the whole, with these signs of the axes, from that of a body.
pub(super) fn misfit(graph: &Graph, place: &impl Place, sign: &[f32]) -> f64 {
    let whole = Domains {
        domain: &vec![0; sign.len()],
        sign,
        count: 1,
    };
    Misfit::new(graph, place, &whole).total()
}

/// Numbers sets of points 0, 1, … in `domain`, in the order of their roots, from the root of each point, and returns how many
/// there are.
fn number(domain: &mut Vec<u32>, points: usize, root: impl Fn(usize) -> u32 + Sync) -> usize {
    parallel::fill(domain, points, root);
    let root = &*domain;
    let roots = parallel::flat_map(points, |p| (root[p] == p as u32).then_some(p as u32));
    parallel::for_each(domain, |_, domain| {
        *domain = roots.partition_point(|root| root < domain) as u32;
    });
    roots.len()
}
