//! Which cells are inside, one bit a cell, and what follows from these bits alone: the crossed edges, the case of
//! each cube, the number of each vertex.
//!
//! Bit `k % 32` of word `k / 32` of row `(i, j)` is set where cell `(i, j, k)` is inside. Bits past the end of a row
//! are not set.

use cubecl::prelude::*;

use crate::device::{Argument, launch};
pub(super) use crate::primitives::reduce::BLOCK;
use crate::{Buffer, Device, Error, Scalar};

/// Cells in one word.
pub(super) const WORD: usize = 32;

/// Units that one kernel may have: the numbers of those in the last group must fit in 32 bits.
const MOST_UNITS: usize = u32::MAX as usize - (1 << 25);

/// The signs of a field on the device.
#[derive(Clone)]
pub(super) struct Bits {
    bits: Buffer<u32>,
    shape: [usize; 3],
    words: usize,
}

impl Bits {
    /// The signs of `(nx, ny, nz)` values about a level, and for every word what is wrong with it: bit 0 is set
    /// where a value is not finite, bit 1 where the level is not.
    pub(super) fn new<R: Runtime, T: Scalar>(
        device: &Device<R>,
        chi: &Buffer<T>,
        level: &Buffer<T>,
        shape: [usize; 3],
    ) -> Result<(Self, Buffer<u32>), Error> {
        let [nx, ny, nz] = shape;
        let words = nz.div_ceil(WORD);
        let units = nx * ny * words * WORD;
        // The numbers of units, and those of lattice edges, are 32-bit.
        let most = MOST_UNITS.min(u32::MAX as usize / 3);
        if units > MOST_UNITS || nx * ny * nz > most {
            let size = size_of::<T>() as u64;
            return Err(Error::TooLarge {
                device: device.name().to_owned(),
                bytes: units as u64 * size,
                limit: most as u64 * size,
            });
        }
        let signs = Self {
            bits: device.empty(nx * ny * words)?,
            shape,
            words,
        };
        let faults = device.empty(signs.len())?;
        launch!(device, units, BLOCK => pack<T>(
            chi, level, signs.bits, faults, nz as u32, words as u32, BLOCK,
        ));
        Ok((signs, faults))
    }

    /// Number of words.
    pub(super) fn len(&self) -> usize {
        self.shape[0] * self.shape[1] * self.words
    }

    /// Units of a kernel with one for every bit of every word.
    pub(super) fn units(&self) -> usize {
        self.len() * WORD
    }
}

impl<R: Runtime> Argument<R> for Bits {
    type Parameter = SignsLaunch<R>;

    fn argument(&self, _: &Device<R>) -> SignsLaunch<R> {
        let [nx, ny, nz] = self.shape.map(|n| n as u32);
        SignsLaunch::new(self.bits.arg(), nx, ny, nz, self.words as u32)
    }
}

/// The bits, in a kernel.
#[derive(CubeType, CubeLaunch)]
pub struct Signs {
    bits: Array<u32>,
    pub nx: u32,
    pub ny: u32,
    pub nz: u32,
    pub words: u32,
}

#[cube(launch)]
fn pack<F: Float>(
    chi: &Array<F>,
    level: &Array<F>,
    bits: &mut Array<u32>,
    faults: &mut Array<u32>,
    nz: u32,
    words: u32,
    #[comptime] block: usize,
) {
    // One place is left free after each word, so that units that read whole words read from different banks.
    let mut shared = SharedMemory::<u32>::new(block + block / 32);
    let unit = UNIT_POS as usize;
    let word = ABSOLUTE_POS as u32 / 32u32;
    let row = word / words;
    let k = (word % words) * 32u32 + ABSOLUTE_POS as u32 % 32u32;
    let mut own = 0u32;
    if (word as usize) < bits.len() && k < nz {
        let c = level[0];
        let value = chi[(row * nz + k) as usize];
        if value < c {
            own = 1u32;
        }
        own |= not_finite::<F>(value) << 1u32;
        own |= not_finite::<F>(c) << 2u32;
    }
    shared[unit + unit / 32] = own;
    sync_cube();
    let to = CUBE_POS * (block / 32) + unit;
    if unit < block / 32 && to < bits.len() {
        let mut packed = 0u32;
        let mut fault = 0u32;
        for lane in 0..32usize {
            let of_cell = shared[unit * 33 + lane];
            packed |= (of_cell & 1u32) << (lane as u32);
            fault |= of_cell >> 1u32;
        }
        bits[to] = packed;
        faults[to] = fault;
    }
}

/// 1 for NaN and the infinities, else 0.
#[cube]
pub(super) fn not_finite<F: Float>(x: F) -> u32 {
    u32::cast_from(F::is_nan(x)) | u32::cast_from(F::is_inf(x))
}

/// Which of the lattice edges that start from the cells of a word are crossed, per axis.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Crossed {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) z: u32,
}

/// The cubes whose low corners are the cells of a word: which cells are their eight corners.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Cubes {
    a: u32,
    b: u32,
    c: u32,
    d: u32,
    e: u32,
    f: u32,
    g: u32,
    h: u32,
    /// Those that have corners on both sides.
    pub(super) active: u32,
}

/// Word `w` of a row.
#[cube]
pub(super) fn word_of(signs: &Signs, row: u32, w: u32) -> u32 {
    signs.bits[(row * signs.words + w) as usize]
}

/// 1 where cell `k` of a row is inside, else 0.
#[cube]
pub(super) fn inside(signs: &Signs, row: u32, k: u32) -> u32 {
    (word_of(signs, row, k / 32u32) >> (k % 32u32)) & 1u32
}

/// Word `w` of a row, every bit moved down by one cell.
#[cube]
fn moved_down(signs: &Signs, row: u32, w: u32) -> u32 {
    let mut next = 0u32;
    if w + 1u32 < signs.words {
        next = word_of(signs, row, w + 1u32);
    }
    (word_of(signs, row, w) >> 1u32) | (next << 31u32)
}

/// The cells of word `w` that have a neighbor above them in the row.
#[cube]
fn have_next(signs: &Signs, w: u32) -> u32 {
    let after = signs.nz - 1u32 - w * 32u32;
    select(
        after >= 32u32,
        0xffff_ffffu32,
        (1u32 << (after & 31u32)) - 1u32,
    )
}

#[cube]
pub(super) fn crossed(signs: &Signs, row: u32, w: u32) -> Crossed {
    let own = word_of(signs, row, w);
    let mut x = 0u32;
    let mut y = 0u32;
    if row / signs.ny + 1u32 < signs.nx {
        x = own ^ word_of(signs, row + signs.ny, w);
    }
    if row % signs.ny + 1u32 < signs.ny {
        y = own ^ word_of(signs, row + 1u32, w);
    }
    let z = (own ^ moved_down(signs, row, w)) & have_next(signs, w);
    Crossed { x, y, z }
}

/// How many of the edges are crossed that start from the cells of a mask.
#[cube]
pub(super) fn count_crossed(crossed: Crossed, mask: u32) -> u32 {
    u32::count_ones(crossed.x & mask)
        + u32::count_ones(crossed.y & mask)
        + u32::count_ones(crossed.z & mask)
}

/// Whether the edges along x, y, z from bit `lane` of the word are crossed, 1 or 0.
#[cube]
pub(super) fn at_lane(crossed: Crossed, lane: u32) -> Crossed {
    Crossed {
        x: (crossed.x >> lane) & 1u32,
        y: (crossed.y >> lane) & 1u32,
        z: (crossed.z >> lane) & 1u32,
    }
}

/// The number of the vertex on the edge along `axis` from cell `k` of a row, if that is crossed: vertices are
/// counted in the order of cells, then axes.
#[cube]
pub(super) fn vertex_on(signs: &Signs, before: &Array<u32>, row: u32, k: u32, axis: u32) -> u32 {
    let w = k / 32u32;
    let lane = k % 32u32;
    let of_word = crossed(signs, row, w);
    let own = at_lane(of_word, lane);
    let mut number =
        before[(row * signs.words + w) as usize] + count_crossed(of_word, (1u32 << lane) - 1u32);
    if axis > 0u32 {
        number += own.x;
    }
    if axis > 1u32 {
        number += own.y;
    }
    number
}

#[cube]
pub(super) fn cubes(signs: &Signs, row: u32, w: u32) -> Cubes {
    let mut cubes = Cubes {
        a: 0u32,
        b: 0u32,
        c: 0u32,
        d: 0u32,
        e: 0u32,
        f: 0u32,
        g: 0u32,
        h: 0u32,
        active: 0u32,
    };
    if row / signs.ny + 1u32 < signs.nx && row % signs.ny + 1u32 < signs.ny {
        cubes.a = word_of(signs, row, w);
        cubes.b = moved_down(signs, row, w);
        cubes.c = word_of(signs, row + 1u32, w);
        cubes.d = moved_down(signs, row + 1u32, w);
        cubes.e = word_of(signs, row + signs.ny, w);
        cubes.f = moved_down(signs, row + signs.ny, w);
        cubes.g = word_of(signs, row + signs.ny + 1u32, w);
        cubes.h = moved_down(signs, row + signs.ny + 1u32, w);
        let any = cubes.a | cubes.b | cubes.c | cubes.d | cubes.e | cubes.f | cubes.g | cubes.h;
        let all = cubes.a & cubes.b & cubes.c & cubes.d & cubes.e & cubes.f & cubes.g & cubes.h;
        cubes.active = any & !all & have_next(signs, w);
    }
    cubes
}

/// The sign pattern of the cube at bit `lane`.
#[cube]
pub(super) fn case_of(cubes: &Cubes, lane: u32) -> u32 {
    ((cubes.a >> lane) & 1u32)
        | (((cubes.b >> lane) & 1u32) << 1u32)
        | (((cubes.c >> lane) & 1u32) << 2u32)
        | (((cubes.d >> lane) & 1u32) << 3u32)
        | (((cubes.e >> lane) & 1u32) << 4u32)
        | (((cubes.f >> lane) & 1u32) << 5u32)
        | (((cubes.g >> lane) & 1u32) << 6u32)
        | (((cubes.h >> lane) & 1u32) << 7u32)
}
