//! Cosine transforms of lines by products with the matrix of cosines.
//!
//! `cos(πk(2j+1)/2n)` is even under `j → n−1−j` for even `k` and odd for odd `k`: each parity takes half the
//! multiplications. Forward, `Y_k` of even `k` are sums over `x_j + x_{n−1−j}`, those of odd `k` over
//! `x_j − x_{n−1−j}`. Backwards, with `E` and `O` the sums over even and odd `k`, `x_j = E_j + O_j` and
//! `x_{n−1−j} = E_j − O_j`.
//!
//! A group makes 64 rows of both parities for 64 lines, each unit 4 by 4 of them.

use cubecl::prelude::*;

use super::axis::{Lines, Products, cell_of_line};
use super::gain::{Gains, gain};
use crate::{Buffer, Device, Scalar};

/// Rows and lines of a tile.
const SIDE: usize = 64;

/// Units along a side of a tile.
const UNITS: usize = 16;

/// Rows and lines of a unit.
const OWN: usize = SIDE / UNITS;

/// Terms of the sums that are in shared memory at a time.
const DEPTH: usize = 16;

/// Distance in shared memory from one term to the next: not a multiple of the number of banks.
const PITCH: usize = SIDE + 1;

/// Above this many cells of a line, products of two of its places don't fit in 32 bits.
const LONG: usize = 46_340;

/// Above this many, a 256th of that doesn't, either.
pub(super) const LONGEST: usize = 741_455;

impl<T: Scalar> Products<T> {
    /// Lines → cosine transforms, times the gains.
    pub(super) fn forward<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        gains: Option<&Gains<T>>,
    ) {
        let Some(gains) = gains else {
            return self.multiply(device, lines, from, to, false);
        };
        let [_, ny, nz] = gains.shape;
        multiply_and_filter::launch::<T, R>(
            device.client(),
            groups(device, lines),
            CubeDim::new_1d((UNITS * UNITS) as u32),
            from.arg(),
            to.arg(),
            self.cosines.arg(),
            gains.spectrum.arg(),
            gains.gaussian.arg(),
            lines.n,
            lines.step,
            lines.count,
            ny,
            nz,
            kind(lines, false),
        );
    }

    /// Cosine transforms → lines times `2n`.
    pub(super) fn inverse<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
    ) {
        self.multiply(device, lines, from, to, true);
    }

    fn multiply<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        inverse: bool,
    ) {
        multiply::launch::<T, R>(
            device.client(),
            groups(device, lines),
            CubeDim::new_1d((UNITS * UNITS) as u32),
            from.arg(),
            to.arg(),
            self.cosines.arg(),
            lines.n,
            lines.step,
            lines.count,
            kind(lines, inverse),
        );
    }
}

/// A group for each tile.
fn groups<R: Runtime>(device: &Device<R>, lines: Lines) -> CubeCount {
    let tiles = lines.n.div_ceil(2).div_ceil(SIDE) * lines.count.div_ceil(SIDE);
    device.groups(tiles * UNITS * UNITS, (UNITS * UNITS) as u32)
}

/// What a kernel is compiled for.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
struct Kind {
    inverse: bool,
    /// Whether neighbors on a line are neighbors in memory, and then of neighboring units.
    contiguous: bool,
    long: bool,
}

fn kind(lines: Lines, inverse: bool) -> Kind {
    Kind {
        inverse,
        contiguous: lines.step == 1,
        long: lines.n > LONG,
    }
}

#[cube(launch)]
fn multiply<F: Float>(
    input: &Array<F>,
    output: &mut Array<F>,
    cosines: &Array<F>,
    n: usize,
    step: usize,
    count: usize,
    #[comptime] kind: Kind,
) {
    let tile = tile(n, step, count);
    let mut even = Array::<F>::new(OWN * OWN);
    let mut odd = Array::<F>::new(OWN * OWN);
    both_sums(input, cosines, &mut even, &mut odd, &tile, kind);
    #[unroll]
    for own in 0..OWN * OWN {
        let row = tile.row + own_row(own / OWN, kind);
        let line = tile.line + own_line(own % OWN, kind);
        if row < n.div_ceil(2) && line < count {
            if comptime!(kind.inverse) {
                let mirrored = n - 1 - row;
                output[cell_of_line(tile.n, tile.step, line, row)] = even[own] + odd[own];
                if mirrored != row {
                    output[cell_of_line(tile.n, tile.step, line, mirrored)] = even[own] - odd[own];
                }
            } else {
                output[cell_of_line(tile.n, tile.step, line, 2 * row)] = even[own];
                if 2 * row + 1 < n {
                    output[cell_of_line(tile.n, tile.step, line, 2 * row + 1)] = odd[own];
                }
            }
        }
    }
}

#[cube(launch)]
fn multiply_and_filter<F: Float>(
    input: &Array<F>,
    output: &mut Array<F>,
    cosines: &Array<F>,
    spectrum: &Array<F>,
    gaussian: &Array<F>,
    n: usize,
    step: usize,
    count: usize,
    ny: usize,
    nz: usize,
    #[comptime] kind: Kind,
) {
    let tile = tile(n, step, count);
    let mut even = Array::<F>::new(OWN * OWN);
    let mut odd = Array::<F>::new(OWN * OWN);
    both_sums(input, cosines, &mut even, &mut odd, &tile, kind);
    #[unroll]
    for own in 0..OWN * OWN {
        let row = tile.row + own_row(own / OWN, kind);
        let line = tile.line + own_line(own % OWN, kind);
        if row < n.div_ceil(2) && line < count {
            let k = 2 * row;
            let at = cell_of_line(tile.n, tile.step, line, k);
            output[at] = even[own] * gain(spectrum, gaussian, k, line, n, ny, nz);
            if k + 1 < n {
                output[at + step] = odd[own] * gain(spectrum, gaussian, k + 1, line, n, ny, nz);
            }
        }
    }
}

/// The rows and lines of a group.
#[derive(CubeType, Clone, Copy)]
struct Tile {
    /// Cells of a line.
    n: usize,
    /// Distance in memory between neighbors on a line.
    step: usize,
    /// Lines of the field.
    count: usize,
    /// First row: a place `j` backwards, half of a frequency `k` forward.
    row: usize,
    /// First line.
    line: usize,
}

#[cube]
fn tile(n: usize, step: usize, count: usize) -> Tile {
    let rows = n.div_ceil(2).div_ceil(SIDE);
    Tile {
        n,
        step,
        count,
        row: CUBE_POS % rows * SIDE,
        line: CUBE_POS / rows * SIDE,
    }
}

/// Row of the tile that is a unit's `i`th.
#[cube]
fn own_row(#[comptime] i: usize, #[comptime] kind: Kind) -> usize {
    let unit = UNIT_POS as usize;
    if comptime!(kind.contiguous) {
        unit % UNITS + UNITS * i
    } else {
        unit / UNITS + UNITS * i
    }
}

/// Line of the tile that is a unit's `i`th.
#[cube]
fn own_line(#[comptime] i: usize, #[comptime] kind: Kind) -> usize {
    let unit = UNIT_POS as usize;
    if comptime!(kind.contiguous) {
        unit / UNITS + UNITS * i
    } else {
        unit % UNITS + UNITS * i
    }
}

/// A unit's sums over terms of even and of odd frequency.
#[cube]
fn both_sums<F: Float>(
    input: &Array<F>,
    cosines: &Array<F>,
    even: &mut Array<F>,
    odd: &mut Array<F>,
    tile: &Tile,
    #[comptime] kind: Kind,
) {
    let mut left = SharedMemory::<F>::new(DEPTH * PITCH);
    let mut right = SharedMemory::<F>::new(DEPTH * PITCH);
    sums(
        input, cosines, even, &mut left, &mut right, tile, 0usize, kind,
    );
    sums(
        input, cosines, odd, &mut left, &mut right, tile, 1usize, kind,
    );
}

#[cube]
fn sums<F: Float>(
    input: &Array<F>,
    cosines: &Array<F>,
    sums: &mut Array<F>,
    left: &mut SharedMemory<F>,
    right: &mut SharedMemory<F>,
    tile: &Tile,
    #[comptime] parity: usize,
    #[comptime] kind: Kind,
) {
    #[unroll]
    for own in 0..OWN * OWN {
        sums[own] = F::new(0.0);
    }
    let mut terms = tile.n.div_ceil(2);
    if comptime!(kind.inverse) {
        terms = (tile.n + 1 - parity) / 2;
    }
    let mut first = 0usize.runtime();
    while first < terms {
        load_cosines(cosines, left, tile, first, terms, parity, kind);
        load_lines(input, right, tile, first, terms, parity, kind);
        sync_cube();
        for term in 0..DEPTH {
            add_products(sums, left, right, term * PITCH, kind);
        }
        sync_cube();
        first += DEPTH;
    }
}

/// Adds one term to the sums of a unit.
#[cube]
fn add_products<F: Float>(
    sums: &mut Array<F>,
    left: &SharedMemory<F>,
    right: &SharedMemory<F>,
    at: usize,
    #[comptime] kind: Kind,
) {
    let mut lines = Array::<F>::new(OWN);
    #[unroll]
    for i in 0..OWN {
        lines[i] = right[at + own_line(i, kind)];
    }
    #[unroll]
    for row in 0..OWN {
        let cosine = left[at + own_row(row, kind)];
        #[unroll]
        for line in 0..OWN {
            sums[row * OWN + line] += cosine * lines[line];
        }
    }
}

/// The matrix: terms from `first` on, of the rows of the tile.
#[cube]
fn load_cosines<F: Float>(
    cosines: &Array<F>,
    left: &mut SharedMemory<F>,
    tile: &Tile,
    first: usize,
    terms: usize,
    #[comptime] parity: usize,
    #[comptime] kind: Kind,
) {
    #[unroll]
    for part in 0..DEPTH * SIDE / (UNITS * UNITS) {
        let item = UNIT_POS as usize + part * UNITS * UNITS;
        let row = tile.row + item % SIDE;
        let term = first + item / SIDE;
        let mut value = F::new(0.0);
        if term < terms && row < tile.n.div_ceil(2) {
            if comptime!(kind.inverse) {
                let k = 2 * term + parity;
                value = cosines[angle(k, row, tile.n, kind)];
                if k == 0 {
                    value *= F::new(0.5);
                }
            } else {
                value = cosines[angle(2 * row + parity, term, tile.n, kind)];
            }
        }
        left[item / SIDE * PITCH + item % SIDE] = value;
    }
}

/// `k(2j+1)` modulo `4n`.
#[cube]
fn angle(k: usize, j: usize, n: usize, #[comptime] kind: Kind) -> usize {
    let odd = 2 * j + 1;
    if comptime!(kind.long) {
        let high = k / 256 * odd % (4 * n);
        (high * 256 + k % 256 * odd) % (4 * n)
    } else {
        k * odd % (4 * n)
    }
}

/// What the matrix is multiplied with: terms from `first` on, of the lines of the tile.
#[cube]
fn load_lines<F: Float>(
    input: &Array<F>,
    right: &mut SharedMemory<F>,
    tile: &Tile,
    first: usize,
    terms: usize,
    #[comptime] parity: usize,
    #[comptime] kind: Kind,
) {
    #[unroll]
    for part in 0..DEPTH * SIDE / (UNITS * UNITS) {
        let item = UNIT_POS as usize + part * UNITS * UNITS;
        let mut own_line = item % SIDE;
        let mut own_term = item / SIDE;
        if comptime!(kind.contiguous) {
            own_line = item / DEPTH;
            own_term = item % DEPTH;
        }
        let line = tile.line + own_line;
        let term = first + own_term;
        let mut value = F::new(0.0);
        if term < terms && line < tile.count {
            if comptime!(kind.inverse) {
                value = input[cell_of_line(tile.n, tile.step, line, 2 * term + parity)];
            } else {
                let mirrored = tile.n - 1 - term;
                value = input[cell_of_line(tile.n, tile.step, line, term)];
                if mirrored != term {
                    let other = input[cell_of_line(tile.n, tile.step, line, mirrored)];
                    if comptime!(parity == 0) {
                        value += other;
                    } else {
                        value -= other;
                    }
                }
            }
        }
        right[own_term * PITCH + own_line] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_long_lines_are_products_modulo_four_lines() {
        for n in [LONG + 1, 100_003, LONGEST] {
            let lines = Lines {
                n,
                step: 1,
                count: 1,
            };
            let kind = kind(lines, false);
            assert!(kind.long);
            for (k, j) in [
                (0, 5),
                (n - 1, n / 2),
                (n / 3, n / 5),
                (255, 1),
                (256, n - 1),
            ] {
                let plain = k as u128 * (2 * j as u128 + 1) % (4 * n as u128);
                assert_eq!(angle(k, j, n, kind) as u128, plain);
                // In 32 bits, the largest numbers on the way to it.
                let odd = u32::try_from(2 * j + 1).unwrap();
                let part = (k as u32 / 256).checked_mul(odd).unwrap();
                let high = (part % (4 * n as u32)).checked_mul(256).unwrap();
                assert!(high.checked_add(k as u32 % 256 * odd).is_some());
            }
        }
    }
}
