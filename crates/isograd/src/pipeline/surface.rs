//! Resolution of the surface: the grid of the indicator, which may be finer or coarser than the grid of φ.

use super::{Error, Reconstruction, Solve};
use crate::data::fast_length;
use crate::poisson::reaches_wall;
use crate::{Grid, GridError, Real};

/// Most cells of the surface's grid per sample spacing with [`SurfaceResolution::Auto`]. Mean distance from the surface to the
/// true mesh with 0.8, 1.2 and 1.6 of them, in cells of φ (128 on the longest side): an airliner 0.0060, 0.0046, 0.0045; a
/// tray of plates 0.0041, 0.0049, 0.0068; a machined part 0.012, 0.020, 0.033. And with more than about 1.3 thin parts are torn.
pub(super) const CELLS_PER_SPACING: f64 = 1.2;

/// Most of them where the surface is marched on cells half as large. With 1 and 0.9 of them instead of whole cells as above, for ten
/// real shapes with 16,000 samples and 96 cells of φ: the derivative of the volume by a translation, which should be 0, is 0.38 and
/// 0.43 times as large in the mean (with 1, 0.17 to 0.78), the true surface is 0.93 and 1.04 times as far away, a reconstruction from
/// normals with known sides takes 1.65 and 1.37 times as long (with 1, 1.3 to 2.2), and its pullback with 1 of them 1.13 times.
pub(super) const HALVED_PER_SPACING: f64 = 1.04;

/// Automatic ratios of the cell sizes to an octave, evenly spaced: 1, 1.125, 1.25 and so on to 2.
const RATIOS_PER_OCTAVE: i32 = 8;

/// Octaves of automatic ratios finer than the grid of φ. Mean distance from the surface to the true mesh with
/// ratios of 2, 3 and 4, in cells of φ (64 on the longest side): an airliner 0.0112, 0.0056, 0.0040; a flying wing 0.0237,
/// 0.0128, 0.0081; an aorta 0.0077, 0.0046, 0.0037.
const FINER_OCTAVES: i32 = 2;

/// Octaves of automatic ratios coarser than it.
const COARSER_OCTAVES: i32 = 6;

/// How many times as many cells per sample spacing there may be where cells fill the box: few ratios then have whole cells, and
/// with larger ones the surface is marched on cells half as large.
const FILLING: f64 = 1.3;

/// Automatic ratio up to which the solve may be sparse.
const SPARSE_RATIO: f64 = 2.0;

/// Largest number of cells of a dense solve that is chosen automatically: 2²⁵, 0.6 GB in `f32`.
const MAX_DENSE_CELLS: usize = 1 << 25;

/// Cells of the coarsest grid of a sparse solve, approximately.
const COARSE_CELLS: usize = 1 << 22;

/// Largest ratio of the two cell sizes, and one over the smallest.
const MAX_FACTOR: f64 = 64.0;

/// How much larger than asked for a ratio may be, for lengths that a Fourier transform is quick for, where cells fill the box.
const SLACK: f64 = 1.1;

/// How fine the surface is. Splat, Poisson, iso-value and isosurface run on a grid of their own, with cubic cells
/// of another size in the box of the grid of φ; φ is the exact distance to that surface. Where a sample reaches a
/// [wall](crate::poisson::Walls), they fill that box, and are smaller if whole cells have to be; else the last ones may lie beyond it.
/// Time and memory grow with the number of these cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SurfaceResolution {
    /// Cells of 0.96 to 1.1 times the distance between samples, so that the surface is marched on half cells, for a dense solve with
    /// [`Level::Thin`](crate::isosurface::Level::Thin); else of 0.83 to 0.95 of it. Smaller ones would tear thin parts, larger ones lose
    /// them. Where cells fill the box they may be smaller by 0.77. They are at most 64 times as coarse as those of φ, and lie beyond
    /// its box where there would be fewer than 4 of them between samples and walls; and at most twice as fine, or four times where
    /// they are at most 2²⁵. The ratio of the cell sizes is a step function of the points, and the pullback holds it constant: prefer
    /// [`Self::Spacing`] or [`Self::Factor`] for a time series.
    #[default]
    Auto,
    /// The grid of φ itself.
    Grid,
    /// Cells of at most this size, in the cloud's unit, from 1/64 of those of φ to 64 times as large.
    Spacing(f64),
    /// Cells smaller by at least this factor, from 1/64 to 64.
    Factor(f64),
}

impl SurfaceResolution {
    /// Whether the spacing or the factor is in its range.
    pub(super) fn is_valid(self) -> bool {
        match self {
            Self::Grid | Self::Auto => true,
            Self::Spacing(spacing) => spacing > 0.0 && spacing.is_finite(),
            Self::Factor(factor) => is_allowed(factor),
        }
    }

    /// The grid of the surface, with the lower corner of `grid` or whole cells off it, and the number of octaves of the sparse solve,
    /// 0 for a dense one. Automatic cells are at least of `cell_size`; those of a sparse solve may be smaller by a tenth. All samples
    /// are at least `margin` cells of `grid` off its walls.
    ///
    /// # Errors
    /// [`Error::Surface`] for cells more than 64 times as fine or as coarse, [`Error::Grid`] for too many or too small cells.
    pub(super) fn grid_and_octaves<T: Real>(
        self,
        grid: &Grid<T>,
        cell_size: f64,
        solve: Solve,
        margin: f64,
    ) -> Result<(Grid<T>, usize), Error> {
        let refine = Refine { grid, margin };
        let fine = self.grid(refine, cell_size, solve)?;
        if solve == Solve::Dense || solve == Solve::Auto && fine.cells() <= MAX_DENSE_CELLS {
            return Ok((dense(fine)?, 0));
        }
        let wanted = (1..8)
            .find(|octaves| fine.cells() >> (3 * octaves) <= COARSE_CELLS)
            .unwrap_or(8);
        for octaves in (1..=wanted).rev() {
            if let Some(halved) = refine.halved(&fine, octaves) {
                return Ok((halved?, octaves));
            }
        }
        match solve {
            Solve::Auto => Ok((dense(fine)?, 0)),
            _ => {
                let count = fine.shape()[0].div_ceil(refine.scaled(1)[0]);
                Ok((refine.filled(count.next_multiple_of(2))?, 1))
            }
        }
    }

    fn grid<T: Real>(
        self,
        refine: Refine<'_, T>,
        cell_size: f64,
        solve: Solve,
    ) -> Result<Grid<T>, Error> {
        let spacing = refine.grid.spacing().f64();
        let factor = match self {
            Self::Grid => 1.0,
            Self::Auto => {
                return Ok(refine.automatically(spacing / cell_size, solve));
            }
            Self::Spacing(length) => spacing / length,
            Self::Factor(factor) => factor,
        };
        if !is_allowed(factor) {
            return Err(Error::Surface(self));
        }
        Ok(refine.by(factor)?)
    }
}

impl<T: Real> Reconstruction<T> {
    /// The grid of the surface for another grid of φ of the same shape.
    pub(super) fn surface_grid_like(&self, grid: &Grid<T>) -> Result<Grid<T>, GridError> {
        let (surface, before) = (self.surface_grid(), self.sdf.grid());
        if grid == before {
            return Ok(*surface);
        }
        let ratio = surface.spacing().f64() / before.spacing().f64();
        let spacing = grid.spacing().f64();
        let offset = self.surface_offset();
        let lower = std::array::from_fn(|a| T::of(grid.lower()[a].f64() + spacing * offset[a]));
        Grid::in_blocks(lower, T::of(spacing * ratio), surface.shape())
    }

    /// From the lower corner of the grid of φ to that of the grid of the surface, in cells of the former: 0, or negative where
    /// coarse cells of the surface need room.
    pub(super) fn surface_offset(&self) -> [f64; 3] {
        let (surface, grid) = (self.surface_grid(), self.sdf.grid());
        let offset = |a: usize| surface.lower()[a].f64() - grid.lower()[a].f64();
        std::array::from_fn(|a| offset(a) / grid.spacing().f64())
    }
}

/// Grids over the box of another one, with cells of another size.
#[derive(Clone, Copy)]
struct Refine<'a, T> {
    grid: &'a Grid<T>,
    /// How far all samples are off the walls, in cells of that grid.
    margin: f64,
}

impl<T: Real> Refine<'_, T> {
    /// The finest affordable automatic one of at most the wanted ratio of cell sizes, or the coarsest one; of those that fill the
    /// box, the coarsest of a little more.
    fn automatically(self, wanted: f64, solve: Solve) -> Grid<T> {
        let (least, most) = match self.fills_box() {
            true => (1.0, FILLING * wanted),
            false => (0.0, wanted),
        };
        let is_affordable = |ratio: f64, fine: &Grid<T>| {
            let may_be_sparse = solve != Solve::Dense && ratio <= SPARSE_RATIO;
            ratio <= 1.0 || may_be_sparse || fine.cells() <= MAX_DENSE_CELLS
        };
        let (mut above, mut coarsest) = (None, *self.grid);
        for ratio in automatic_ratios().take_while(|&ratio| ratio >= least) {
            let Ok(fine) = self.by(ratio) else { continue };
            // Of the cells themselves: a little more, for their number.
            let found = self.grid.spacing().f64() / fine.spacing().f64();
            if !is_affordable(ratio, &fine) {
                continue;
            }
            if found <= wanted {
                return above.unwrap_or(fine);
            }
            if found <= most {
                above = Some(fine);
            }
            if wanted < found && found <= 1.0 {
                coarsest = fine;
            }
        }
        above.unwrap_or(coarsest)
    }

    /// With cells smaller by at least `factor`, which fill the box of the grid where they have to, or where numbers of cells without
    /// prime factors above 7 do and leave room for the samples; else such numbers of cells that reach beyond it.
    fn by(self, factor: f64) -> Result<Grid<T>, GridError> {
        if factor == 1.0 {
            return Ok(*self.grid);
        }
        let shape = self.grid.shape();
        let longest = shape.into_iter().fold(0, usize::max) as f64;
        // The same for the ratio that it leads to.
        let ratio = fast_length(at_least(factor * longest)) as f64 / longest;
        let parts = self.parts() as f64;
        let first = at_least(factor * parts);
        let last = (self.slack() * ratio * parts * (1.0 + 1e-9)) as usize;
        let is_fast = |&count: &usize| {
            let lengths = self.scaled(count);
            lengths.into_iter().all(|n| fast_length(n) == n)
        };
        let room = self.room(ratio);
        match (first..=last).find(is_fast) {
            Some(count) if room == 0 => self.filled(count),
            None if self.fills_box() => self.filled(first),
            _ => {
                let beyond = shape.map(|n| fast_length(at_least(ratio * n as f64) + 2 * room));
                let spacing = self.grid.spacing().f64() / ratio;
                let lower = self.grid.lower();
                let lower = lower.map(|x| T::of(x.f64() - room as f64 * spacing));
                Grid::in_blocks(lower, T::of(spacing), beyond)
            }
        }
    }

    /// How many cells coarser than those of the grid must lie beyond each side of the box, so that there are
    /// [`Grid::MARGIN_CELLS`] between samples and walls.
    fn room(self, ratio: f64) -> usize {
        let missing = Grid::<T>::MARGIN_CELLS as f64 - ratio * self.margin;
        match self.fills_box() || ratio >= 1.0 {
            true => 0,
            false => missing.max(0.0).ceil() as usize,
        }
    }

    /// With cells like those of `fine`, a grid [`Self::by`] some factor, but as many along each axis as can be halved so many times;
    /// `None` if cells that fill the box would be too small, and they must, or the coarsest cells are too few.
    fn halved(self, fine: &Grid<T>, octaves: usize) -> Option<Result<Grid<T>, GridError>> {
        let filled = self.count(fine).and_then(|count| {
            let rounded = count.next_multiple_of(1 << octaves);
            (rounded as f64 <= self.slack() * count as f64).then_some(rounded)
        });
        let beyond = |n: usize| fast_length(n.div_ceil(1 << octaves)) << octaves;
        let shape = match filled {
            Some(count) => self.scaled(count),
            None if self.fills_box() => return None,
            None => fine.shape().map(beyond),
        };
        let is_thick = shape.iter().all(|n| n >> octaves >= Grid::<T>::MIN_CELLS);
        is_thick.then(|| match filled {
            Some(count) => self.filled(count),
            None => Grid::in_blocks(fine.lower(), fine.spacing(), shape),
        })
    }

    /// Whether the upper corner must be that of the grid: a surface that may pass through a wall ends there.
    fn fills_box(self) -> bool {
        reaches_wall(self.margin)
    }

    /// How many times as fine as needed cells may be to fill the box.
    fn slack(self) -> f64 {
        if self.fills_box() { SLACK } else { 1.0 }
    }

    /// Equal parts of all sides of the box that are whole cells.
    fn parts(self) -> usize {
        self.grid.shape().into_iter().fold(0, gcd)
    }

    /// Cells along each side, so many for each of the [`Self::parts`] in place of one.
    fn scaled(self, count: usize) -> [usize; 3] {
        let parts = self.parts();
        self.grid.shape().map(|n| n / parts * count)
    }

    /// Cells of `fine` for each of the [`Self::parts`]; `None` if it does not fill the box.
    fn count(self, fine: &Grid<T>) -> Option<usize> {
        let count = fine.shape()[0] / self.scaled(1)[0];
        let is_box = self.scaled(count) == fine.shape() && fine.lower() == self.grid.lower();
        is_box.then_some(count)
    }

    /// The box, filled with so many cells for each of the [`Self::parts`].
    fn filled(self, count: usize) -> Result<Grid<T>, GridError> {
        let (grid, shape) = (self.grid, self.scaled(count));
        if shape == grid.shape() {
            return Ok(*grid);
        }
        let spacing = grid.spacing().f64() * grid.shape()[0] as f64 / shape[0] as f64;
        Grid::in_blocks(grid.lower(), T::of(spacing), shape)
    }
}

fn is_allowed(factor: f64) -> bool {
    (1.0 / MAX_FACTOR..=MAX_FACTOR).contains(&factor)
}

/// All automatic ratios, from the largest down.
fn automatic_ratios() -> impl Iterator<Item = f64> {
    let numbers = -COARSER_OCTAVES * RATIOS_PER_OCTAVE..=FINER_OCTAVES * RATIOS_PER_OCTAVE;
    numbers.rev().map(|n| {
        let step = f64::from(n.rem_euclid(RATIOS_PER_OCTAVE)) / f64::from(RATIOS_PER_OCTAVE);
        f64::from(n.div_euclid(RATIOS_PER_OCTAVE)).exp2() * (1.0 + step)
    })
}

/// The whole number above, or that which this is up to rounding.
fn at_least(length: f64) -> usize {
    (length * (1.0 - 1e-9)).ceil().max(1.0) as usize
}

/// A grid that is small enough to have a value at each cell.
fn dense<T: Real>(grid: Grid<T>) -> Result<Grid<T>, GridError> {
    Grid::new(grid.lower(), grid.spacing(), grid.shape())
}

/// The greatest common divisor.
fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests;
