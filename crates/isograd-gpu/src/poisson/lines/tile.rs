//! The lines of a group: which they are, and where they are in the field and in shared memory.

use cubecl::prelude::*;

use super::super::axis::{Lines, cell_of_line};
use super::{BLOCK, Layout, Tables};

/// The lines of a group: `pairs` of them from the first on, paired with as many behind those. In shared
/// memory, places of a line are `pairs` apart.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Tile {
    /// The lines of the field.
    pub(super) lines: Lines,
    /// Complex numbers of a Fourier transform: the cells of a line, or more for the chirp transform.
    pub(super) length: usize,
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
pub(super) fn own_tile<F: Float + CubeElement>(
    lines: &Lines,
    tables: &Tables<F>,
    #[comptime] layout: Layout,
) -> Tile {
    let unit = UNIT_POS as usize;
    let pairs = tables.pairs;
    Tile {
        lines: *lines,
        length: tables.length,
        pairs,
        first: CUBE_POS * 2 * pairs,
        pair: unit % pairs,
        begin: unit / pairs,
        stride: BLOCK as usize / pairs,
        contiguous: comptime!(layout.contiguous),
    }
}

/// Complex numbers of a tile in shared memory: two halves, from one to the other of which a pass goes.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Shared<F: Float> {
    pub(super) re: SharedMemory<F>,
    pub(super) im: SharedMemory<F>,
    /// Numbers of a half.
    #[cube(comptime)]
    pub(super) half: usize,
}

#[cube]
pub(super) fn new_shared<F: Float>(#[comptime] layout: Layout) -> Shared<F> {
    Shared::<F> {
        re: SharedMemory::<F>::new(comptime!(2 * layout.capacity)),
        im: SharedMemory::<F>::new(comptime!(2 * layout.capacity)),
        half: comptime!(layout.capacity),
    }
}

/// Where a cell of a line is in the field.
#[cube]
fn cell(tile: &Tile, line: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        line * tile.lines.n + j
    } else {
        cell_of_line(&tile.lines, line, j)
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
        UNIT_POS as usize / tile.lines.n
    } else {
        tile.pair
    }
}

/// The place that a unit reads or writes first.
#[cube]
pub(super) fn first_place(tile: &Tile) -> usize {
    if comptime!(tile.contiguous) {
        UNIT_POS as usize % tile.lines.n
    } else {
        tile.begin
    }
}

/// The pair that a unit reads or writes after place `j` of this one.
#[cube]
pub(super) fn next_pair(tile: &Tile, pair: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let block = BLOCK as usize;
        let carry = j + block % tile.lines.n >= tile.lines.n;
        pair + block / tile.lines.n + select(carry, 1, 0)
    } else {
        pair
    }
}

/// The place that a unit reads or writes after place `j`.
#[cube]
pub(super) fn next_place(tile: &Tile, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let next = j + BLOCK as usize % tile.lines.n;
        select(next >= tile.lines.n, next - tile.lines.n, next)
    } else {
        j + tile.stride
    }
}

/// Even places first, then odd places backward.
#[cube]
fn makhoul(j: usize, n: usize) -> usize {
    let odd = j % 2;
    select(odd == 1, n - j.div_ceil(2), j / 2)
}

/// Reads the tile into the first half of the shared memory. Lines that don't exist are 0.
#[cube]
pub(super) fn load<F: Float>(
    input: &Array<F>,
    shared: &mut Shared<F>,
    tile: &Tile,
    #[comptime] reorder: bool,
) {
    let items = tile.pairs * tile.lines.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let mut to = j;
        if comptime!(reorder) {
            to = makhoul(j, tile.lines.n);
        }
        let to = place(tile, pair, to);
        shared.re[to] = read(input, tile, pair, j);
        shared.im[to] = read(input, tile, pair + tile.pairs, j);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
    sync_cube();
}

/// Writes the lines, whose parts are exchanged, back from Makhoul order.
#[cube]
pub(super) fn store<F: Float>(output: &mut Array<F>, shared: &Shared<F>, tile: &Tile, at: usize) {
    let items = tile.pairs * tile.lines.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let from = at + place(tile, pair, makhoul(j, tile.lines.n));
        write(output, tile, pair, j, shared.im[from]);
        write(output, tile, pair + tile.pairs, j, shared.re[from]);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
}

#[cube]
fn read<F: Float>(input: &Array<F>, tile: &Tile, line: usize, j: usize) -> F {
    let mut value = F::new(0.0);
    if tile.first + line < tile.lines.count {
        value = input[cell(tile, tile.first + line, j)];
    }
    value
}

#[cube]
pub(super) fn write<F: Float>(output: &mut Array<F>, tile: &Tile, line: usize, j: usize, value: F) {
    if tile.first + line < tile.lines.count {
        output[cell(tile, tile.first + line, j)] = value;
    }
}
