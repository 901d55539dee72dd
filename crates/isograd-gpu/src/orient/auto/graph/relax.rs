//! Evidence spreads along the couplings.

use cubecl::prelude::*;

use super::Graph;
use crate::device::check_length;
use crate::element::coupling::{self, NEIGHBORS, ROUNDS};
use crate::neighbors::BLOCK;
use crate::{Buffer, Device, Error};

/// Beliefs `(N,)` from evidence `(N,)`, both in −1..1 and in sorted order: repeated weighted means of what a point's
/// neighbors believe and its own evidence, held with its strength.
///
/// # Errors
/// [`Error::Length`], [`Error::TooLarge`].
pub fn relax<R: Runtime>(
    device: &Device<R>,
    graph: &Graph,
    evidence: &Buffer<f32>,
) -> Result<Buffer<f32>, Error> {
    let n = graph.len();
    check_length("the evidence", evidence, n)?;
    let (mut belief, mut next) = (device.empty(n)?, device.empty(n)?);
    if n == 0 {
        return Ok(belief);
    }
    for round in 0..ROUNDS {
        let before = if round == 0 { evidence } else { &belief };
        spread_beliefs::launch::<R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            graph.near.arg(),
            graph.coupling.arg(),
            evidence.arg(),
            before.arg(),
            next.arg(),
        );
        std::mem::swap(&mut belief, &mut next);
    }
    Ok(belief)
}

#[cube(launch)]
fn spread_beliefs(
    near: &Array<u32>,
    couplings: &Array<f32>,
    evidence: &Array<f32>,
    belief: &Array<f32>,
    next: &mut Array<f32>,
) {
    let p = ABSOLUTE_POS;
    if p < next.len() {
        let own = evidence[p];
        let mut sum = coupling::held(own);
        let mut weight = own.abs();
        for slot in 0..NEIGHBORS {
            let tie = couplings[NEIGHBORS * p + slot];
            sum += tie * belief[near[NEIGHBORS * p + slot] as usize];
            weight += tie.abs();
        }
        next[p] = coupling::belief(sum, weight);
    }
}
