//! Weighted sample elimination (C. Yuksel, "Sample Elimination for Generating Poisson Disk Sample Sets",
//! 2015): of many random samples, the most crowded is taken away until the wanted number is left.

use std::collections::BinaryHeap;

use isograd::neighbors::CellIndex;
use isograd_element::vector::dot;
use rayon::prelude::*;

use super::OVERSAMPLING;
use super::candidates::{Candidate, Drawn};

/// Exponent of the weight, and the two constants of the least distance that still counts (the paper's
/// α, β and γ).
const ALPHA: i32 = 8;
const BETA: f64 = 0.65;
const GAMMA: f64 = 1.5;

/// Samples whose normals part by more than this cosine lie on two sides of a thin part and do not
/// crowd each other. Across an edge of 90° they still do.
const FACING_AWAY: f64 = -0.5;

/// Samples that crowd each other, sorted so that neighbors in space are neighbors in memory.
struct Crowd {
    index: CellIndex<f64>,
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    /// Radius of the discs of each sample in the densest packing of the wanted number.
    radius: Vec<f64>,
    /// Distances below this share of the greatest count as if they were it.
    least: f64,
}

/// The `n` of the drawn points that are spread most evenly, in the order in which they were drawn.
pub(super) fn thinned(drawn: Drawn, n: usize) -> Vec<Candidate> {
    let mut candidates = drawn.candidates;
    if n < candidates.len() && n > 0 {
        let points: Vec<[f64; 3]> = candidates.iter().map(|c| c.position).collect();
        let order = CellIndex::new(&points).order().to_vec();
        let sorted: Vec<Candidate> = order.iter().map(|&i| candidates[i as usize]).collect();
        let mut kept = vec![false; candidates.len()];
        let crowd = Crowd::new(&sorted, drawn.weighted_area / n as f64);
        for (&i, keep) in order.iter().zip(crowd.thinned(n)) {
            kept[i as usize] = keep;
        }
        let mut kept = kept.into_iter();
        candidates.retain(|_| kept.next().unwrap_or(false));
    }
    candidates.truncate(n);
    candidates
}

impl Crowd {
    /// `area_each` is the area for each sample that is kept, where the density is 1.
    fn new(candidates: &[Candidate], area_each: f64) -> Self {
        let disc = |c: &Candidate| (area_each / c.density / (2.0 * 3.0f64.sqrt())).sqrt();
        let positions: Vec<[f64; 3]> = candidates.iter().map(|c| c.position).collect();
        Self {
            index: CellIndex::new(&positions),
            positions,
            normals: candidates.iter().map(|c| c.normal).collect(),
            radius: candidates.iter().map(disc).collect(),
            least: BETA * (1.0 - (1.0 / OVERSAMPLING as f64).powf(GAMMA)),
        }
    }

    /// Calls `visit` with every sample that crowds `i`, and how much: `(1 − d/2r)^α`, with `r` the
    /// smaller of the two radii, so that it is the same both ways.
    fn for_each_neighbor(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        let (normal, radius) = (self.normals[i], self.radius[i]);
        self.index
            .for_each_within(self.positions[i], 2.0 * radius, |j, square| {
                let share = square.sqrt() / (2.0 * radius.min(self.radius[j]));
                if j != i && share < 1.0 && dot(normal, self.normals[j]) >= FACING_AWAY {
                    visit(j, (1.0 - share.max(self.least)).powi(ALPHA));
                }
            });
    }

    fn crowding(&self, i: usize) -> f64 {
        let mut total = 0.0;
        self.for_each_neighbor(i, |_, weight| total += weight);
        total
    }

    /// Whether each sample is kept; `n` are.
    fn thinned(&self, n: usize) -> Vec<bool> {
        let count = self.positions.len();
        let mut crowding: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|i| self.crowding(i))
            .collect();
        let mut heap: BinaryHeap<u64> = (0..count).map(|i| entry(crowding[i], i)).collect();
        let mut kept = vec![true; count];
        let mut left = count;
        while left > n {
            let Some(top) = heap.pop() else { break };
            let i = top as u32 as usize;
            // Crowding only falls: an entry that is out of date goes back to where it belongs now.
            let now = entry(crowding[i], i);
            if now != top {
                heap.push(now);
                continue;
            }
            kept[i] = false;
            left -= 1;
            self.for_each_neighbor(i, |j, weight| {
                crowding[j] = (crowding[j] - weight).max(0.0);
            });
        }
        kept
    }
}

/// An entry of the heap, in the order of its weight, then of its index. Weights are not negative, so
/// that their bits are in their order.
fn entry(weight: f64, index: usize) -> u64 {
    u64::from((weight as f32).to_bits()) << 32 | index as u64
}
