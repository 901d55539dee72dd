//! Cotangents of the indicator that came out to those of the one that went in, of its values at the samples, and of
//! points, normals, areas and grid.

use rayon::prelude::*;

use super::blocks::{Blocks, EDGE, NODES};
use super::forward::{Near, Node, Seen};
use super::gain::Sums;
use super::pull_cells::NodeBars;
use super::{Pass, Residual};
use crate::splat::{self, SampleCotangent, Samples};
use crate::{Field, Grid, Real, parallel, vector};

/// Memory of the pullback, kept between calls.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    pub(super) blocks: Blocks,
    /// `D` and `e` at the cells of the blocks.
    pub(super) nodes: Vec<Node<T>>,
    /// `M̄` and `D̄` there.
    pub(super) node_bars: Vec<NodeBars<T>>,
    /// `Ē`; in the end what is added to `χ̄`.
    pub(super) total: Vec<T>,
    /// `Σ λ e`.
    taken: Vec<T>,
    /// What the pass said at the samples, and the cotangents of that.
    seen: Vec<Seen<T>>,
    pub(super) seen_bars: Vec<Seen<T>>,
    samples: Vec<Bars<T>>,
    /// Cotangents of slopes and areas for those of trust and shifts.
    trust: Vec<[f64; 3]>,
}

/// Cotangents of what the stage is given besides the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Of the iso-value `c`.
    pub level: f64,
    /// Of the smoothing `σ`, in cells, as far as trust and shifts depend on it.
    pub smoothing: f64,
}

/// Cotangents at a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bars<T> {
    /// `r̄`.
    pub(super) value: T,
    /// `ū`.
    pub(super) slope: T,
    /// `ω̄`.
    pub(super) trust: T,
    /// Of the index coordinates.
    pub(super) place: [T; 3],
    pub(super) normal: [T; 3],
    /// Of `â`.
    pub(super) area: T,
}

/// Writes into `values_bar` `(N,)` the cotangents of `χ(x_i)`, and adds to `out` what the cotangents `chi_bar` of
/// the indicator that came out mean for points, normals, areas and grid. `chi_bar` becomes that of the indicator that
/// went in, but for what `values_bar` means for it. `chi` is what came out; all else is as it was in
/// [`forward`](super::forward).
#[allow(clippy::too_many_arguments)]
pub fn pullback<T: Real>(
    chi: &Field<T>,
    samples: Samples<'_, T>,
    area_weights: bool,
    order: &splat::Residual,
    residual: &Residual<T>,
    chi_bar: &mut [T],
    scratch: &mut PullbackScratch<T>,
    values_bar: &mut Vec<T>,
    out: &mut SampleCotangent<T>,
) -> Found {
    let grid = chi.grid();
    let near = Near::new(grid, samples, area_weights);
    scratch.start(grid, samples.points, order, chi_bar);
    let mut flattened_bar = 0.0;
    for pass in residual.passes.iter().rev() {
        flattened_bar = scratch.pull_pass(&near, pass, &residual.trust, flattened_bar);
    }
    let smoothing = scratch.pull_trust(&near, residual);
    scratch.pull_slopes(&near, chi);
    near.spread_slopes(&scratch.blocks, &scratch.samples, &mut scratch.total);
    let blocks = &scratch.blocks;
    blocks.zip_rows(&scratch.total, grid.shape(), chi_bar, |part, bars| {
        for (bar, &part) in bars.iter_mut().zip(part) {
            *bar += part;
        }
    });
    let found = &scratch.samples;
    let values = found.par_iter().map(|found| found.value);
    values.collect_into_vec(values_bar);
    near.add(found, out);
    let [sum] = parallel::sum_array(found.len(), |i| [found[i].value.f64()]);
    Found {
        level: -sum,
        smoothing,
    }
}

impl<T: Real> PullbackScratch<T> {
    fn start(&mut self, grid: &Grid<T>, points: &[[T; 3]], order: &splat::Residual, chi_bar: &[T]) {
        self.blocks.build(grid, points, &order.order);
        self.samples.clear();
        self.samples.resize(points.len(), Bars::default());
        self.seen_bars.resize(points.len(), Seen::default());
        self.total.clear();
        self.total.resize(self.blocks.len() * NODES, T::zero());
        self.taken.clear();
        self.taken.resize(self.total.len(), T::zero());
        let blocks = &self.blocks;
        let work = self.total.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, total)| {
            let rows = blocks.rows(block, grid.shape());
            for (row, total) in rows.zip(total.chunks_exact_mut(EDGE)) {
                let Some((start, count)) = row else { continue };
                let bars = &chi_bar[start..start + count];
                for (total, &bar) in total.iter_mut().zip(bars) {
                    *total = -bar;
                }
            }
        });
    }

    /// One pass backwards. Takes and returns the cotangent of the share of the slope that is gone.
    fn pull_pass(
        &mut self,
        near: &Near<'_, T>,
        pass: &Pass<T>,
        trust: &[T],
        flattened_bar: f64,
    ) -> f64 {
        near.average(&self.blocks, &pass.offsets, &mut self.nodes);
        near.see(&self.blocks, &self.nodes, &pass.offsets, &mut self.seen);
        near.accumulate(&self.nodes, T::of(pass.gain), &mut self.taken);
        let gain_bar = self.gain_bar();
        let (sums_bar, before_bar) = pass.sums.pullback(pass.flattened, gain_bar, flattened_bar);
        self.pull_seen(near, pass, sums_bar);
        near.pull_nodes(self, pass);
        let Self {
            blocks,
            nodes,
            node_bars,
            seen,
            seen_bars,
            samples,
            ..
        } = self;
        near.for_each(
            samples,
            #[inline(always)]
            |i, found| {
                let (s, cells) = (pass.offsets[i], (&nodes[..], &node_bars[..]));
                let s_bar = offset_bar(near, pass, &seen[i], sums_bar, i)
                    + near.pull_sample(blocks, cells, i, s, &seen_bars[i], found);
                found.value += trust[i] * s_bar;
                // Where nothing is followed, the slope of ω is 0.
                if trust[i] > T::zero() {
                    found.trust += s_bar * s / trust[i];
                }
            },
        );
        before_bar
    }

    /// `λ̄`, but for the share of the slope.
    fn gain_bar(&self) -> f64 {
        let Self {
            nodes,
            total,
            seen,
            samples,
            ..
        } = self;
        let blocks = nodes.par_chunks(NODES).zip(total.par_chunks(NODES));
        let of_blocks = blocks.map(|(nodes, total)| {
            let products = nodes.iter().zip(total);
            products.map(|(n, t)| n.mean.f64() * t.f64()).sum::<f64>()
        });
        let of_cells: f64 = of_blocks.collect::<Vec<f64>>().iter().sum();
        let [of_samples] = parallel::sum_array(seen.len(), |i| {
            let (found, seen) = (samples[i], seen[i]);
            [(found.value * seen.mean + found.slope * seen.slope).f64()]
        });
        of_cells - of_samples
    }

    /// Cotangents of what the pass said at the samples, and of slopes and areas in the sums.
    fn pull_seen(&mut self, near: &Near<'_, T>, pass: &Pass<T>, bars: Sums) {
        let (gain, seen) = (T::of(pass.gain), &self.seen);
        let [rise, slope, agreement, offset, forecast] = bars.to_array().map(T::of);
        let two = T::of(2.0);
        let work = self.samples.par_iter_mut().zip(&mut self.seen_bars);
        work.enumerate().for_each(|(i, (found, out))| {
            let Seen {
                slope: w,
                without_it: p,
                ..
            } = seen[i];
            let (a, s, u) = (near.area(i), pass.offsets[i], pass.slopes[i]);
            *out = Seen {
                mean: -gain * found.value,
                slope: a * rise * u - gain * found.slope,
                without_it: a * (agreement * s + two * forecast * p),
            };
            found.slope += a * (rise * w + two * slope * u);
            found.area += rise * w * u
                + slope * u * u
                + agreement * s * p
                + offset * s * s
                + forecast * p * p;
        });
    }

    /// From trust and shifts to slopes and areas. Returns the cotangent of the smoothing.
    fn pull_trust(&mut self, near: &Near<'_, T>, residual: &Residual<T>) -> f64 {
        // Where no pass was made there is nothing to pull.
        let Some(first) = residual.passes.first() else {
            return 0.0;
        };
        let samples = &self.samples;
        let found = |i: usize| [samples[i].trust.f64(), samples[i].value.f64()];
        let smoothing_bar = near.pull_trust(&first.slopes, residual, found, &mut self.trust);
        let samples = self.samples.par_iter_mut().zip(&self.trust);
        samples.for_each(|(found, &[slope, area, _])| {
            found.slope += T::of(slope);
            found.area += T::of(area);
        });
        smoothing_bar
    }

    /// From the slopes before the first pass to places and normals.
    fn pull_slopes(&mut self, near: &Near<'_, T>, chi: &Field<T>) {
        let (blocks, taken) = (&self.blocks, &self.taken);
        near.for_each(
            &mut self.samples,
            #[inline(always)]
            |i, found| {
                let Some(edge) = near.edge(chi, i, |corner| blocks.read(taken, corner)) else {
                    return;
                };
                let bend = vector::scale(edge.bend(near.samples.normals[i]), found.slope);
                let of_normal = vector::scale(edge.gradient, found.slope);
                found.normal = vector::add(found.normal, of_normal);
                found.place = vector::add(found.place, bend);
            },
        );
    }

    /// `Σ f(row)` over the rows of cells along z near the samples: `f` is given the place of the first in memory and,
    /// for each, what [`forward`](super::forward) took off `χ`. In one fixed order.
    pub(crate) fn sum_of_taken(
        &self,
        grid: &Grid<T>,
        f: impl Fn(usize, &[T]) -> f64 + Sync,
    ) -> f64 {
        let of_block = |(block, taken): (usize, &[T])| {
            let rows = self.blocks.rows(block, grid.shape());
            let rows = rows.zip(taken.chunks_exact(EDGE));
            let rows = rows.filter_map(|(row, taken)| Some((row?, taken)));
            rows.map(|((start, count), taken)| f(start, &taken[..count]))
                .sum()
        };
        let blocks = self.taken.par_chunks_exact(NODES).enumerate();
        blocks.map(of_block).collect::<Vec<f64>>().iter().sum()
    }
}

/// `s̄` in the sums.
#[inline(always)]
fn offset_bar<T: Real>(
    near: &Near<'_, T>,
    pass: &Pass<T>,
    seen: &Seen<T>,
    bars: Sums,
    i: usize,
) -> T {
    let (p, s) = (seen.without_it, pass.offsets[i]);
    near.area(i) * (T::of(bars.agreement) * p + T::of(2.0 * bars.offset) * s)
}

impl<T: Real> Near<'_, T> {
    /// From index coordinates and areas in cells to those of the user.
    fn add(&self, found: &[Bars<T>], out: &mut SampleCotangent<T>) {
        let normals = out.normals.par_iter_mut().zip(found);
        normals.for_each(|(bar, found)| *bar = vector::add(*bar, found.normal));
        let per_cell = T::one() / self.grid.spacing();
        out.add(self.grid, self.samples, self.area_weights, |i| {
            (vector::scale(found[i].place, per_cell), found[i].area)
        });
    }
}
