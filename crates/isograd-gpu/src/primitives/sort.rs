//! Orders of whole-number keys.

use cubecl::prelude::*;

use super::scan::exclusive_sum;
use crate::device::{Argument, launch};
use crate::{Buffer, Device, Error};

/// Bits of a key that one pass orders by.
const BITS: u32 = 8;

/// Values of a digit; and units of a group, and keys that it ranks: each unit has a key and a digit.
const BLOCK: usize = 1 << BITS;

/// Keys in ascending order, and where each was before.
pub struct Order {
    /// The keys.
    pub keys: Buffer<u32>,
    /// `places[i]` is the index that key `i` of the order had in the input.
    pub places: Buffer<u32>,
}

/// Orders `keys`, all below `limit`; equal ones stay in the order of the input (radix sort, from the lowest
/// digit).
pub fn order<R: Runtime>(
    device: &Device<R>,
    keys: &Buffer<u32>,
    limit: u32,
) -> Result<Order, Error> {
    let count = keys.len();
    let mut order = Order {
        keys: keys.clone(),
        places: as_they_are(device, count)?,
    };
    let mut shift = 0;
    while shift < 32 && (limit.saturating_sub(1) >> shift) > 0 {
        order = order.by_digit(device, shift)?;
        shift += BITS;
    }
    Ok(order)
}

/// `0, 1, 2 …`, so many of them.
pub(crate) fn as_they_are<R: Runtime>(
    device: &Device<R>,
    count: usize,
) -> Result<Buffer<u32>, Error> {
    let places = device.empty(count)?;
    launch!(device, count, BLOCK => fill_places(places));
    Ok(places)
}

/// Where each key below `limit` begins among ascending `keys`: `limit + 1` places, the last of them the
/// number of keys.
pub fn starts<R: Runtime>(
    device: &Device<R>,
    keys: &Buffer<u32>,
    limit: u32,
) -> Result<Buffer<u32>, Error> {
    let starts = device.empty(limit as usize + 1)?;
    launch!(device, starts.len(), BLOCK => fill_starts(keys, starts, keys.len() as u32));
    Ok(starts)
}

impl Order {
    /// Stable in the digit at `shift`: how many of each digit come before, by digit and then by block, and
    /// the rank within the block.
    fn by_digit<R: Runtime>(&self, device: &Device<R>, shift: u32) -> Result<Self, Error> {
        let count = self.keys.len();
        let blocks = count.div_ceil(BLOCK);
        let counts: Buffer<u32> = device.empty(blocks * BLOCK)?;
        let ranks: Buffer<u32> = device.empty(count)?;
        let digit = Digit {
            count: count as u32,
            blocks: blocks as u32,
            shift,
        };
        launch!(device, count, BLOCK => rank_digits(
            self.keys, ranks, counts, digit, BLOCK,
        ));
        let before = exclusive_sum(device, &counts)?;
        let next = Self {
            keys: device.empty(count)?,
            places: device.empty(count)?,
        };
        launch!(device, count, BLOCK => move_to_ranks(
            self.keys, self.places, ranks, before, next.keys, next.places, digit,
            BLOCK,
        ));
        Ok(next)
    }
}

/// A digit of keys that are ranked in blocks.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
struct Digit {
    /// Number of keys.
    count: u32,
    blocks: u32,
    /// Lowest bit of the digit.
    shift: u32,
}

impl<R: Runtime> Argument<R> for Digit {
    type Parameter = DigitLaunch<R>;

    fn argument(&self, _: &Device<R>) -> Self::Parameter {
        DigitLaunch::new(self.count, self.blocks, self.shift)
    }
}

#[cube(launch)]
fn fill_places(places: &mut Array<u32>) {
    if ABSOLUTE_POS < places.len() {
        places[ABSOLUTE_POS] = ABSOLUTE_POS as u32;
    }
}

/// The rank of each key among those of its block with the same digit, and how many the block has of each.
#[cube(launch)]
fn rank_digits(
    keys: &Array<u32>,
    ranks: &mut Array<u32>,
    counts: &mut Array<u32>,
    digit: Digit,
    #[comptime] block: usize,
) {
    let mut digits = SharedMemory::<u32>::new(block);
    let mut of_digit = SharedMemory::<u32>::new(block);
    let unit = UNIT_POS as usize;
    let at = CUBE_POS * block + unit;
    let is_key = at < digit.count as usize;
    // No digit, where there is no key.
    let mut own = (block as u32).runtime();
    if is_key {
        own = digit_of(keys[at], digit.shift, block);
    }
    digits[unit] = own;
    of_digit[unit] = 0u32;
    sync_cube();
    let mut rank = 0u32;
    let mut equal = 0u32;
    for other in 0..block {
        let same = select(digits[other] == own, 1u32, 0u32);
        equal += same;
        rank += select(other < unit, same, 0u32);
    }
    if is_key {
        ranks[at] = rank;
        if rank == 0u32 {
            of_digit[own as usize] = equal;
        }
    }
    sync_cube();
    if CUBE_POS < digit.blocks as usize {
        counts[unit * digit.blocks as usize + CUBE_POS] = of_digit[unit];
    }
}

/// The digit of a key, of so many values.
#[cube]
fn digit_of(key: u32, shift: u32, #[comptime] values: usize) -> u32 {
    (key >> shift) & (values as u32 - 1u32)
}

#[cube(launch)]
fn move_to_ranks(
    keys: &Array<u32>,
    places: &Array<u32>,
    ranks: &Array<u32>,
    before: &Array<u32>,
    new_keys: &mut Array<u32>,
    new_places: &mut Array<u32>,
    digit: Digit,
    #[comptime] block: usize,
) {
    if ABSOLUTE_POS < digit.count as usize {
        let key = keys[ABSOLUTE_POS];
        let of_block =
            digit_of(key, digit.shift, block) * digit.blocks + (ABSOLUTE_POS / block) as u32;
        let to = (before[of_block as usize] + ranks[ABSOLUTE_POS]) as usize;
        new_keys[to] = key;
        new_places[to] = places[ABSOLUTE_POS];
    }
}

#[cube(launch)]
fn fill_starts(keys: &Array<u32>, starts: &mut Array<u32>, count: u32) {
    if ABSOLUTE_POS < starts.len() {
        starts[ABSOLUTE_POS] = first_at_least(keys, 0u32, count, ABSOLUTE_POS as u32);
    }
}

/// The first of the places `begin..end` whose key is at least `key`, or `end`.
#[cube]
pub(crate) fn first_at_least(keys: &Array<u32>, begin: u32, end: u32, key: u32) -> u32 {
    let mut low = begin;
    let mut high = end;
    while low < high {
        let middle = low + (high - low) / 2u32;
        if keys[middle as usize] < key {
            low = middle + 1u32;
        } else {
            high = middle;
        }
    }
    low
}
