//! The median of the positive ones among some numbers.

use cubecl::prelude::*;

use super::BLOCK;
use super::order::{gather, ordered_bits};
use crate::device::launch;
use crate::primitives::sort::{as_they_are, order};
use crate::{Buffer, Device, Error, Scalar};

/// The median, the upper one of two, of the positive ones among numbers from 0 to `largest`; 0 where there are none.
pub(super) fn of_positive<R: Runtime, T: Scalar>(
    device: &Device<R>,
    numbers: &Buffer<T>,
    largest: f64,
) -> Result<T, Error> {
    let n = numbers.len();
    // Numbers in double precision are told apart by three words, down to 2⁻⁷² of the largest.
    let (words, scale) = match T::NAME {
        "f32" => (1u32, 1.0),
        _ => (3, (-largest.log2().ceil()).exp2()),
    };
    let mut list = as_they_are(device, n)?;
    for word in (0..words).rev() {
        let keys = device.empty(n)?;
        launch!(device, n, BLOCK => fill_words<T>(
            numbers, list, keys, <T as isograd::Real>::of(scale), word,
        ));
        let by_word = order(device, &keys, u32::MAX)?.places;
        list = gather(device, &list, &by_word, 1)?;
    }
    let median: Buffer<T> = device.empty(1)?;
    launch!(device, 1, BLOCK => take_median<T>(numbers, list, median));
    Ok(device.download(&median)?[0])
}

/// A word of each number in a list: what is left of it after the words before, as bits whose order is that of the
/// numbers.
#[cube(launch)]
fn fill_words<F: Float + CubeElement>(
    numbers: &Array<F>,
    list: &Array<u32>,
    keys: &mut Array<u32>,
    scale: F,
    word: u32,
) {
    if ABSOLUTE_POS < keys.len() {
        let mut rest = numbers[list[ABSOLUTE_POS] as usize] * scale;
        let mut part = f32::cast_from(rest);
        for _ in 0..word {
            rest -= F::cast_from(part);
            part = f32::cast_from(rest);
        }
        // Both zeros are equal.
        keys[ABSOLUTE_POS] = ordered_bits(select(part == 0.0f32, 0.0f32, part));
    }
}

/// The median of the positive ones among numbers in the ascending order that `list` gives.
#[cube(launch)]
fn take_median<F: Float>(numbers: &Array<F>, list: &Array<u32>, median: &mut Array<F>) {
    if ABSOLUTE_POS < median.len() {
        let n = list.len();
        let mut first = 0usize.runtime();
        let mut end = list.len();
        while first < end {
            let middle = first + (end - first) / 2;
            if numbers[list[middle] as usize] > F::new(0.0) {
                end = middle;
            } else {
                first = middle + 1;
            }
        }
        let mut found = F::new(0.0);
        if first < n {
            found = numbers[list[first + (n - first) / 2] as usize];
        }
        median[ABSOLUTE_POS] = found;
    }
}
