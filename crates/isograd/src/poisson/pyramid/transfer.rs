//! Transfer between cells and cells twice as large: quintic B-splines, and their transpose.

use crate::data::blocks::{Blocks, EDGE, NODES};
use crate::{Real, parallel};

/// Large cells on either side of a pair of small ones to which their values contribute.
pub(super) const REACH: isize = 3;

/// Large cells along each axis of which the values in a block are sums.
const ABOVE: usize = EDGE / 2 + 2 * REACH as usize;

/// Small cells along each axis that contribute to a block.
const BELOW: usize = 2 * EDGE + 4 * REACH as usize - 2;

/// Quintic B-spline.
fn spline(x: f64) -> f64 {
    let x = x.abs();
    let powers = |c: [f64; 6]| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
    match x {
        _ if x < 1.0 => powers([0.55, 0.0, -0.5, 0.0, 0.25, -1.0 / 12.0]),
        _ if x < 2.0 => powers([0.425, 0.625, -1.75, 1.25, -0.375, 1.0 / 24.0]),
        _ if x < 3.0 => (3.0 - x).powi(5) / 120.0,
        _ => 0.0,
    }
}

/// Weight of a large cell at a small cell, from their places along an axis.
fn weight(small: isize, large: isize) -> f64 {
    spline((small as f64 + 0.5) / 2.0 - large as f64 - 0.5)
}

/// Factor by which the spline of a wave on the large cells falls short of the wave, for an angle `θ` per small cell.
pub(super) fn symbol(angle: f64) -> f64 {
    let term = |m: isize| weight(0, m) * (2.0 * angle * (m as f64 + 0.25)).cos();
    (-REACH..=REACH).map(term).sum()
}

/// Adds the values at the cells of `small` of the spline with `coefficients` at the cells of `large`.
pub(super) fn prolong<T: Real>(
    large: &Blocks,
    coefficients: &[T],
    small: &Blocks,
    closed: bool,
    out: &mut [T],
) {
    let rows: [(usize, [T; 6]); EDGE] = std::array::from_fn(|n| {
        let first = n.div_ceil(2);
        let large = |m: usize| (first + m) as isize - REACH;
        let weights = std::array::from_fn(|m| T::of(weight(n as isize, large(m))));
        (first, weights)
    });
    let blocks = out.chunks_exact_mut(NODES);
    parallel::map_each_with(Rooms::default, blocks, |rooms, block, out| {
        let origin = small.corner(block).map(|c| (c / 2) as isize - REACH);
        if rooms.read((large, coefficients), origin, ABOVE, closed) {
            rooms.contract(ABOVE, &rows);
            for (out, &part) in out.iter_mut().zip(&rooms.to) {
                *out += part;
            }
        }
    });
}

/// Writes the transpose of [`prolong`]: sums over the cells of `small`.
pub(super) fn restrict<T: Real>(
    small: &Blocks,
    values: &[T],
    large: &Blocks,
    closed: bool,
    out: &mut [T],
) {
    const TAPS: usize = 4 * REACH as usize;
    let weights: [T; TAPS] = std::array::from_fn(|m| T::of(weight(m as isize - 2 * REACH + 1, 0)));
    let rows: [(usize, [T; TAPS]); EDGE] = std::array::from_fn(|n| (2 * n, weights));
    let blocks = out.chunks_exact_mut(NODES);
    parallel::map_each_with(Rooms::default, blocks, |rooms, block, out| {
        let origin = large
            .corner(block)
            .map(|c| (2 * c) as isize - 2 * REACH + 1);
        if rooms.read((small, values), origin, BELOW, closed) {
            rooms.contract(BELOW, &rows);
            out.copy_from_slice(&rooms.to[..NODES]);
        } else {
            out.fill(T::zero());
        }
    });
}

/// Cells around a block, and sums of them.
#[derive(Default)]
struct Rooms<T> {
    from: Vec<T>,
    to: Vec<T>,
}

impl<T: Real> Rooms<T> {
    /// Reads a cube of cells; returns whether any block is there.
    fn read(
        &mut self,
        (blocks, values): (&Blocks, &[T]),
        origin: [isize; 3],
        side: usize,
        closed: bool,
    ) -> bool {
        self.from.resize(side * side * side, T::zero());
        blocks.read_cube(values, origin, side, closed, &mut self.from)
    }

    /// Weighted sums along each axis: from `side`³ values to a block. `rows` are the first value and the weights of each
    /// of its places.
    fn contract<const N: usize>(&mut self, side: usize, rows: &[(usize, [T; N]); EDGE]) {
        // Each step contracts the last axis and makes it the first one.
        for lines in [side * side, EDGE * side, EDGE * EDGE] {
            self.to.resize(EDGE * lines, T::zero());
            for (l, line) in self.from.chunks_exact(side).enumerate() {
                for (n, (first, weights)) in rows.iter().enumerate() {
                    let line = &line[*first..first + N];
                    let products = line.iter().zip(weights).map(|(&v, &w)| v * w);
                    self.to[n * lines + l] = products.fold(T::zero(), |sum, p| sum + p);
                }
            }
            std::mem::swap(&mut self.from, &mut self.to);
            self.from.truncate(EDGE * lines);
        }
        std::mem::swap(&mut self.from, &mut self.to);
    }
}
