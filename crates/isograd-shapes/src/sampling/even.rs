//! Weighted sample elimination (C. Yuksel, "Sample Elimination for Generating Poisson Disk Sample Sets",
//! 2015): of many random samples, the one of largest weight is removed until the requested number is left.

use std::collections::BinaryHeap;

use isograd::neighbors::CellIndex;
use isograd_element::vector::dot;
use rayon::prelude::*;

use super::OVERSAMPLING;
use super::candidates::{Candidate, Candidates};

/// Exponent of the weight, and the two constants of its lower bound on distances (the paper's α, β and γ).
const ALPHA: i32 = 8;
const BETA: f64 = 0.65;
const GAMMA: f64 = 1.5;

/// Samples whose normals have a smaller cosine lie on opposite sides of a thin part and have no weight for each
/// other. Across an edge of 90° they do.
const FACING_AWAY: f64 = -0.5;

/// Candidates with weights, sorted so that neighbors in space are neighbors in memory.
struct Elimination {
    index: CellIndex<f64>,
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    /// Radius of the disc of each sample in the densest packing of the requested number.
    radius: Vec<f64>,
    /// Lower bound of distances, relative to the disc's diameter.
    min_distance: f64,
}

/// Selects `n` evenly spread points, in the order in which they were drawn.
pub(super) fn eliminate(drawn: Candidates, n: usize) -> Vec<Candidate> {
    let mut candidates = drawn.candidates;
    if n < candidates.len() && n > 0 {
        let points: Vec<[f64; 3]> = candidates.iter().map(|c| c.position).collect();
        let order = CellIndex::new(&points).order().to_vec();
        let sorted: Vec<Candidate> = order.iter().map(|&i| candidates[i as usize]).collect();
        let mut kept = vec![false; candidates.len()];
        let elimination = Elimination::new(&sorted, drawn.weighted_area / n as f64);
        for (&i, keep) in order.iter().zip(elimination.kept(n)) {
            kept[i as usize] = keep;
        }
        let mut kept = kept.into_iter();
        candidates.retain(|_| kept.next().unwrap_or(false));
    }
    candidates.truncate(n);
    candidates
}

impl Elimination {
    /// `area_each` is the area per remaining sample where the density is 1.
    fn new(candidates: &[Candidate], area_each: f64) -> Self {
        let disc = |c: &Candidate| (area_each / c.density / (2.0 * 3.0f64.sqrt())).sqrt();
        let positions: Vec<[f64; 3]> = candidates.iter().map(|c| c.position).collect();
        Self {
            index: CellIndex::new(&positions),
            positions,
            normals: candidates.iter().map(|c| c.normal).collect(),
            radius: candidates.iter().map(disc).collect(),
            min_distance: BETA * (1.0 - (1.0 / OVERSAMPLING as f64).powf(GAMMA)),
        }
    }

    /// Calls `visit` with every neighbor of `i` and its weight `(1 − d/2r)^α`, symmetric with `r` the smaller
    /// of the two radii.
    fn for_each_neighbor(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        let (normal, radius) = (self.normals[i], self.radius[i]);
        self.index
            .for_each_within(self.positions[i], 2.0 * radius, |j, square| {
                let ratio = square.sqrt() / (2.0 * radius.min(self.radius[j]));
                if j != i && ratio < 1.0 && dot(normal, self.normals[j]) >= FACING_AWAY {
                    visit(j, (1.0 - ratio.max(self.min_distance)).powi(ALPHA));
                }
            });
    }

    fn weight(&self, i: usize) -> f64 {
        let mut total = 0.0;
        self.for_each_neighbor(i, |_, weight| total += weight);
        total
    }

    /// Whether each sample is kept; `n` are.
    fn kept(&self, n: usize) -> Vec<bool> {
        let count = self.positions.len();
        let mut weights: Vec<f64> = (0..count).into_par_iter().map(|i| self.weight(i)).collect();
        let mut heap: BinaryHeap<u64> = (0..count).map(|i| entry(weights[i], i)).collect();
        let mut kept = vec![true; count];
        let mut left = count;
        while left > n {
            let Some(top) = heap.pop() else { break };
            let i = top as u32 as usize;
            // Weights only decrease: an outdated entry is inserted again with its current weight.
            let now = entry(weights[i], i);
            if now != top {
                heap.push(now);
                continue;
            }
            kept[i] = false;
            left -= 1;
            self.for_each_neighbor(i, |j, weight| {
                weights[j] = (weights[j] - weight).max(0.0);
            });
        }
        kept
    }
}

/// An entry of the heap, ordered by weight, then by index: the bits of nonnegative numbers have the order of the
/// numbers.
fn entry(weight: f64, index: usize) -> u64 {
    u64::from((weight as f32).to_bits()) << 32 | index as u64
}
