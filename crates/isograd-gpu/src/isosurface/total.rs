//! Totals of the signs: four numbers, which are downloaded.

use cubecl::prelude::*;
use isograd::isosurface::Report;

use super::signs::{BLOCK, Bits, Signs, WORD, word_of};

use crate::device::launch;
use crate::primitives::reduce::{groups_for, sum_of_group};
use crate::{Buffer, Device, Error};

/// Numbers of cells inside, vertices and faces.
pub(super) struct Total {
    inside: usize,
    /// Bits 0 to 5: walls that inside cells touch, low before high, x before y before z. Bit 6: a value is not
    /// finite. Bit 7: the level is not.
    flags: u32,
    pub(super) vertices: usize,
    pub(super) faces: usize,
}

impl Total {
    /// Adds up the words. `vertices` and `faces` end with the totals of these.
    pub(super) fn new<R: Runtime>(
        device: &Device<R>,
        signs: &Bits,
        faults: &Buffer<u32>,
        vertices: &Buffer<u32>,
        faces: &Buffer<u32>,
    ) -> Result<Self, Error> {
        let groups = groups_for(signs.len());
        let partial: Buffer<u32> = device.empty(2 * groups)?;
        let total: Buffer<u32> = device.empty(4)?;
        launch!(device, [groups; BLOCK] => add_words(
            signs, faults, partial, groups as u32, BLOCK,
        ));
        launch!(device, [1; BLOCK] => add_groups(
            partial, vertices, faces, total, groups as u32, BLOCK,
        ));
        let total = device.download(&total)?;
        Ok(Self {
            inside: total[0] as usize,
            flags: total[1],
            vertices: total[2] as usize,
            faces: total[3] as usize,
        })
    }

    pub(super) fn bad_value(&self) -> bool {
        self.flags & 1 << 6 != 0
    }

    pub(super) fn bad_level(&self) -> bool {
        self.flags & 1 << 7 != 0
    }

    pub(super) fn report(&self) -> Report {
        let wall = |bit: usize| self.flags >> bit & 1 == 1;
        Report {
            touches_wall: self.flags & 63 != 0,
            walls: [0, 2, 4].map(|bit| [wall(bit), wall(bit + 1)]),
            inside: self.inside,
        }
    }
}

/// Which walls the inside cells of a word touch.
#[cube]
fn walls_of(signs: &Signs, row: u32, w: u32) -> u32 {
    let bits = word_of(signs, row, w);
    let i = row / signs.ny;
    let j = row % signs.ny;
    let last = signs.nz - 1u32;
    let mut walls = 0u32;
    if bits != 0u32 {
        walls |= select(i == 0u32, 1u32, 0u32);
        walls |= select(i + 1u32 == signs.nx, 2u32, 0u32);
        walls |= select(j == 0u32, 4u32, 0u32);
        walls |= select(j + 1u32 == signs.ny, 8u32, 0u32);
        if w == 0u32 {
            walls |= (bits & 1u32) << 4u32;
        }
        if w == last / WORD as u32 {
            walls |= ((bits >> (last % WORD as u32)) & 1u32) << 5u32;
        }
    }
    walls
}

#[cube(launch)]
fn add_words(
    signs: &Signs,
    faults: &Array<u32>,
    partial: &mut Array<u32>,
    groups: u32,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<u32>::new(block);
    let mut inside = 0u32;
    let mut flags = 0u32;
    let mut word = ABSOLUTE_POS as u32;
    while word < signs.nx * signs.ny * signs.words {
        let row = word / signs.words;
        let w = word % signs.words;
        inside += u32::count_ones(word_of(signs, row, w));
        flags |= walls_of(signs, row, w) | (faults[word as usize] << 6u32);
        word += groups * block as u32;
    }
    let sum = sum_of_group::<u32>(inside, &mut shared);
    let any = tree_or(&mut shared, flags, block);
    if UNIT_POS == 0u32 {
        partial[2 * CUBE_POS] = sum;
        partial[2 * CUBE_POS + 1] = any;
    }
}

#[cube(launch)]
fn add_groups(
    partial: &Array<u32>,
    vertices: &Array<u32>,
    faces: &Array<u32>,
    total: &mut Array<u32>,
    groups: u32,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<u32>::new(block);
    let mut inside = 0u32;
    let mut flags = 0u32;
    let mut group = UNIT_POS as usize;
    while group < groups as usize {
        inside += partial[2 * group];
        flags |= partial[2 * group + 1];
        group += block;
    }
    let sum = sum_of_group::<u32>(inside, &mut shared);
    let any = tree_or(&mut shared, flags, block);
    if UNIT_POS == 0u32 {
        total[0] = sum;
        total[1] = any;
        total[2] = vertices[vertices.len() - 1];
        total[3] = faces[faces.len() - 1];
    }
}

/// All bits that any unit of the group has set; all units must call it.
#[cube]
fn tree_or(shared: &mut SharedMemory<u32>, own: u32, #[comptime] block: usize) -> u32 {
    let unit = UNIT_POS as usize;
    // What was there may still be read.
    sync_cube();
    shared[unit] = own;
    sync_cube();
    let mut reach = (block / 2).runtime();
    while reach > 0 {
        if unit < reach {
            let other = shared[unit + reach];
            shared[unit] |= other;
        }
        sync_cube();
        reach /= 2;
    }
    shared[0]
}
