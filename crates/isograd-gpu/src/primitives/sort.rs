//! Orders of whole-number keys.

use cubecl::prelude::*;

use super::scan::exclusive_sum;
use crate::{Buffer, Device, Error};

/// Units of a group, and keys that it ranks.
const BLOCK: usize = 256;

/// Bits of a key that one pass orders by, and the number of their values.
const BITS: u32 = 4;
const DIGITS: usize = 1 << BITS;

/// Keys in ascending order, and where each was before.
pub struct Order {
    /// The keys.
    pub keys: Buffer<u32>,
    /// `places[i]` is the index that key `i` of the order had in the input.
    pub places: Buffer<u32>,
}

/// Orders `keys`, all below `limit`; equal ones stay in the order of the input (radix sort, from the lowest
/// digit).
///
/// # Errors
/// [`Error::TooLarge`].
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
    let (groups, dim) = (
        device.groups(count, BLOCK as u32),
        CubeDim::new_1d(BLOCK as u32),
    );
    fill_places::launch::<R>(device.client(), groups, dim, places.arg());
    Ok(places)
}

/// Where each key below `limit` begins among ascending `keys`: `limit + 1` places, the last of them the
/// number of keys.
///
/// # Errors
/// [`Error::TooLarge`].
pub fn starts<R: Runtime>(
    device: &Device<R>,
    keys: &Buffer<u32>,
    limit: u32,
) -> Result<Buffer<u32>, Error> {
    let starts = device.empty(limit as usize + 1)?;
    fill_starts::launch::<R>(
        device.client(),
        device.groups(starts.len(), BLOCK as u32),
        CubeDim::new_1d(BLOCK as u32),
        keys.arg(),
        starts.arg(),
        keys.len() as u32,
    );
    Ok(starts)
}

impl Order {
    /// Stable in the digit at `shift`: how many of each digit come before, by digit and then by block, and
    /// the rank within the block.
    fn by_digit<R: Runtime>(&self, device: &Device<R>, shift: u32) -> Result<Self, Error> {
        let count = self.keys.len();
        let blocks = count.div_ceil(BLOCK);
        let counts: Buffer<u32> = device.empty(blocks * DIGITS)?;
        let ranks: Buffer<u32> = device.empty(count)?;
        let dim = CubeDim::new_1d(BLOCK as u32);
        let groups = device.groups(count, BLOCK as u32);
        rank_digits::launch::<R>(
            device.client(),
            groups.clone(),
            dim,
            self.keys.arg(),
            ranks.arg(),
            counts.arg(),
            count as u32,
            blocks as u32,
            shift,
            BLOCK,
        );
        let before = exclusive_sum(device, &counts)?;
        let next = Self {
            keys: device.empty(count)?,
            places: device.empty(count)?,
        };
        move_to_ranks::launch::<R>(
            device.client(),
            groups,
            dim,
            self.keys.arg(),
            self.places.arg(),
            ranks.arg(),
            before.arg(),
            next.keys.arg(),
            next.places.arg(),
            count as u32,
            blocks as u32,
            shift,
            BLOCK,
        );
        Ok(next)
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
    count: u32,
    blocks: u32,
    shift: u32,
    #[comptime] block: usize,
) {
    let mut digits = SharedMemory::<u32>::new(block);
    let unit = UNIT_POS as usize;
    let first = CUBE_POS * block;
    let at = first + unit;
    let mut own = 16u32;
    if at < count as usize {
        own = (keys[at] >> shift) & 15u32;
    }
    digits[unit] = own;
    sync_cube();
    if at < count as usize {
        let mut rank = 0u32;
        for other in 0..unit {
            if digits[other] == own {
                rank += 1u32;
            }
        }
        ranks[at] = rank;
    }
    if unit < 16 && CUBE_POS < blocks as usize {
        let mut of_digit = 0u32;
        for other in 0..block {
            if digits[other] == unit as u32 {
                of_digit += 1u32;
            }
        }
        counts[unit * blocks as usize + CUBE_POS] = of_digit;
    }
}

#[cube(launch)]
fn move_to_ranks(
    keys: &Array<u32>,
    places: &Array<u32>,
    ranks: &Array<u32>,
    before: &Array<u32>,
    new_keys: &mut Array<u32>,
    new_places: &mut Array<u32>,
    count: u32,
    blocks: u32,
    shift: u32,
    #[comptime] block: usize,
) {
    if ABSOLUTE_POS < count as usize {
        let key = keys[ABSOLUTE_POS];
        let digit = (key >> shift) & 15u32;
        let of_block = digit * blocks + (ABSOLUTE_POS / block) as u32;
        let to = (before[of_block as usize] + ranks[ABSOLUTE_POS]) as usize;
        new_keys[to] = key;
        new_places[to] = places[ABSOLUTE_POS];
    }
}

/// By bisection: the number of keys below each whole number.
#[cube(launch)]
fn fill_starts(keys: &Array<u32>, starts: &mut Array<u32>, count: u32) {
    if ABSOLUTE_POS < starts.len() {
        let mut low = 0u32;
        let mut high = count;
        while low < high {
            let middle = (low + high) / 2u32;
            if keys[middle as usize] < ABSOLUTE_POS as u32 {
                low = middle + 1u32;
            } else {
                high = middle;
            }
        }
        starts[ABSOLUTE_POS] = low;
    }
}
