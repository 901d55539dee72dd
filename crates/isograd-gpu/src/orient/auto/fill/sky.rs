//! How much of the sky every free cell sees.
//!
//! From each cell a ray starts in each of the 26 directions to its neighbors; it is free if it leaves the grid without
//! meeting an occupied cell. The first cells of all rays of a direction are a bit each; what is found for so many cells is
//! joined with what the cell that far away has found, which doubles them, until the grid ends. No unit walks.

use cubecl::prelude::*;

use super::BLOCK;
use super::occupied::{Cells, Occupied};
use crate::element::sight::RAYS;
use crate::{Buffer, Device, Error};

/// Binary digits of the number of rays.
const DIGITS: usize = 5;

/// Most words of the rays that are followed at once.
const MOST_WORDS: usize = 1 << 23;

/// How many rays of each cell are free.
#[derive(Clone, Debug)]
pub struct Sky {
    /// `(words, 5)`: the binary digits of the numbers of the cells of a word, the lowest first.
    pub(super) digits: Buffer<u32>,
}

impl Sky {
    /// Follows the rays.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub fn new<R: Runtime>(device: &Device<R>, occupied: &Occupied) -> Result<Self, Error> {
        let words = occupied.words();
        let (client, dim) = (device.client(), CubeDim::new_1d(BLOCK));
        let (open, sky) = (
            device.empty(words)?,
            Self {
                digits: device.empty(DIGITS * words)?,
            },
        );
        let groups = device.groups(words, BLOCK);
        begin::launch::<R>(
            client,
            groups.clone(),
            dim,
            occupied.arg(),
            open.arg(),
            sky.digits.arg(),
        );
        let at_once = (MOST_WORDS / words.max(1)).clamp(1, RAYS);
        for first in (0..RAYS).step_by(at_once) {
            let rays = first..RAYS.min(first + at_once);
            let free = follow(device, occupied, &open, rays.clone())?;
            count_free::launch::<R>(
                client,
                groups.clone(),
                dim,
                free.arg(),
                sky.digits.arg(),
                rays.len() as u32,
            );
        }
        Ok(sky)
    }

    /// How many of the 26 rays of each of the `(nx, ny, nz)` cells of a grid are free; none of those of occupied cells.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub fn of_cells<R: Runtime>(
        &self,
        device: &Device<R>,
        occupied: &Occupied,
    ) -> Result<Buffer<u32>, Error> {
        let numbers = device.empty(occupied.shape().iter().product())?;
        free_of_cells::launch::<R>(
            device.client(),
            device.groups(numbers.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            occupied.arg(),
            self.digits.arg(),
            numbers.arg(),
        );
        Ok(numbers)
    }
}

/// `(rays, words)`: which rays of the cells of each word are free.
fn follow<R: Runtime>(
    device: &Device<R>,
    occupied: &Occupied,
    open: &Buffer<u32>,
    rays: std::ops::Range<usize>,
) -> Result<Buffer<u32>, Error> {
    let words = open.len();
    let units = rays.len() * words;
    let longest = occupied.shape().into_iter().max().unwrap_or(0);
    let (mut known, mut spare) = (open.clone(), None);
    let mut reach = 1;
    // Once at least: the first step makes as many copies as there are rays.
    while reach < longest.max(2) {
        let next = match spare {
            Some(spare) => spare,
            None => device.empty(units)?,
        };
        double_reach::launch::<R>(
            device.client(),
            device.groups(units, BLOCK),
            CubeDim::new_1d(BLOCK),
            occupied.arg(),
            known.arg(),
            next.arg(),
            rays.start as u32,
            reach as u32,
        );
        let last = std::mem::replace(&mut known, next);
        spare = (reach > 1).then_some(last);
        reach *= 2;
    }
    Ok(known)
}

/// Cells through which rays pass: the free ones, and all past the end of a row. No ray is counted yet.
#[cube(launch)]
fn begin(cells: &Cells, open: &mut Array<u32>, digits: &mut Array<u32>) {
    if ABSOLUTE_POS < open.len() {
        open[ABSOLUTE_POS] = !cells.bits[ABSOLUTE_POS];
        for digit in 0..DIGITS {
            digits[DIGITS * ABSOLUTE_POS + digit] = 0u32;
        }
    }
}

/// From which cells a ray is free for `reach` cells → for twice as many. One unit takes one word of one direction, from
/// number `first_ray` on; at first all directions have the same words.
#[cube(launch)]
fn double_reach(
    cells: &Cells,
    known: &Array<u32>,
    next: &mut Array<u32>,
    first_ray: u32,
    reach: u32,
) {
    if ABSOLUTE_POS < next.len() {
        let grid = cells.nx * cells.ny * cells.words;
        let word = ABSOLUTE_POS as u32 % grid;
        let ray = first_ray + ABSOLUTE_POS as u32 / grid;
        // Of the 27 cells round a cell, the one in the middle is left out.
        let to = ray + select(ray >= 13u32, 1u32, 0u32);
        let start = select(known.len() == next.len(), ABSOLUTE_POS as u32 - word, 0u32);
        let w = word % cells.words;
        let row = word / cells.words;
        let x = moved(row / cells.ny, to / 9u32, reach);
        let y = moved(row % cells.ny, to / 3u32 % 3u32, reach);
        let mut free = known[(start + word) as usize];
        if x < cells.nx && y < cells.ny {
            let from = start + (x * cells.ny + y) * cells.words;
            free &= moved_word(known, from, w, to % 3u32, reach, cells.words);
        }
        next[ABSOLUTE_POS] = free;
    }
}

/// A place along an axis, moved down (0), not at all (1) or up (2). Below the grid it is a very large number.
#[cube]
fn moved(place: u32, to: u32, by: u32) -> u32 {
    place + to * by - by
}

/// Word `w` of a row that begins at `from`, each bit being the one that is `by` cells lower (0), just there (1), or
/// higher (2). Outside the row, all are set.
#[cube]
fn moved_word(known: &Array<u32>, from: u32, w: u32, to: u32, by: u32, words: u32) -> u32 {
    let back = by.div_ceil(32u32);
    let mut first = w;
    let mut shift = 0u32;
    if to == 0u32 {
        first = w - back;
        shift = back * 32u32 - by;
    } else if to == 2u32 {
        first = w + by / 32u32;
        shift = by % 32u32;
    }
    let low = word_or_open(known, from, first, words);
    let high = word_or_open(known, from, first + 1u32, words);
    // By 32 less the shift, in two steps: a shift of 32 is none.
    (low >> shift) | ((high << 1u32) << (31u32 - shift))
}

#[cube]
fn word_or_open(known: &Array<u32>, from: u32, w: u32, words: u32) -> u32 {
    let mut word = 0xffff_ffffu32;
    if w < words {
        word = known[(from + w) as usize];
    }
    word
}

/// Adds the free rays of all cells of a word at once, digit by digit.
#[cube(launch)]
fn count_free(free: &Array<u32>, digits: &mut Array<u32>, rays: u32) {
    let words = digits.len() / DIGITS;
    if ABSOLUTE_POS < words {
        let mut sums = Array::<u32>::new(DIGITS);
        for digit in 0..DIGITS {
            sums[digit] = digits[DIGITS * ABSOLUTE_POS + digit];
        }
        for ray in 0..rays {
            let mut carry = free[ray as usize * words + ABSOLUTE_POS];
            #[unroll]
            for digit in 0..DIGITS {
                let sum = sums[digit];
                sums[digit] = sum ^ carry;
                carry &= sum;
            }
        }
        for digit in 0..DIGITS {
            digits[DIGITS * ABSOLUTE_POS + digit] = sums[digit];
        }
    }
}

/// How many rays of the cell at bit `lane` of a word are free.
#[cube]
pub(super) fn free_rays(digits: &Array<u32>, word: u32, lane: u32) -> u32 {
    let mut number = 0u32;
    for digit in 0..DIGITS {
        let bit = (digits[DIGITS * word as usize + digit] >> lane) & 1u32;
        number |= bit << (digit as u32);
    }
    number
}

#[cube(launch)]
fn free_of_cells(cells: &Cells, digits: &Array<u32>, numbers: &mut Array<u32>) {
    if ABSOLUTE_POS < numbers.len() {
        let row = ABSOLUTE_POS as u32 / cells.nz;
        let z = ABSOLUTE_POS as u32 % cells.nz;
        numbers[ABSOLUTE_POS] = free_rays(digits, row * cells.words + z / 32u32, z % 32u32);
    }
}
