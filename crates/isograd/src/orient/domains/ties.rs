//! Signs of nodes that satisfy as much as possible of the ties between them.
//!
//! A tie of positive weight wants two nodes to have the same sign, one of negative weight the opposite. The largest sum of
//! satisfied ties is NP-hard to find. Nodes are joined by contraction, and then turned in sequences. That starts from the
//! signs of the contraction, from their opposite, since a part that is inside out as a whole is close to that, from
//! equal signs, which leave all as it was before, and from those of the relaxed problem; the best of the four ends is taken.

use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BinaryHeap};

/// Most sequences of turns.
const SEQUENCES: usize = 20;

/// Power iterations; ten times as many end in the same signs.
const ITERATIONS: usize = 30;

/// Weights of the ties of each node to others; a tie stands at both of its ends.
pub(super) type Ties = Vec<BTreeMap<u32, f64>>;

/// Ties of each node, in order.
type Rows = Vec<Vec<(u32, f64)>>;

/// For each node the cluster of nodes that are tied to it, and its sign there, which says something relative to others alone.
pub(super) fn satisfy(ties: &Ties) -> Vec<(u32, f32)> {
    let rows = rows(ties);
    let mut best = contract(ties.clone());
    let ground = best.len() - 1;
    let sign = best[ground].1;
    let relaxed = relax(&rows);
    let starts = [
        with_signs(&best, |_, own| -own),
        with_signs(&best, |_, _| sign),
        with_signs(&best, |a, _| match relaxed[a] * relaxed[ground] < 0.0 {
            true => -sign,
            false => sign,
        }),
    ];
    improve(&rows, &mut best);
    for mut other in starts {
        improve(&rows, &mut other);
        if satisfied(&rows, &other) > satisfied(&rows, &best) {
            best = other;
        }
    }
    best
}

fn rows(ties: &Ties) -> Rows {
    let row = |tied: &BTreeMap<u32, f64>| tied.iter().map(|(&b, &weight)| (b, weight)).collect();
    ties.iter().map(row).collect()
}

/// The outcome with other signs of the nodes that are tied to the last one, from the number of a node and its sign.
fn with_signs(outcome: &[(u32, f32)], sign: impl Fn(usize, f32) -> f32) -> Vec<(u32, f32)> {
    let changed = |(a, &(cluster, own)): (usize, &(u32, f32))| {
        let may_turn = may_turn(outcome, a);
        (cluster, if may_turn { sign(a, own) } else { own })
    };
    outcome.iter().enumerate().map(changed).collect()
}

/// Whether a node is tied to the last one, and not that itself.
fn may_turn(outcome: &[(u32, f32)], a: usize) -> bool {
    let ground = outcome.len() - 1;
    a < ground && outcome[a].0 == outcome[ground].0
}

/// The sum of all satisfied ties, less those that are not.
fn satisfied(rows: &Rows, outcome: &[(u32, f32)]) -> f64 {
    let at = |a: usize| pull(&rows[a], outcome) * f64::from(outcome[a].1);
    0.5 * (0..rows.len()).map(at).sum::<f64>()
}

/// The sum of the signs of other nodes, as the ties of one node want it to have them.
fn pull(tied: &[(u32, f64)], outcome: &[(u32, f32)]) -> f64 {
    let sign = |b: u32| f64::from(outcome[b as usize].1);
    tied.iter().map(|&(b, weight)| weight * sign(b)).sum()
}

/// Real numbers in place of signs, which satisfy most of the ties if each tie is weighed against all of its two nodes: the
/// leading eigenvector of the normalized ties, by power iteration.
fn relax(rows: &Rows) -> Vec<f64> {
    let scale = |tied: &Vec<(u32, f64)>| {
        let total: f64 = tied.iter().map(|(_, weight)| weight.abs()).sum();
        1.0 / total.max(f64::MIN_POSITIVE).sqrt()
    };
    let scales: Vec<f64> = rows.iter().map(scale).collect();
    // Numbers as good as random, which lack no eigenvector.
    let first = |a: usize| (7919 * a % 101) as f64 / 101.0 - 0.4;
    let mut values: Vec<f64> = (0..rows.len()).map(first).collect();
    for _ in 0..ITERATIONS {
        let next = |a: usize| {
            let scaled =
                |&(b, weight): &(u32, f64)| weight * scales[b as usize] * values[b as usize];
            values[a] + scales[a] * rows[a].iter().map(scaled).sum::<f64>()
        };
        let next: Vec<f64> = (0..rows.len()).map(next).collect();
        let squares: f64 = next.iter().map(|x| x * x).sum();
        let norm = squares.sqrt().max(f64::MIN_POSITIVE);
        values = next.iter().map(|x| x / norm).collect();
    }
    values
}

/// Nodes that are searched together for the largest gain.
const BLOCK: usize = 64;

/// Gain of a node that may not turn, or not again.
const TURNED: f64 = f64::NEG_INFINITY;

/// Gain of turning each node, searched for the largest by blocks: only those where a gain changed are searched again.
struct Gains {
    gains: Vec<f64>,
    /// The best node of each block, unless gains changed there.
    best: Vec<Option<usize>>,
}

impl Gains {
    fn new(gains: Vec<f64>) -> Self {
        let best = vec![None; gains.len().div_ceil(BLOCK)];
        Self { gains, best }
    }

    /// The node that gains most, the first of equals, and its gain.
    fn largest(&mut self) -> Option<(usize, f64)> {
        let Self { gains, best } = self;
        for (k, best) in best.iter_mut().enumerate() {
            let block = k * BLOCK..gains.len().min((k + 1) * BLOCK);
            *best = best.or_else(|| first_largest(gains, block));
        }
        let largest = first_largest(gains, best.iter().copied().flatten())?;
        Some((largest, gains[largest])).filter(|&(_, gain)| gain > TURNED)
    }

    /// Changes the gain of a node, if that may still turn.
    fn add(&mut self, a: usize, change: f64) {
        if self.gains[a] > TURNED {
            self.set(a, self.gains[a] + change);
        }
    }

    fn set(&mut self, a: usize, gain: f64) {
        self.gains[a] = gain;
        self.best[a / BLOCK] = None;
    }
}

/// The first of some nodes with the largest gain.
fn first_largest(gains: &[f64], nodes: impl Iterator<Item = usize>) -> Option<usize> {
    nodes.reduce(|best, a| match gains[a].total_cmp(&gains[best]) {
        Ordering::Greater => a,
        _ => best,
    })
}

/// Turns sequences of nodes as long as that satisfies more of their ties: a contraction can't take back what it has joined.
/// In a sequence each node that [may](may_turn) turns once, always the one that gains most or loses least; of
/// the sequence so much is kept that the gain is largest.
///
/// Source: B. Kernighan, S. Lin, "An efficient heuristic procedure for partitioning graphs" (1970).
fn improve(rows: &Rows, outcome: &mut [(u32, f32)]) {
    let nodes = outcome.len();
    for _ in 0..SEQUENCES {
        let gain = |a: usize| match may_turn(outcome, a) {
            true => -2.0 * pull(&rows[a], outcome) * f64::from(outcome[a].1),
            false => TURNED,
        };
        let mut gains = Gains::new((0..nodes).map(gain).collect());
        let (mut total, mut largest, mut kept) = (0.0, 0.0, 0);
        let mut turned = Vec::new();
        while let Some((a, gain)) = gains.largest() {
            gains.set(a, TURNED);
            outcome[a].1 = -outcome[a].1;
            turned.push(a);
            total += gain;
            if total > largest {
                (largest, kept) = (total, turned.len());
            }
            for &(b, weight) in &rows[a] {
                let b = b as usize;
                gains.add(b, -4.0 * weight * f64::from(outcome[a].1 * outcome[b].1));
            }
        }
        for &a in &turned[kept..] {
            outcome[a].1 = -outcome[a].1;
        }
        if kept == 0 {
            break;
        }
    }
}

/// Contracts the tie of the largest magnitude again and again, adding up ties that become parallel;
/// returns for each node the cluster it ends in, and its sign there.
///
/// Source: greedy additive edge contraction, M. Keuper et al., "Efficient decomposition of image and
/// mesh graphs by lifted multicuts" (2015), here with signs in place of cuts.
fn contract(mut ties: Ties) -> Vec<(u32, f32)> {
    let mut parent: Vec<(u32, f32)> = (0..ties.len() as u32).map(|a| (a, 1.0)).collect();
    // Magnitudes are positive, so their bits are ordered as they are.
    let entry = |a: u32, b: u32, w: f64| (w.abs().to_bits(), Reverse((a.min(b), a.max(b))));
    let mut queue = BinaryHeap::new();
    for (a, tied) in (0u32..).zip(&ties) {
        queue.extend(tied.range(a + 1..).map(|(&b, &w)| entry(a, b, w)));
    }
    while let Some((magnitude, Reverse((a, b)))) = queue.pop() {
        let Some(&weight) = ties[a as usize].get(&b) else {
            continue;
        };
        if weight.abs().to_bits() != magnitude || weight == 0.0 {
            continue;
        }
        // The smaller one moves, so that every tie moves at most log N times.
        let larger = ties[a as usize].len() >= ties[b as usize].len();
        let (stays, goes) = if larger { (a, b) } else { (b, a) };
        let sign = if weight > 0.0 { 1.0 } else { -1.0 };
        parent[goes as usize] = (stays, sign);
        let moved = std::mem::take(&mut ties[goes as usize]);
        ties[stays as usize].remove(&goes);
        for (&other, &w) in moved.iter().filter(|&(&other, _)| other != stays) {
            ties[other as usize].remove(&goes);
            let sum = ties[stays as usize].entry(other).or_insert(0.0);
            *sum += f64::from(sign) * w;
            let sum = *sum;
            ties[other as usize].insert(stays, sum);
            queue.push(entry(stays, other, sum));
        }
    }
    (0..parent.len() as u32)
        .map(|a| resolve(&parent, a))
        .collect()
}

/// The end of the chain from `a`, and the product of the signs along it.
fn resolve(parent: &[(u32, f32)], mut a: u32) -> (u32, f32) {
    let mut sign = 1.0;
    while parent[a as usize].0 != a {
        sign *= parent[a as usize].1;
        a = parent[a as usize].0;
    }
    (a, sign)
}

#[cfg(test)]
mod tests {
    use super::super::super::shapes::Random;
    use super::*;

    /// Ties between some of so many nodes, of random weights of both signs.
    fn random_ties(nodes: usize, share: f64, random: &mut Random) -> Ties {
        let mut ties = vec![BTreeMap::new(); nodes];
        for a in 0..nodes {
            for b in a + 1..nodes {
                if random.unit() < share {
                    tie(&mut ties, a, b, 2.0 * random.unit() - 1.0);
                }
            }
        }
        ties
    }

    fn tie(ties: &mut Ties, a: usize, b: usize, weight: f64) {
        ties[a].insert(b as u32, weight);
        ties[b].insert(a as u32, weight);
    }

    fn signs(nodes: usize, sign: impl Fn(usize) -> f32) -> Vec<(u32, f32)> {
        (0..nodes).map(|a| (0, sign(a))).collect()
    }

    /// The most that any signs satisfy, by trying all.
    fn most(rows: &Rows) -> f64 {
        let (n, bit) = (rows.len(), |bits: usize, a: usize| bits >> a & 1 == 1);
        let all = (0..1 << (n - 1)).map(|bits| signs(n, |a| if bit(bits, a) { -1.0 } else { 1.0 }));
        let all = all.map(|signs| satisfied(rows, &signs));
        all.fold(f64::MIN, f64::max)
    }

    #[test]
    fn few_nodes_get_the_best_signs_of_all() {
        let mut random = Random(5);
        let mut best = 0;
        for _ in 0..200 {
            let ties = random_ties(10, 0.6, &mut random);
            let rows = rows(&ties);
            let [contracted, found] = [contract(ties.clone()), satisfy(&ties)];
            let [contracted, found] = [contracted, found].map(|signs| satisfied(&rows, &signs));
            let most = most(&rows);
            assert!(contracted <= found + 1e-9 && found <= most + 1e-9);
            best += usize::from(found > most - 1e-9);
        }
        assert!(best >= 195, "{best}");
    }

    #[test]
    fn signs_that_most_ties_agree_on_are_found() {
        let mut random = Random(11);
        let mut contracted = 0;
        for _ in 0..20 {
            let n = 120;
            let planted: Vec<f32> = (0..n)
                .map(|_| (random.unit() - 0.5).signum() as f32)
                .collect();
            let mut ties = random_ties(n, 0.3, &mut random);
            for (a, tied) in ties.iter_mut().enumerate() {
                for (&b, weight) in tied {
                    // A third of the ties are wrong.
                    let (low, high) = (a.min(b as usize), a.max(b as usize));
                    let right = if (low * 31 + high * 17) % 3 == 0 {
                        -1.0
                    } else {
                        1.0
                    };
                    *weight = right * weight.abs() * f64::from(planted[a] * planted[b as usize]);
                }
            }
            let rows = rows(&ties);
            let target = satisfied(&rows, &signs(n, |a| planted[a])) - 1e-9;
            assert!(satisfied(&rows, &satisfy(&ties)) >= target);
            contracted += usize::from(satisfied(&rows, &contract(ties)) >= target);
        }
        assert!(contracted < 20, "{contracted}");
    }

    #[test]
    fn a_pair_turns_together_even_if_each_of_them_alone_loses() {
        // Both belong to the last node, but start against it.
        let mut ties = vec![BTreeMap::new(); 3];
        tie(&mut ties, 0, 1, 3.0);
        tie(&mut ties, 0, 2, 2.0);
        tie(&mut ties, 1, 2, 2.0);
        let mut outcome = [(0, -1.0), (0, -1.0), (0, 1.0)];
        improve(&rows(&ties), &mut outcome);
        assert_eq!(outcome, [(0, 1.0); 3]);
    }

    #[test]
    fn nodes_that_are_not_tied_to_the_last_one_are_a_cluster_of_their_own() {
        let mut ties = vec![BTreeMap::new(); 4];
        tie(&mut ties, 0, 1, -1.0);
        tie(&mut ties, 2, 3, -1.0);
        let outcome = satisfy(&ties);
        assert_eq!(outcome[0].0, outcome[1].0);
        assert_eq!(outcome[2].0, outcome[3].0);
        assert_ne!(outcome[0].0, outcome[3].0);
        assert_eq!(outcome[0].1, -outcome[1].1);
        assert_eq!(outcome[2].1, -outcome[3].1);
    }

    #[test]
    fn ties_that_agree_are_all_kept() {
        let mut random = Random(31);
        let n = 41;
        let signs: Vec<f64> = (0..n)
            .map(|_| if random.unit() < 0.5 { -1.0 } else { 1.0 })
            .collect();
        let mut ties = vec![BTreeMap::new(); n];
        for a in 0..n {
            for b in a + 1..n {
                // A path through all nodes, and some chords.
                if b == a + 1 || random.unit() < 0.1 {
                    let weight = signs[a] * signs[b] * (0.1 + random.unit());
                    tie(&mut ties, a, b, weight);
                }
            }
        }
        for outcome in [contract(ties.clone()), satisfy(&ties)] {
            for (&(cluster, sign), expected) in outcome.iter().zip(&signs) {
                assert_eq!(cluster, outcome[0].0);
                assert_eq!(f64::from(sign * outcome[0].1), expected * signs[0]);
            }
        }
    }

    #[test]
    fn many_weak_ties_outweigh_a_strong_one() {
        // 0 and 1 are strongly opposed; 2, 3 and 4 tie them together, each of them to both, more strongly
        // on the sum once they have gone to one of the two.
        let mut ties = vec![BTreeMap::new(); 5];
        tie(&mut ties, 0, 1, -2.0);
        for k in 2..5 {
            tie(&mut ties, 0, k, 3.0);
            tie(&mut ties, 1, k, 1.5);
        }
        let outcome = contract(ties);
        assert!(outcome.iter().all(|&node| node == outcome[0]));
    }
}
