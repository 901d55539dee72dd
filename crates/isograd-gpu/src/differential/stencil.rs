//! Finite differences along lines of cells, and their transposes: the stencils of the CPU's stage.
//!
//! A difference is `Σ_t w_t (u_t − u)`, neighbors less the cell's own value.

use cubecl::prelude::*;

use crate::element::difference::{first_inward, second_inward};
use crate::grid::{Lattice, cell_at};

/// The line of cells along one axis that goes through a cell.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Line {
    /// Place in memory of its first cell.
    start: usize,
    /// Number of the cell on the line, and how many there are.
    i: usize,
    n: usize,
    /// From one to the next in memory.
    stride: usize,
}

#[cube]
impl Line {
    /// Place in memory of cell `i` of the line.
    pub fn at(self, i: usize) -> usize {
        self.start + i * self.stride
    }

    /// The line through cell `i` of another one, beside this one.
    pub fn through(self, other: Self, i: usize) -> Self {
        Line {
            start: self.start + i * other.stride - other.i * other.stride,
            i: self.i,
            n: self.n,
            stride: self.stride,
        }
    }

    /// The same line in the array that begins so many numbers further on.
    pub fn further(self, offset: usize) -> Self {
        Line {
            start: self.start + offset,
            i: self.i,
            n: self.n,
            stride: self.stride,
        }
    }
}

/// The lines through a cell.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Lines {
    pub x: Line,
    pub y: Line,
    pub z: Line,
}

/// The lines through the cell at a place in memory.
#[cube]
pub(super) fn lines<F: Float + CubeElement>(at: usize, grid: &Lattice<F>) -> Lines {
    let cell = cell_at(at as u32, grid.ny, grid.nz);
    let (i, j, k) = (cell.i as usize, cell.j as usize, cell.k as usize);
    let row = grid.nz as usize;
    let plane = grid.ny as usize * row;
    Lines {
        x: Line {
            start: at - i * plane,
            i,
            n: grid.nx as usize,
            stride: plane,
        },
        y: Line {
            start: at - j * row,
            i: j,
            n: grid.ny as usize,
            stride: row,
        },
        z: Line {
            start: at - k,
            i: k,
            n: row,
            stride: 1usize,
        },
    }
}

/// The cell `step`s inward of an end; the other end where the line is shorter.
#[cube]
fn inward(end: usize, n: usize, step: usize) -> usize {
    let steps = min(step, n - 1usize);
    select(end == 0usize, steps, end - min(steps, end))
}

/// Weight of the cell `step`s inward in the difference at an end.
#[cube]
fn weight_inward<F: Float>(end: usize, n: usize, step: usize, #[comptime] second: bool) -> F {
    if comptime!(second) {
        second_inward::<F>(n, step)
    } else {
        let side = select(end == 0usize, F::new(1.0), F::new(-1.0));
        first_inward::<F>(n, step, side)
    }
}

/// What the cell above and the one below weigh in a central difference.
#[cube]
fn central<F: Float>(above: F, below: F, #[comptime] second: bool) -> F {
    if comptime!(second) {
        above + below
    } else {
        F::new(0.5) * above - F::new(0.5) * below
    }
}

/// The first or second difference of `values` at the cell of a line, in units of cells.
#[cube]
pub(super) fn difference<F: Float>(values: &Array<F>, line: Line, #[comptime] second: bool) -> F {
    let own = values[line.at(line.i)];
    let mut sum = F::new(0.0);
    if line.i > 0usize && line.i + 1usize < line.n {
        let above = values[line.at(line.i + 1usize)] - own;
        let below = values[line.at(line.i - 1usize)] - own;
        sum = central::<F>(above, below, second);
    } else {
        for step in 1usize..4usize {
            let place = inward(line.i, line.n, step);
            let weight = weight_inward::<F>(line.i, line.n, step, second);
            sum += weight * (values[line.at(place)] - own);
        }
    }
    sum
}

/// The first difference along `outer` of the first differences along `inner`.
#[cube]
pub(super) fn mixed_difference<F: Float>(values: &Array<F>, outer: Line, inner: Line) -> F {
    let mut sum = F::new(0.0);
    if outer.i > 0usize && outer.i + 1usize < outer.n {
        // What the cell itself has drops out.
        let above = inner.through(outer, outer.i + 1usize);
        let below = inner.through(outer, outer.i - 1usize);
        sum = central::<F>(
            difference::<F>(values, above, false),
            difference::<F>(values, below, false),
            false,
        );
    } else {
        let own = difference::<F>(values, inner, false);
        for step in 1usize..4usize {
            let place = inward(outer.i, outer.n, step);
            let weight = weight_inward::<F>(outer.i, outer.n, step, false);
            let there = difference::<F>(values, inner.through(outer, place), false);
            sum += weight * (there - own);
        }
    }
    sum
}

/// How many cells of a line may have a difference in which its cell has a part: three, and near the walls five.
#[cube]
pub(super) fn takers(line: Line) -> usize {
    let inside = line.i >= 4usize && line.i + 4usize < line.n;
    select(inside, 3usize, 5usize)
}

/// One of them: the neighbors, the cell itself, and the two ends, whose differences reach three cells inward.
#[cube]
pub(super) fn taker(line: Line, t: usize) -> usize {
    let last = line.n - 1usize;
    let below = select(line.i == 0usize, 0usize, line.i - min(line.i, 1usize));
    let above = min(line.i + 1usize, last);
    let beside = select(t == 0usize, below, above);
    let end = select(t == 3usize, 0usize, last);
    select(t == 2usize, line.i, select(t < 2usize, beside, end))
}

/// What the cell of a line weighs in the difference at one of [`taker`]; 0 for one that came before.
#[cube]
pub(super) fn taken<F: Float>(line: Line, t: usize, #[comptime] second: bool) -> F {
    let row = taker(line, t);
    let mut sum = F::new(0.0);
    let mut fresh = true;
    for before in 0..t {
        if taker(line, before) == row {
            fresh = false;
        }
    }
    if fresh {
        sum = weight_of::<F>(row, line.n, line.i, second);
    }
    sum
}

/// The weight of the value at `column` in the difference at `row`.
#[cube]
fn weight_of<F: Float>(row: usize, n: usize, column: usize, #[comptime] second: bool) -> F {
    let (zero, one) = (F::new(0.0), F::new(1.0));
    let mut sum = zero;
    if row > 0usize && row + 1usize < n {
        let own = select(column == row, one, zero);
        let above = select(column == row + 1usize, one, zero);
        let below = select(column + 1usize == row, one, zero);
        sum = central::<F>(above - own, below - own, second);
    } else {
        for step in 1usize..4usize {
            let weight = weight_inward::<F>(row, n, step, second);
            let there = inward(row, n, step) == column;
            sum += select(there, weight, zero) - select(row == column, weight, zero);
        }
    }
    sum
}

/// The transpose of [`difference`]: what the cell of a line gets of the cotangents of the differences along it. That
/// of cell `c` is number `component` of row `c` of `bars`, which has `pitch` numbers a row.
#[cube]
pub(super) fn transposed<F: Float>(
    bars: &Array<F>,
    line: Line,
    #[comptime] second: bool,
    #[comptime] pitch: usize,
    #[comptime] component: usize,
) -> F {
    let mut sum = F::new(0.0);
    for t in 0..takers(line) {
        let weight = taken::<F>(line, t, second);
        if weight != F::new(0.0) {
            sum += weight * bars[line.at(taker(line, t)) * pitch + component];
        }
    }
    sum
}
