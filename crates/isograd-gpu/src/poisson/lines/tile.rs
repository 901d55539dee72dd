//! The lines of a group: which they are, and where they are in the field and in shared memory.

use cubecl::prelude::*;

use super::super::axis::cell_of_line;
use super::BLOCK;

/// The lines of a group: `pairs` of them from the first on, paired with as many behind those. In shared
/// memory, places of a line are `pairs` apart.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Tile {
    /// Cells of a line.
    pub(super) n: usize,
    /// Distance in memory between neighbors on a line.
    pub(super) step: usize,
    /// Lines of the field.
    pub(super) count: usize,
    pub(super) pairs: usize,
    pub(super) first: usize,
    /// Pair of a unit, where it stays with one: units go through its places from `begin` on by `stride`.
    pub(super) pair: usize,
    pub(super) begin: usize,
    pub(super) stride: usize,
    /// Whether neighbors on a line are neighbors in memory, or else cells of neighboring lines: the field
    /// is read and written in that order.
    #[cube(comptime)]
    pub(super) contiguous: bool,
}

#[cube]
pub(super) fn own_tile(
    n: usize,
    step: usize,
    count: usize,
    pairs: usize,
    #[comptime] contiguous: bool,
) -> Tile {
    let unit = UNIT_POS as usize;
    Tile {
        n,
        step,
        count,
        pairs,
        first: CUBE_POS * 2 * pairs,
        pair: unit % pairs,
        begin: unit / pairs,
        stride: BLOCK as usize / pairs,
        contiguous,
    }
}

/// Where a cell of a line is in the field.
#[cube]
fn cell(tile: &Tile, line: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        line * tile.n + j
    } else {
        cell_of_line(tile.n, tile.step, line, j)
    }
}

/// Where a place of a pair is in shared memory.
#[cube]
pub(super) fn place(tile: &Tile, pair: usize, j: usize) -> usize {
    j * tile.pairs + pair
}

/// The pair that a unit reads or writes first.
#[cube]
pub(super) fn first_pair(tile: &Tile) -> usize {
    if comptime!(tile.contiguous) {
        UNIT_POS as usize / tile.n
    } else {
        tile.pair
    }
}

/// The place of that.
#[cube]
pub(super) fn first_place(tile: &Tile) -> usize {
    if comptime!(tile.contiguous) {
        UNIT_POS as usize % tile.n
    } else {
        tile.begin
    }
}

/// The pair that a unit reads or writes after place `j` of this one.
#[cube]
pub(super) fn next_pair(tile: &Tile, pair: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let block = BLOCK as usize;
        let carry = j + block % tile.n >= tile.n;
        pair + block / tile.n + select(carry, 1, 0)
    } else {
        pair
    }
}

/// The place of that.
#[cube]
pub(super) fn next_place(tile: &Tile, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let next = j + BLOCK as usize % tile.n;
        select(next >= tile.n, next - tile.n, next)
    } else {
        j + tile.stride
    }
}

/// Even places first, then odd places backwards.
#[cube]
fn makhoul(j: usize, n: usize) -> usize {
    let odd = j % 2;
    select(odd == 1, n - j.div_ceil(2), j / 2)
}

/// Reads the tile into the first half of the shared memory. Lines that don't exist are 0.
#[cube]
pub(super) fn load<F: Float>(
    input: &Array<F>,
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    tile: &Tile,
    #[comptime] reorder: bool,
) {
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let mut to = j;
        if comptime!(reorder) {
            to = makhoul(j, tile.n);
        }
        let to = place(tile, pair, to);
        re[to] = read(input, tile, pair, j);
        im[to] = read(input, tile, pair + tile.pairs, j);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
    sync_cube();
}

/// Writes the lines, whose parts are exchanged, back from Makhoul order.
#[cube]
pub(super) fn store<F: Float>(
    output: &mut Array<F>,
    re: &SharedMemory<F>,
    im: &SharedMemory<F>,
    tile: &Tile,
    at: usize,
) {
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let from = at + place(tile, pair, makhoul(j, tile.n));
        write(output, tile, pair, j, im[from]);
        write(output, tile, pair + tile.pairs, j, re[from]);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
}

#[cube]
fn read<F: Float>(input: &Array<F>, tile: &Tile, line: usize, j: usize) -> F {
    let mut value = F::new(0.0);
    if tile.first + line < tile.count {
        value = input[cell(tile, tile.first + line, j)];
    }
    value
}

#[cube]
pub(super) fn write<F: Float>(output: &mut Array<F>, tile: &Tile, line: usize, j: usize, value: F) {
    if tile.first + line < tile.count {
        output[cell(tile, tile.first + line, j)] = value;
    }
}
