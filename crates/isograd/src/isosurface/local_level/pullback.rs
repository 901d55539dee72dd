//! The pullback: the passes in reverse, then trust and slopes.

use super::coarse;
use super::gain::Sums;
use super::layer::{EDGE, Layer, NODES};
use super::means::{CellMean, GridSamples, Reading};
use super::pull_means::CellBars;
use super::{Pass, Residual};
use crate::data::blocks::BlockField;
use crate::data::cells::{Cells, CellsMut};
use crate::splat::{SampleCotangent, SortedSamples};
use crate::{Field, Grid, Real, parallel, vector};

/// Scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    /// `Ē` at the cells of the layer; at the end the term that is added to `χ̄`.
    total: Vec<T>,
    /// `Σ λ e` at the cells of the layer.
    corrections: Vec<T>,
    /// `(N,)` cotangents at the samples, summed over the passes.
    samples: Vec<SampleBars<T>>,
    /// `(N, 3)` cotangents of slopes and areas from those of trust and shifts.
    trust: Vec<[f64; 3]>,
    pass: PassScratch<T>,
    coarse: coarse::PullbackScratch<T>,
}

/// State of a pass in the layer and at the samples, and its cotangents.
#[derive(Clone, Debug, Default)]
pub(super) struct PassScratch<T> {
    pub(super) layer: Layer,
    /// `D` and `e` at the cells of the layer.
    pub(super) means: Vec<CellMean<T>>,
    /// `M̄` and `D̄` there.
    pub(super) mean_bars: Vec<CellBars<T>>,
    /// `(N,)` `m`, `w`, `p` at the samples.
    pub(super) readings: Vec<Reading<T>>,
    /// `(N,)` their cotangents.
    pub(super) reading_bars: Vec<Reading<T>>,
}

/// Cotangents of the inputs besides the indicator and the samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cotangent<T> {
    /// `(N,)` of `χ(x_i)`.
    pub values: Vec<T>,
    /// Of the iso-value `c`.
    pub level: f64,
    /// Of the smoothing `σ`, in cells, through trust and shifts.
    pub smoothing: f64,
}

/// Cotangents at a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SampleBars<T> {
    /// `r̄`.
    pub(super) value: T,
    /// `ū`.
    pub(super) slope: T,
    /// `ω̄`.
    pub(super) trust: T,
    /// `x̂̄`, of the index coordinates.
    pub(super) place: [T; 3],
    /// `n̄`.
    pub(super) normal: [T; 3],
    /// Of `â`.
    pub(super) area: T,
}

/// Pulls the cotangent `chi_bar` `(nx, ny, nz)` of the corrected indicator `chi` back to the inputs. `chi_bar` becomes
/// the cotangent of the input indicator, without the term through `χ(x_i)`, whose cotangents are in `bars`. Overwrites
/// `bars`, and adds to `out` the cotangents of points, normals, areas and grid. All other arguments are those of
/// [`forward`](super::forward).
pub fn pullback<T: Real>(
    chi: &Field<T>,
    samples: SortedSamples<'_, T>,
    residual: &Residual<T>,
    chi_bar: &mut [T],
    scratch: &mut PullbackScratch<T>,
    bars: &mut Cotangent<T>,
    out: &mut SampleCotangent<T>,
) {
    let chi_bar = CellsMut::Dense(chi.grid(), chi_bar);
    pullback_on(chi.into(), samples, residual, chi_bar, scratch, bars, out);
}

/// Like [`pullback`], for fields that are dense or in blocks.
pub(crate) fn pullback_on<T: Real>(
    chi: Cells<'_, T>,
    samples: SortedSamples<'_, T>,
    residual: &Residual<T>,
    mut chi_bar: CellsMut<'_, T>,
    scratch: &mut PullbackScratch<T>,
    bars: &mut Cotangent<T>,
    out: &mut SampleCotangent<T>,
) {
    let grid = chi.grid();
    let near = GridSamples::new(grid, samples.samples, residual.area, residual.interpolation);
    scratch.start(grid, samples, chi_bar.cells());
    let of_coarse = scratch.pull_coarse(&near, samples, residual);
    let mut flattened_bar = 0.0;
    for (k, pass) in residual.passes.iter().enumerate().rev() {
        let gain_bar = if k == 0 { of_coarse } else { 0.0 };
        flattened_bar = scratch.pull_pass(&near, pass, &residual.trust, [gain_bar, flattened_bar]);
    }
    bars.smoothing = scratch.pull_trust(&near, residual);
    scratch.pull_slopes(&near, chi);
    let PullbackScratch {
        total,
        samples: found,
        pass: PassScratch { layer, .. },
        ..
    } = scratch;
    near.spread_slopes(layer, found, total);
    layer.zip_rows(total, &mut chi_bar, |part, bars| {
        for (bar, &part) in bars.iter_mut().zip(part) {
            *bar += part;
        }
    });
    parallel::fill(&mut bars.values, found.len(), |i| found[i].value);
    near.add(found, out);
    let [sum] = parallel::sum_array(found.len(), |i| [found[i].value.f64()]);
    bars.level = -sum;
}

impl<T: Real> SampleBars<T> {
    /// Adds the cotangent of the offset `s = ω r`.
    #[inline(always)]
    pub(super) fn add_offset(&mut self, s_bar: T, s: T, trust: T) {
        self.value += trust * s_bar;
        // Where ω is 0, its slope is 0.
        if trust > T::zero() {
            self.trust += s_bar * s / trust;
        }
    }
}

impl<T: Real> PullbackScratch<T> {
    fn start(&mut self, grid: &Grid<T>, samples: SortedSamples<'_, T>, chi_bar: Cells<'_, T>) {
        self.pass.layer.build(grid, samples);
        let count = samples.samples.points.len();
        self.samples.clear();
        self.samples.resize(count, SampleBars::default());
        self.pass.reading_bars.resize(count, Reading::default());
        let layer = &self.pass.layer;
        self.total.clear();
        self.total.resize(layer.len() * NODES, T::zero());
        self.corrections.clear();
        self.corrections.resize(self.total.len(), T::zero());
        parallel::each(self.total.chunks_exact_mut(NODES), |block, total| {
            layer.copy_block(block, chi_bar, total);
            for total in total {
                *total = -*total;
            }
        });
    }

    /// Reverses the [coarse] pass. Returns the cotangent of the gain of the first pass.
    fn pull_coarse(
        &mut self,
        near: &GridSamples<'_, T>,
        sorted: SortedSamples<'_, T>,
        residual: &Residual<T>,
    ) -> f64 {
        let Some(coarse) = &residual.coarse else {
            return 0.0;
        };
        let Self {
            total,
            corrections,
            samples,
            pass,
            coarse: scratch,
            ..
        } = self;
        scratch.average(near, sorted, coarse);
        scratch.pull_given(near, pass, total, corrections, samples);
        let gain_bar = scratch.pull(near, coarse);
        let (found, offsets, trust) = (&scratch.samples, &coarse.pass.offsets, &residual.trust);
        parallel::for_each(samples, |i, bars| {
            bars.place = vector::add(bars.place, found[i].place);
            bars.area += found[i].area;
            bars.add_offset(found[i].value, offsets[i], trust[i]);
        });
        gain_bar
    }

    /// Reverses one pass. Takes and returns the cotangent of the share of the slope removed, after and before it;
    /// `of_gain` is that of `λ` through the coarse pass.
    fn pull_pass(
        &mut self,
        near: &GridSamples<'_, T>,
        pass: &Pass<T>,
        trust: &[T],
        [of_gain, flattened_bar]: [f64; 2],
    ) -> f64 {
        let PassScratch {
            layer,
            means,
            readings,
            ..
        } = &mut self.pass;
        near.average(layer, &pass.offsets, means);
        near.read(layer, means, &pass.offsets, readings);
        near.accumulate(means, T::of(pass.gain), &mut self.corrections);
        let gain_bar = of_gain + self.gain_bar();
        let (sums_bar, before_bar) = pass.sums.pullback(pass.flattened, gain_bar, flattened_bar);
        self.pull_sums(near, pass, sums_bar);
        near.pull_means(&mut self.pass, T::of(pass.gain), &pass.offsets, &self.total);
        let state = &self.pass;
        near.for_each(
            &mut self.samples,
            #[inline(always)]
            |i, bars| {
                let (p, s) = (state.readings[i].prediction, pass.offsets[i]);
                let of_sums = T::of(sums_bar.agreement) * p + T::of(2.0 * sums_bar.offset) * s;
                let s_bar = near.area(i) * of_sums + near.pull_sample(state, i, s, bars);
                bars.add_offset(s_bar, s, trust[i]);
            },
        );
        before_bar
    }

    /// `λ̄`, without the part through the share of the slope.
    fn gain_bar(&self) -> f64 {
        let (means, readings) = (&self.pass.means, &self.pass.readings);
        let blocks = means.chunks(NODES).zip(self.total.chunks(NODES));
        let of_blocks = parallel::map_each(blocks, |_, (means, total)| {
            let products = means.iter().zip(total);
            products.map(|(n, t)| n.mean.f64() * t.f64()).sum::<f64>()
        });
        let of_cells: f64 = of_blocks.iter().sum();
        let [of_samples] = parallel::sum_array(readings.len(), |i| {
            let (bars, reading) = (self.samples[i], readings[i]);
            [(bars.value * reading.mean + bars.slope * reading.slope).f64()]
        });
        of_cells - of_samples
    }

    /// From the cotangents `bars` of the sums to those of the readings, and of slopes and areas.
    fn pull_sums(&mut self, near: &GridSamples<'_, T>, pass: &Pass<T>, bars: Sums) {
        let (gain, readings) = (T::of(pass.gain), &self.pass.readings);
        let [rise, slope, agreement, offset, prediction] = bars.to_array().map(T::of);
        let two = T::of(2.0);
        let samples = &self.samples;
        parallel::for_each(&mut self.pass.reading_bars, |i, reading_bar| {
            let (a, s, u) = (near.area(i), pass.offsets[i], pass.slopes[i]);
            *reading_bar = Reading {
                mean: -gain * samples[i].value,
                slope: a * rise * u - gain * samples[i].slope,
                prediction: a * (agreement * s + two * prediction * readings[i].prediction),
            };
        });
        parallel::for_each(&mut self.samples, |i, bars| {
            let (w, p) = (readings[i].slope, readings[i].prediction);
            let (a, s, u) = (near.area(i), pass.offsets[i], pass.slopes[i]);
            bars.slope += a * (rise * w + two * slope * u);
            bars.area += rise * w * u
                + slope * u * u
                + agreement * s * p
                + offset * s * s
                + prediction * p * p;
        });
    }

    /// From trust and shifts to slopes and areas. Returns the cotangent of the smoothing.
    fn pull_trust(&mut self, near: &GridSamples<'_, T>, residual: &Residual<T>) -> f64 {
        if residual.passes.is_empty() && residual.coarse.is_none() {
            return 0.0;
        }
        let samples = &self.samples;
        let trust_bars = |i: usize| [samples[i].trust.f64(), samples[i].value.f64()];
        let smoothing_bar = near.pull_trust(residual, trust_bars, &mut self.trust);
        let trust = &self.trust;
        parallel::for_each(&mut self.samples, |i, bars| {
            let [slope, area, _] = trust[i];
            bars.slope += T::of(slope);
            bars.area += T::of(area);
        });
        smoothing_bar
    }

    /// From the slopes before the first pass to places and normals.
    fn pull_slopes(&mut self, near: &GridSamples<'_, T>, chi: Cells<'_, T>) {
        let (layer, corrections) = (&self.pass.layer, &self.corrections);
        near.for_each(
            &mut self.samples,
            #[inline(always)]
            |i, bars| {
                let before = near.derivatives(chi, i, |corner| layer.read(corrections, corner));
                let Some(before) = before else { return };
                let bend = vector::scale(before.bend(near.samples.normals[i]), bars.slope);
                let of_normal = vector::scale(before.gradient, bars.slope);
                bars.normal = vector::add(bars.normal, of_normal);
                bars.place = vector::add(bars.place, bend);
            },
        );
    }

    /// Adds to `field` what [`forward`](super::forward) subtracted from `χ`.
    pub(crate) fn add_corrections(&self, field: &mut BlockField<T>) {
        let (layer, mut field) = (&self.pass.layer, CellsMut::Blocks(field));
        layer.zip_rows(&self.corrections, &mut field, |e, field| {
            for (value, &e) in field.iter_mut().zip(e) {
                *value += e;
            }
        });
    }

    /// `Σ f(start, corrections)` over the rows of cells along z near the samples: `start` is the place of the first
    /// cell in memory, `corrections` is what [`forward`](super::forward) subtracted from `χ` there. In one fixed order.
    pub(crate) fn sum_of_corrections(
        &self,
        grid: &Grid<T>,
        f: impl Fn(usize, &[T]) -> f64 + Sync,
    ) -> f64 {
        let of_block = |block: usize, corrections: &[T]| -> f64 {
            let rows = self.pass.layer.rows(block, grid.shape());
            let rows = rows.zip(corrections.chunks_exact(EDGE));
            let rows = rows.filter_map(|(row, corrections)| Some((row?, corrections)));
            rows.map(|((start, count), corrections)| f(start, &corrections[..count]))
                .sum()
        };
        let blocks = parallel::map_each(self.corrections.chunks_exact(NODES), of_block);
        blocks.iter().sum()
    }
}

impl<T: Real> GridSamples<'_, T> {
    /// Adds cotangents in index coordinates and cells² to `out`, in the user's units.
    fn add(&self, samples: &[SampleBars<T>], out: &mut SampleCotangent<T>) {
        parallel::for_each(&mut out.normals, |i, bar| {
            *bar = vector::add(*bar, samples[i].normal);
        });
        let per_cell = T::one() / self.grid.spacing();
        out.add(self.grid, self.samples, self.in_cells, |i| {
            (vector::scale(samples[i].place, per_cell), samples[i].area)
        });
    }
}
