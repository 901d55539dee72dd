//! Confidence in the signs that were found.
//!
//! Two things speak for a sign. One is the *belief*: evidence of the sample and of its neighborhood, from 0 to 1. Where a
//! hole lets light in, it is small, for right and wrong signs alike. The other is the *agreement* of the signs with the
//! couplings around the sample: that drops wherever one of two neighbors is wrong, whatever the evidence. Of the samples
//! with an agreement of 0.99, 0.5 % have wrong signs; of those with 0.95, 0.9 and 0.8, 5, 15 and 30 %, with and without
//! noise. Above a belief of 0.9 none has.
//!
//! The constants below were fitted to the wrong signs on the clouds of docs/orientation.md, which lists their shares by
//! confidence: an eighth below 0.1, less in each of the next classes, and 0.003 % from 0.9 on.

use super::graph::Graph;
use crate::parallel;

/// Belief that is worth half of a full one.
const HALF: f32 = 0.2;

/// Power of the agreement where there is no belief.
const POWER: f32 = 20.0;

/// Writes the confidence in the `(N,)` signs, from 0 to 1, for the `(N,)` beliefs in signs of +1.
pub(super) fn measure(graph: &Graph, sign: &[f32], belief: &[f32], confidence: &mut Vec<f32>) {
    let agreements = parallel::map(sign.len(), |p| agreement(graph, sign, p));
    let of_sample = |p: usize| {
        let near = &graph.near[p];
        let sum: f32 = near.iter().map(|&q| agreements[q as usize]).sum();
        let least = agreements[p].min(sum / near.len() as f32);
        combined(sign[p] * belief[p], least)
    };
    parallel::fill(confidence, sign.len(), of_sample);
}

/// Mean of the couplings of a sample that its sign and those of its neighbors satisfy, less those that they contradict,
/// from −1 to 1; 1 where nothing is coupled.
fn agreement(graph: &Graph, sign: &[f32], p: usize) -> f32 {
    let (mut signed, mut total) = (0.0, 0.0);
    for (&q, &coupling) in graph.near[p].iter().zip(&graph.coupling[p]) {
        signed += coupling * sign[p] * sign[q as usize];
        total += coupling.abs();
    }
    match total > 0.0 {
        true => signed / total,
        false => 1.0,
    }
}

/// The confidence for a belief in the sign, and the agreement around the sample.
fn combined(belief: f32, agreement: f32) -> f32 {
    let belief = belief.clamp(0.0, 1.0);
    let (square, half) = (belief * belief, HALF * HALF);
    let clear = square * (1.0 + half) / (square + half);
    clear * agreement.clamp(0.0, 1.0).powf(POWER * (1.0 - belief))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orient::graph::NEIGHBORS;

    /// Samples on a ring, each with its eight neighbors to either side.
    fn ring(n: u32) -> Graph {
        let near = |p: u32| {
            std::array::from_fn(|slot| match slot as u32 {
                slot @ 0..8 => (p + slot + 1) % n,
                slot => (p + n - (slot - 7)) % n,
            })
        };
        Graph {
            near: (0..n).map(near).collect(),
            coupling: vec![[1.0; NEIGHBORS]; n as usize],
            ..Graph::default()
        }
    }

    fn confidence(graph: &Graph, sign: &[f32], belief: &[f32]) -> Vec<f32> {
        let mut confidence = Vec::new();
        measure(graph, sign, belief, &mut confidence);
        confidence
    }

    #[test]
    fn weak_evidence_is_enough_where_all_signs_agree() {
        let found = confidence(&ring(100), &[1.0; 100], &[0.3; 100]);
        let expected = 0.09 * 1.04 / 0.13;
        assert!(found.iter().all(|c| (c - expected).abs() < 1e-6));
    }

    #[test]
    fn one_wrong_sign_is_doubtful_and_those_round_it_less_so_with_their_distance() {
        let (mut sign, belief) = (vec![1.0; 100], [0.5; 100]);
        sign[50] = -1.0;
        let found = confidence(&ring(100), &sign, &belief);
        assert_eq!(found[50], 0.0);
        assert!(found[49] < found[40] && found[40] < found[30]);
        assert_eq!(found[30], found[10]);
    }

    #[test]
    fn signs_without_belief_or_against_it_have_none() {
        let mut belief = vec![0.0; 50];
        belief[7] = -0.2;
        assert_eq!(confidence(&ring(50), &[1.0; 50], &belief), [0.0; 50]);
    }

    #[test]
    fn confidence_grows_with_belief_and_agreement() {
        let values = |k: i32| k as f32 / 20.0;
        for (a, b) in (0..20).flat_map(|a| (0..20).map(move |b| (values(a), values(b)))) {
            assert!(combined(a + 0.05, b) >= combined(a, b), "{a} {b}");
            assert!(combined(a, b + 0.05) >= combined(a, b), "{a} {b}");
        }
        assert_eq!(combined(1.0, 1.0), 1.0);
        assert_eq!(combined(2.0, 0.5), 1.0);
    }

    #[test]
    fn a_sample_without_couplings_keeps_what_its_belief_is_worth() {
        let mut graph = ring(50);
        graph.coupling.fill([0.0; NEIGHBORS]);
        let found = confidence(&graph, &[1.0; 50], &[0.2; 50]);
        assert!(found.iter().all(|c| (c - 0.52).abs() < 1e-6));
    }
}
