//! Cosine transforms of lines by the sums that define them, in `O(n²)` for a line: for lines that are longer than the
//! shared memory, and as an oracle of the fast transforms.

use cubecl::prelude::*;

use super::axis::{Lines, Sums};
use super::gain::{Gains, Spectrum, gain};
use crate::device::{Ready, launch};
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 256;

impl<T: Scalar> Sums<T> {
    /// Lines → cosine transforms; or, if `inverse`, cosine transforms → lines times `2n`.
    pub(super) fn transform<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        inverse: bool,
    ) {
        launch!(device, from.len(), BLOCK => sum_cosines<T>(
            from, to, self.cosines, lines, inverse,
        ));
    }
}

/// Multiplies the cosine transforms of a field by the gains.
pub(super) fn filter<R: Runtime, T: Scalar>(
    device: &Device<R>,
    from: &Buffer<T>,
    to: &Buffer<T>,
    gains: &Gains<T>,
) {
    launch!(device, from.len(), BLOCK => multiply_by_gains<T>(from, to, Ready::new(gains.arg())));
}

/// A unit for each result.
#[cube(launch)]
fn sum_cosines<F: Float>(
    input: &Array<F>,
    output: &mut Array<F>,
    cosines: &Array<F>,
    lines: &Lines,
    #[comptime] inverse: bool,
) {
    let at = ABSOLUTE_POS;
    if at < lines.n * lines.count {
        let own = at / lines.step % lines.n;
        let first = at - own * lines.step;
        // The angle of each term is so much beyond that of the term before, in quarters of `2π/n`.
        let turn = if comptime!(inverse) {
            2 * own + 1
        } else {
            2 * own
        };
        let start = if comptime!(inverse) {
            0usize.runtime()
        } else {
            own
        };
        let weight = if comptime!(inverse) {
            F::new(1.0)
        } else {
            cosines[own]
        };
        let mut sum = input[first] * weight;
        let mut angle = start + turn;
        for term in 1..lines.n {
            if angle >= 4 * lines.n {
                angle -= 4 * lines.n;
            }
            sum += input[first + term * lines.step] * cosines[angle];
            angle += turn;
        }
        output[at] = sum;
    }
}

#[cube(launch)]
fn multiply_by_gains<F: Float + CubeElement>(
    input: &Array<F>,
    output: &mut Array<F>,
    gains: &Spectrum<F>,
) {
    let at = ABSOLUTE_POS;
    let lines = gains.ny * gains.nz;
    if at < gains.nx * lines {
        output[at] = input[at] * gain(gains, at / lines, at % lines);
    }
}
