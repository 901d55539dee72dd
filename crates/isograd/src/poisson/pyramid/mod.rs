//! The solution of the Poisson equation near the samples of a fine grid: corrections on blocks, octave by octave, and a
//! direct solve of a coarse grid.
//!
//! # Map
//! `b → χ`, both at the cells of some blocks of a grid, in index space; `b` is 0 elsewhere. With `κ = Σ K/M` over the axes,
//! the solution of the dense equation ([`super`]) is `χ = Π(G/M) b/κ`. As `1/κ = ∫₀^∞ e^{−tκ} dt`, it is the sum of
//! - a near part, `Π(G/M) (1 − e^{−Tκ}) b/κ`, whose kernel is set to 0 beyond [`HALO`] cells, 4 widths off: a cosine transform of
//!   each brick of blocks and its surroundings is then its convolution with `b`;
//! - a far part, `Π(G/M) e^{−Tκ} b/κ`, smooth enough for cells twice as large: `P S Pᵀ b` with `P` the interpolation by
//!   quintic B-splines, of symbol `p` per axis, and `S = Π(G/M) e^{−Tκ}/(2p²)/κ` on the larger cells. It is found the same
//!   way, octave by octave, down to a grid that is solved whole.
//!
//! An octave ends at a width `√(σ² + 2T)` of [`WIDTH`] of the larger cells. What the interpolation adds at other frequencies is
//! then below 3e-5 of the jump of `χ`.
//!
//! # Residual
//! The blocks.
//!
//! # Pullback
//! The map is symmetric to rounding: it is its own pullback. `σ̄` is that of the dense map, [`smoothing`](super::smoothing), which
//! differs as `χ` does.
//!
//! # Not differentiable
//! Which blocks are there. A step of one block changes `χ` by no more than its error.
//!
//! # Source
//! P. P. Ewald's sum, *Die Berechnung optischer und elektrostatischer Gitterpotentiale*, 1921, with the splines of U. Essmann
//! et al., *A smooth particle mesh Ewald method*, J. Chem. Phys. 103 (1995), once per octave.

#[cfg(test)]
mod tests;
mod transfer;

use std::f64::consts::PI;
use std::sync::Arc;

use super::{Error, Plan, Scratch, Symbol};
use crate::data::blocks::{BRICK, Blocks, Brick, EDGE, Marks, NODES};
use crate::{Real, parallel};

/// Cells around a brick of which the samples have an effect in it.
const HALO: usize = 12;

/// Cells along each side of a brick and its surroundings.
const SIDE: usize = BRICK * EDGE + 2 * HALO;

/// Width of the Gaussian at the end of an octave, in cells of the next one.
const WIDTH: f64 = 1.5;

/// Frequencies of an even kernel of period `2 SIDE`.
const FULL: usize = SIDE + 1;

/// Solver for one grid and one smoothing.
pub(crate) struct Pyramid<T: Real> {
    closed: bool,
    /// The near part of each octave.
    near: Vec<(Plan<T>, Scratch<T>)>,
    far: Plan<T>,
    far_scratch: Scratch<T>,
    /// Right-hand side and solution on the coarsest grid.
    field: Vec<T>,
}

/// The blocks of each octave, from the finest grid to the coarsest, which has them all.
#[derive(Clone, Debug)]
pub(crate) struct Octaves(Vec<Arc<Blocks>>);

impl Octaves {
    /// Those that the blocks of the finest grid need, for `count` octaves.
    pub(crate) fn new(finest: Arc<Blocks>, count: usize) -> Self {
        let mut blocks = vec![finest];
        for octave in 1..=count {
            let small = &blocks[octave - 1];
            let cells = small.cells().map(|n| n / 2);
            let large = match octave == count {
                true => Blocks::all(cells),
                false => parents(small, cells),
            };
            blocks.push(Arc::new(large));
        }
        Self(blocks)
    }
}

/// Blocks of cells twice as large whose values contribute to those of `small`.
fn parents(small: &Blocks, cells: [usize; 3]) -> Blocks {
    let mut marks = Marks::new(cells);
    for block in 0..small.len() {
        let low = small.corner(block).map(|c| (c / 2) as isize);
        let high = low.map(|c| c + (EDGE / 2) as isize - 1 + transfer::REACH);
        marks.mark(low.map(|c| c - transfer::REACH), high);
    }
    marks.build()
}

impl<T: Real> Pyramid<T> {
    /// A solver for a grid of `cells`, multiples of 2 to the power `octaves`, with closed or free walls and the smoothing `σ`
    /// in cells.
    pub(crate) fn new(cells: [usize; 3], octaves: usize, closed: bool, smoothing: f64) -> Self {
        let symbols = Symbols { smoothing };
        let near = (0..octaves).map(|octave| {
            let gains = symbols.near(octave);
            let row = |c: usize| &gains[(c / SIDE * FULL + c % SIDE) * FULL..][..SIDE];
            let gains = (0..SIDE * SIDE).flat_map(|c| row(c).iter().copied());
            (Plan::with_gains([SIDE; 3], gains), Scratch::default())
        });
        let coarse = cells.map(|n| n >> octaves);
        Self {
            closed,
            near: near.collect(),
            far: Plan::with_symbols(coarse, closed, |angle| symbols.at(octaves, angle)),
            far_scratch: Scratch::default(),
            field: vec![T::zero(); coarse.iter().product()],
        }
    }

    /// Solves in place: `values`, at the nodes of the finest blocks, hold `b` and then `χ`. The same bits for any number of
    /// threads.
    ///
    /// # Errors
    /// As [`Plan::solve`].
    pub(crate) fn solve(&mut self, octaves: &Octaves, values: &mut Vec<T>) -> Result<(), Error> {
        let mut rhs = vec![std::mem::take(values)];
        for pair in octaves.0.windows(2) {
            let mut sums = vec![T::zero(); pair[1].nodes()];
            let last = &rhs[rhs.len() - 1];
            transfer::restrict(&pair[0], last, &pair[1], self.closed, &mut sums);
            rhs.push(sums);
        }
        let coarsest = &octaves.0[self.near.len()];
        let mut chi = rhs.pop().unwrap_or_default();
        coarsest.write_dense(&chi, &mut self.field);
        self.far
            .solve(&mut self.field, 0.0, &mut self.far_scratch)?;
        coarsest.read_dense(&self.field, &mut chi);
        for (octave, b) in rhs.into_iter().enumerate().rev() {
            let [small, large] = [octave, octave + 1].map(|o| &octaves.0[o]);
            let mut sum = vec![T::zero(); small.nodes()];
            self.add_near(octave, small, &b, &mut sum);
            transfer::prolong(large, &chi, small, self.closed, &mut sum);
            chi = sum;
        }
        *values = chi;
        Ok(())
    }

    /// The solution on the coarsest grid, of the last call of [`Self::solve`]: without the near parts.
    pub(crate) fn into_coarsest(self) -> Vec<T> {
        self.field
    }

    /// Writes the near part of an octave.
    fn add_near(&self, octave: usize, blocks: &Blocks, b: &[T], out: &mut [T]) {
        let (plan, scratch) = &self.near[octave];
        blocks.for_each_brick(out, |brick, out| {
            let mut room = vec![T::zero(); SIDE * SIDE * SIDE];
            let origin = brick.corner.map(|c| c as isize - HALO as isize);
            blocks.read_cube(b, origin, SIDE, self.closed, &mut room);
            if room.iter().all(|&b| b == T::zero()) {
                return;
            }
            plan.filter(&mut room, scratch);
            copy_core(blocks, brick, &room, out);
        });
    }
}

/// Copies the values of the blocks of a brick from those of the brick and its surroundings.
fn copy_core<T: Real>(blocks: &Blocks, brick: &Brick, room: &[T], out: &mut [T]) {
    let [first, end] = brick.blocks;
    for (block, out) in (first..end).zip(out.chunks_exact_mut(NODES)) {
        let corner = blocks.corner(block);
        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| corner[a] - brick.corner[a] + HALO);
        for (row, out) in out.chunks_exact_mut(EDGE).enumerate() {
            let start = ((x + row / EDGE) * SIDE + y + row % EDGE) * SIDE + z;
            out.copy_from_slice(&room[start..start + EDGE]);
        }
    }
}

/// Factors per axis of the octaves.
struct Symbols {
    /// `σ`, in cells of the finest grid.
    smoothing: f64,
}

impl Symbols {
    /// `T` at the end of an octave, in cells² of the finest grid.
    fn end(&self, octave: usize) -> f64 {
        let width = WIDTH * (2 << octave) as f64;
        (0.5 * (width.powi(2) - self.smoothing.powi(2))).max(0.0)
    }

    /// The factors at an angle per cell of the octave.
    fn at(&self, octave: usize, angle: f64) -> Symbol {
        let of = |octave: usize| angle / (1u64 << octave) as f64;
        let half = 0.5 * of(octave);
        let mass = 1.0 - 2.0 / 3.0 * half.sin().powi(2);
        let stiffness = 4.0 * half.sin().powi(2) / mass;
        let start = self.start(octave);
        let gaussian = -2.0 * (self.smoothing * half.sin()).powi(2);
        // The angles per cell of the octaves before.
        let splines = (1..=octave).map(|o| 0.5 / transfer::symbol(of(o)).powi(2));
        Symbol {
            amplitude: (gaussian - start * stiffness).exp() / mass * splines.product::<f64>(),
            stiffness,
        }
    }

    /// `T` at the start of an octave.
    fn start(&self, octave: usize) -> f64 {
        match octave {
            0 => 0.0,
            _ => self.end(octave - 1),
        }
    }

    /// The gains of the near part of an octave at [`FULL`]³ frequencies, its kernel cut at the halo.
    fn near(&self, octave: usize) -> Vec<f64> {
        let symbols: Vec<Symbol> = (0..FULL)
            .map(|k| self.at(octave, PI * k as f64 / SIDE as f64))
            .collect();
        let duration = self.end(octave) - self.start(octave);
        let gain = |place: usize| {
            let [a, b, c] = [place / FULL / FULL, place / FULL % FULL, place % FULL];
            let [a, b, c] = [a, b, c].map(|k| &symbols[k]);
            let stiffness = a.stiffness + b.stiffness + c.stiffness;
            let share = match stiffness > 0.0 {
                true => -(-duration * stiffness).exp_m1() / stiffness,
                false => duration,
            };
            a.amplitude * b.amplitude * c.amplitude * share
        };
        let mut gains = parallel::map(FULL * FULL * FULL, gain);
        let cut = cut();
        for _ in 0..3 {
            gains = cut_last_axis(&gains, &cut);
        }
        gains
    }
}

/// Matrix that takes the frequencies of an even kernel to those of its values within the halo.
fn cut() -> Vec<f64> {
    let period = 2 * SIDE;
    let cos = |k: usize, d: usize| (PI * (k * d % period) as f64 / SIDE as f64).cos();
    let entry = |place: usize| {
        let (to, from) = (place / FULL, place % FULL);
        let times = if from % SIDE == 0 { 1.0 } else { 2.0 };
        let terms = (1..=HALO).map(|d| 2.0 * cos(to, d) * cos(from, d));
        times * (1.0 + terms.sum::<f64>()) / period as f64
    };
    (0..FULL * FULL).map(entry).collect()
}

/// Multiplies the lines along the last axis by a matrix, and makes it the first axis.
fn cut_last_axis(gains: &[f64], matrix: &[f64]) -> Vec<f64> {
    let lines = gains.len() / FULL;
    parallel::map(matrix.len() / FULL * lines, |place| {
        let row = &matrix[place / lines * FULL..][..FULL];
        let line = &gains[place % lines * FULL..][..FULL];
        line.iter().zip(row).map(|(a, b)| a * b).sum()
    })
}
