//! The last pass, for samples that scatter: it follows what their offsets have in common over many cells.
//!
//! Where the passes before find that the samples must not be followed one by one, parts that are thin or sharp would be
//! lost with the noise. So the offsets are averaged over cells [`CELLS`] times as large, each sample is given the mean there, and
//! those means are followed as offsets are.

use super::Pass;
use super::layer::Layer;
use super::means::{CellMean, GridSamples, Reading};
use super::pullback::{PassScratch, SampleBars};
use crate::element::plane;
use crate::isosurface::Interpolation;
use crate::parallel::{self, CHUNK};
use crate::splat::{self, Samples, SortedSamples};
use crate::{Grid, Real, vector};

/// Side of a coarse cell, in cells of the indicator. Mean distances to the true surface (and back), in cells of φ, of four clouds
/// with noise of 0.5 % of their size, on cells of half that size: without the pass 0.162 (0.255), with 4 cells 0.148 (0.143),
/// 6 0.137 (0.141), 8 0.136 (0.145), 12 0.138 (0.154).
pub const CELLS: usize = 6;

/// Coarse cells that the coarse grid is larger at each wall, so that all samples have their 3³ cells.
const MARGIN: usize = 2;

/// The gain `λ` of the first pass up to which the coarse pass counts in full, and from which it is left out.
const SCATTERED: [f64; 2] = [0.25, 0.75];

/// Residual of the coarse pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Coarse<T> {
    /// The coarse grid.
    grid: Grid<T>,
    /// `γ`.
    pub(super) share: f64,
    /// On the coarse grid. Its slopes are those before the first pass, if there was none.
    pub(super) pass: Pass<T>,
}

/// Scratch buffers of the forward map, reused between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch<T> {
    layer: Layer,
    means: Vec<CellMean<T>>,
    readings: Vec<Reading<T>>,
    /// `(N,)` the mean that each sample is given.
    pub(super) given: Vec<T>,
}

/// Scratch buffers of the pullback, reused between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct PullbackScratch<T> {
    state: PassScratch<T>,
    /// `(N,)` cotangents at the samples. At the end `value` is that of the offset, and places and areas are on the grid of the
    /// indicator.
    pub(super) samples: Vec<SampleBars<T>>,
    /// `Ē` of the coarse layer: 0.
    total: Vec<T>,
    /// `(N,)` the mean that each sample is given, and its cotangent.
    given: Vec<T>,
    given_bar: Vec<T>,
}

/// `(N,)` cotangents of samples whose other passes run on a device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cotangent<T> {
    /// Of `λ` of the first pass.
    pub gain: f64,
    /// Of the offsets.
    pub offsets: Vec<T>,
    /// `(N, 3)` of index coordinates.
    pub places: Vec<[T; 3]>,
    /// Of areas, in the unit that the passes use.
    pub areas: Vec<T>,
}

/// The pass for samples whose other passes run on a device: from the `(N,)` offsets that these have left to the `(N,)` means that
/// they are to follow with gain 1, linear between coarse cells. `first_gain` is `λ` of the first pass, 0 if there was none, and
/// `area` as in [`Options`](super::Options). `None` if there is nothing to follow.
pub fn forward<T: Real>(
    grid: &Grid<T>,
    samples: Samples<'_, T>,
    area: bool,
    first_gain: f64,
    offsets: Vec<T>,
) -> Option<(Coarse<T>, Vec<T>)> {
    let near = GridSamples::new(grid, samples, area, Interpolation::Linear);
    let (order, mut scratch) = (in_order(samples), Scratch::default());
    let sorted = SortedSamples {
        samples,
        order: &order,
    };
    let found = scratch.run(&near, sorted, first_gain, || offsets)?;
    Some((found, scratch.given))
}

/// The pullback of [`forward`] from the `(N,)` cotangents of the means.
pub fn pullback<T: Real>(
    grid: &Grid<T>,
    samples: Samples<'_, T>,
    area: bool,
    coarse: &Coarse<T>,
    given_bar: Vec<T>,
) -> Cotangent<T> {
    let near = GridSamples::new(grid, samples, area, Interpolation::Linear);
    let (order, mut scratch) = (in_order(samples), PullbackScratch::default());
    let sorted = SortedSamples {
        samples,
        order: &order,
    };
    scratch.given_bar = given_bar;
    scratch.average(&near, sorted, coarse);
    let gain = scratch.pull(&near, coarse);
    let found = &scratch.samples;
    Cotangent {
        gain,
        offsets: found.iter().map(|bars| bars.value).collect(),
        places: found.iter().map(|bars| bars.place).collect(),
        areas: found.iter().map(|bars| bars.area).collect(),
    }
}

fn in_order<T>(samples: Samples<'_, T>) -> splat::Residual {
    splat::Residual {
        order: (0..samples.points.len() as u32).collect(),
        ..splat::Residual::default()
    }
}

impl<T> Coarse<T> {
    /// `γ λ`.
    pub fn gain(&self) -> f64 {
        self.share * self.pass.gain
    }

    /// `(N,)` offsets of the samples.
    pub fn offsets(&self) -> &[T] {
        &self.pass.offsets
    }
}

/// Whether the pass counts after a first pass with this gain.
pub fn is_needed(first_gain: f64) -> bool {
    share(first_gain) > 0.0
}

/// `γ`, from the gain of the first pass.
fn share(first_gain: f64) -> f64 {
    let [from, to] = SCATTERED;
    plane::falling(first_gain, from, to)
}

/// The coarse grid; `None` if its cells are too large for the number type.
fn coarse_grid<T: Real>(grid: &Grid<T>) -> Option<Grid<T>> {
    let spacing = grid.spacing() * T::of_usize(CELLS);
    let lower = (grid.lower()).map(|x| x - T::of_usize(MARGIN) * spacing);
    let shape = (grid.shape()).map(|n| n.div_ceil(CELLS) + 2 * MARGIN);
    Grid::new(lower, spacing, shape).ok()
}

impl<T: Real> Scratch<T> {
    /// Finds the mean that each sample is given; nothing if there is nothing to follow. `offsets` are asked for only if needed.
    pub(super) fn run(
        &mut self,
        near: &GridSamples<'_, T>,
        sorted: SortedSamples<'_, T>,
        first_gain: f64,
        offsets: impl FnOnce() -> Vec<T>,
    ) -> Option<Coarse<T>> {
        let share = share(first_gain);
        if share == 0.0 {
            return None;
        }
        let (grid, offsets) = (coarse_grid(near.grid)?, offsets());
        let coarse = near.on(&grid);
        self.layer.build(&grid, sorted);
        coarse.average(&self.layer, &offsets, &mut self.means);
        coarse.read(&self.layer, &self.means, &offsets, &mut self.readings);
        // Its cells are too large to measure how much of the slope is removed.
        let sums = coarse.sums(&self.readings, &offsets, |_| T::zero());
        let [gain, _] = sums.gain(0.0);
        if gain == 0.0 {
            return None;
        }
        let pass = Pass {
            gain,
            sums,
            offsets,
            ..Pass::default()
        };
        let found = Coarse { grid, share, pass };
        let (factor, readings) = (T::of(found.gain()), &self.readings);
        parallel::fill(&mut self.given, readings.len(), |i| {
            factor * readings[i].mean
        });
        Some(found)
    }
}

impl<T: Real> PullbackScratch<T> {
    /// Finds the means again.
    pub(super) fn average(
        &mut self,
        near: &GridSamples<'_, T>,
        sorted: SortedSamples<'_, T>,
        coarse: &Coarse<T>,
    ) {
        let Coarse { grid, pass, .. } = coarse;
        let (factor, near) = (T::of(coarse.gain()), near.on(grid));
        let PassScratch {
            layer,
            means,
            readings,
            ..
        } = &mut self.state;
        layer.build(grid, sorted);
        near.average(layer, &pass.offsets, means);
        near.read(layer, means, &pass.offsets, readings);
        parallel::fill(&mut self.given, readings.len(), |i| {
            factor * readings[i].mean
        });
    }

    /// Reverses the pass on the grid of the indicator: from its cotangents to those of the means that samples were given, and to
    /// places and areas, in `samples`. `corrections` gets what the pass subtracted.
    pub(super) fn pull_given(
        &mut self,
        near: &GridSamples<'_, T>,
        fine: &mut PassScratch<T>,
        total: &[T],
        corrections: &mut [T],
        samples: &mut [SampleBars<T>],
    ) {
        near.average(&fine.layer, &self.given, &mut fine.means);
        near.accumulate(&fine.means, T::one(), corrections);
        fine.reading_bars.fill(Reading::default());
        near.pull_means(fine, T::one(), &self.given, total);
        let (given, fine) = (&self.given, &*fine);
        self.given_bar.resize(samples.len(), T::zero());
        let chunks = samples.chunks_mut(CHUNK);
        let chunks = chunks.zip(self.given_bar.chunks_mut(CHUNK));
        parallel::each(chunks, |chunk, (samples, given_bar)| {
            for (n, (bars, given_bar)) in samples.iter_mut().zip(given_bar).enumerate() {
                let i = chunk * CHUNK + n;
                *given_bar = near.pull_sample(fine, i, given[i], bars);
            }
        });
    }

    /// Reverses the pass on the coarse grid. Returns the cotangent of the gain of the first pass.
    pub(super) fn pull(&mut self, near: &GridSamples<'_, T>, coarse: &Coarse<T>) -> f64 {
        let (given_bar, readings) = (&self.given_bar, &self.state.readings);
        let [factor_bar] = parallel::sum_array(readings.len(), |i| {
            [given_bar[i].f64() * readings[i].mean.f64()]
        });
        let near = near.on(&coarse.grid);
        self.pull_readings(&near, coarse, factor_bar);
        self.pull_samples(&near, &coarse.pass);
        let [from, to] = SCATTERED;
        match 0.0 < coarse.share && coarse.share < 1.0 {
            true => -coarse.pass.gain * factor_bar / (to - from),
            false => 0.0,
        }
    }

    /// To the readings, and through the sums to offsets and areas.
    fn pull_readings(&mut self, near: &GridSamples<'_, T>, coarse: &Coarse<T>, factor_bar: f64) {
        let pass = &coarse.pass;
        let (bars, _) = (pass.sums).pullback(0.0, coarse.share * factor_bar, 0.0);
        let [agreement, offset, prediction] =
            [bars.agreement, bars.offset, bars.prediction].map(T::of);
        let (factor, two) = (T::of(coarse.gain()), T::of(2.0));
        let (given_bar, readings) = (&self.given_bar, &self.state.readings);
        let at = |i: usize| (near.area(i), pass.offsets[i], readings[i].prediction);
        parallel::fill(&mut self.state.reading_bars, readings.len(), |i| {
            let (a, s, p) = at(i);
            Reading {
                mean: factor * given_bar[i],
                slope: T::zero(),
                prediction: a * (agreement * s + two * prediction * p),
            }
        });
        parallel::fill(&mut self.samples, readings.len(), |i| {
            let (a, s, p) = at(i);
            SampleBars {
                value: a * (agreement * p + two * offset * s),
                area: agreement * s * p + offset * s * s + prediction * p * p,
                ..SampleBars::default()
            }
        });
    }

    /// From the readings through the coarse cells to offsets, places and areas; the last two on the grid of the indicator.
    fn pull_samples(&mut self, near: &GridSamples<'_, T>, pass: &Pass<T>) {
        self.total.clear();
        self.total.resize(self.state.means.len(), T::zero());
        near.pull_means(&mut self.state, T::zero(), &pass.offsets, &self.total);
        let per_cell = T::one() / T::of_usize(CELLS);
        let per_area = match near.in_cells {
            true => per_cell * per_cell,
            false => T::one(),
        };
        let state = &self.state;
        near.for_each(
            &mut self.samples,
            #[inline(always)]
            |i, bars| {
                let s_bar = near.pull_sample(state, i, pass.offsets[i], bars);
                bars.value += s_bar;
                bars.place = vector::scale(bars.place, per_cell);
                bars.area *= per_area;
            },
        );
    }
}
