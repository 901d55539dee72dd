//! The forward map: passes of weighted means over the samples near each cell, until they explain no more.

use super::coarse;
use super::layer::{Layer, NODES};
use super::means::{CellMean, GridSamples, Reading};
use super::{PASSES, Pass, Residual};
use crate::data::cells::CellsMut;
use crate::isosurface::iso_value;
use crate::splat::SortedSamples;
use crate::{Field, Real, parallel};

/// Scratch buffers reused between calls: a few numbers for each cell of the layer around the surface, and for
/// each sample.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    layer: Layer,
    /// `D` and `e` at the cells of the layer.
    means: Vec<CellMean<T>>,
    /// `Σ λ e` at the cells of the layer.
    correction: Vec<T>,
    /// `(N,)` `r` before the pass.
    remaining: Vec<T>,
    /// `(N,)` the pass at the samples.
    readings: Vec<Reading<T>>,
    coarse: coarse::Scratch<T>,
}

/// Options of the stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Whether areas count in cells², or each sample as 1.
    pub area: bool,
    /// Width `σ` of the smoothing of the indicator, in cells.
    pub smoothing: f64,
    /// Whether parts thinner than a cell are followed and made thicker: see [`Level::Thin`](crate::isosurface::Level).
    pub thin: bool,
}

/// Corrects `chi` near the samples in place, so that the surface is where it equals the global iso-value. `level`
/// is the residual of [`iso_value::forward`] for `chi`. Writes `residual`, reusing its memory. The same bits for any
/// number of threads.
pub fn forward<T: Real>(
    chi: &mut Field<T>,
    samples: SortedSamples<'_, T>,
    options: Options,
    level: &iso_value::Residual<T>,
    scratch: &mut Scratch<T>,
    residual: &mut Residual<T>,
) {
    let grid = *chi.grid();
    let chi = CellsMut::Dense(&grid, chi.values_mut());
    forward_on(chi, samples, options, level, scratch, residual);
}

/// Like [`forward`], for a field that is dense or in blocks, which contain those within 2 cells of the samples.
pub(crate) fn forward_on<T: Real>(
    mut chi: CellsMut<'_, T>,
    samples: SortedSamples<'_, T>,
    options: Options,
    level: &iso_value::Residual<T>,
    scratch: &mut Scratch<T>,
    residual: &mut Residual<T>,
) {
    let grid = *chi.cells().grid();
    let near = GridSamples::new(&grid, samples.samples, options.area, level.interpolation);
    residual.interpolation = level.interpolation;
    scratch.start(&near, samples, level);
    if residual.passes.is_empty() {
        residual.passes.push(Pass::default());
    }
    near.fill_trust(chi.cells(), options, &mut scratch.remaining, residual);
    let (mut flattened, mut done) = (0.0, 0);
    while done < PASSES {
        if residual.passes.len() == done {
            residual.passes.push(Pass::default());
        }
        let (before, pass) = residual.passes.split_at_mut(done);
        flattened = scratch.run_pass(
            &near,
            &residual.trust,
            before.last(),
            flattened,
            &mut pass[0],
        );
        if pass[0].gain == 0.0 {
            break;
        }
        done += 1;
    }
    residual.coarse = scratch.run_coarse(&near, samples, residual, done);
    residual.passes.truncate(done);
    let layer = &scratch.layer;
    layer.zip_rows(&scratch.correction, &mut chi, |e, chi| {
        for (chi, &e) in chi.iter_mut().zip(e) {
            *chi -= e;
        }
    });
}

impl<T: Real> Scratch<T> {
    /// Finds the layer, and sets the remaining offsets to `χ(x_i) − c`.
    fn start(
        &mut self,
        near: &GridSamples<'_, T>,
        samples: SortedSamples<'_, T>,
        level: &iso_value::Residual<T>,
    ) {
        self.layer.build(near.grid, samples);
        self.correction.clear();
        self.correction.resize(self.layer.len() * NODES, T::zero());
        let c = T::of(level.value);
        let values = &level.at_samples;
        parallel::fill(&mut self.remaining, values.len(), |i| values[i].value - c);
    }

    /// The [coarse] pass, after `done` others.
    fn run_coarse(
        &mut self,
        near: &GridSamples<'_, T>,
        sorted: SortedSamples<'_, T>,
        residual: &mut Residual<T>,
        done: usize,
    ) -> Option<coarse::Coarse<T>> {
        let first_gain = residual.passes[0].gain;
        let (remaining, trust) = (&self.remaining, &residual.trust);
        let offsets = || parallel::map(trust.len(), |i| trust[i] * remaining[i]);
        let mut found = (self.coarse).run(near, sorted, first_gain, offsets)?;
        if done == 0 {
            found.pass.slopes = std::mem::take(&mut residual.passes[0].slopes);
        }
        near.average(&self.layer, &self.coarse.given, &mut self.means);
        near.accumulate(&self.means, T::one(), &mut self.correction);
        Some(found)
    }

    /// One pass, after the pass `before`. Returns the share of the slope removed so far. If the gain is 0, nothing is
    /// changed.
    fn run_pass(
        &mut self,
        near: &GridSamples<'_, T>,
        trust: &[T],
        before: Option<&Pass<T>>,
        flattened: f64,
        pass: &mut Pass<T>,
    ) -> f64 {
        pass.flattened = flattened;
        // s = ω r
        let (remaining, readings) = (&self.remaining, &self.readings);
        parallel::fill(&mut pass.offsets, trust.len(), |i| trust[i] * remaining[i]);
        if let Some(before) = before {
            // The slopes of χ after the pass before.
            let gain = T::of(before.gain);
            let slope = |i: usize| before.slopes[i] - gain * readings[i].slope;
            parallel::fill(&mut pass.slopes, before.slopes.len(), slope);
        }
        near.average(&self.layer, &pass.offsets, &mut self.means);
        near.read(&self.layer, &self.means, &pass.offsets, &mut self.readings);
        let (offsets, slopes) = (&pass.offsets, &pass.slopes);
        pass.sums = near.sums(&self.readings, offsets, |i| slopes[i]);
        let [gain, flattened] = pass.sums.gain(flattened);
        pass.gain = gain;
        if gain != 0.0 {
            let gain = T::of(gain);
            near.accumulate(&self.means, gain, &mut self.correction);
            let readings = &self.readings;
            parallel::for_each(&mut self.remaining, |i, r| *r -= gain * readings[i].mean);
        }
        flattened
    }
}
