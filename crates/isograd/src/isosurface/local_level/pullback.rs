//! Cotangents of the indicator that came out to those of the one that went in, of its values at the samples, and of
//! points, normals, areas and grid.

use rayon::prelude::*;

use super::blocks::{Blocks, EDGE, NODES, Overlap};
use super::forward::{Near, Node, Seen};
use super::gain::Sums;
use super::stencil::Stencil;
use super::{Pass, Residual};
use crate::data::GridCotangent;
use crate::splat::{self, SampleCotangent, Samples};
use crate::{Grid, Real, parallel, simd, vector};

/// Memory of the pullback, kept between calls.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    blocks: Blocks,
    /// `D` and `e` at the cells of the blocks.
    nodes: Vec<Node<T>>,
    /// `M̄` and `D̄` there.
    node_bars: Vec<NodeBars<T>>,
    /// `Ē`; in the end what is added to `χ̄`.
    total: Vec<T>,
    /// `Σ λ e`.
    taken: Vec<T>,
    /// What the pass said at the samples, and the cotangents of that.
    seen: Vec<Seen<T>>,
    seen_bars: Vec<Seen<T>>,
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
struct Bars<T> {
    /// `r̄`.
    value: T,
    /// `ū`.
    slope: T,
    /// `ω̄`.
    trust: T,
    /// Of the index coordinates.
    place: [T; 3],
    normal: [T; 3],
    /// Of `â`.
    area: T,
}

/// Cotangents at a cell.
#[derive(Clone, Copy, Debug, Default)]
struct NodeBars<T> {
    /// `M̄`.
    sum: T,
    /// `D̄`.
    area: T,
}

/// Writes into `values_bar` `(N,)` the cotangents of `χ(x_i)`, and adds to `out` what the cotangents `chi_bar` of
/// the indicator that came out mean for points, normals, areas and grid. `chi_bar` becomes that of the indicator that
/// went in, but for what `values_bar` means for it. All else is as it was in [`forward`](super::forward).
#[allow(clippy::too_many_arguments)]
pub fn pullback<T: Real>(
    grid: &Grid<T>,
    samples: Samples<'_, T>,
    area_weights: bool,
    order: &splat::Residual,
    residual: &Residual<T>,
    chi_bar: &mut [T],
    scratch: &mut PullbackScratch<T>,
    values_bar: &mut Vec<T>,
    out: &mut SampleCotangent<T>,
) -> Found {
    let near = Near::new(grid, samples, area_weights);
    scratch.start(grid, samples.points, order, chi_bar);
    let mut flattened_bar = 0.0;
    for pass in residual.passes.iter().rev() {
        flattened_bar = scratch.pull_pass(&near, pass, &residual.trust, flattened_bar);
    }
    let smoothing = scratch.pull_trust(&near, residual);
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
        let gain = T::of(pass.gain);
        let taken = self.taken.par_iter_mut().zip(&self.nodes);
        taken.for_each(|(taken, node)| *taken += gain * node.mean);
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
        let chunks = samples.par_chunks_mut(parallel::CHUNK).enumerate();
        chunks.for_each(|(chunk, samples)| {
            simd::dispatch(
                near.arch,
                #[inline(always)]
                || {
                    for (n, found) in samples.iter_mut().enumerate() {
                        let i = chunk * parallel::CHUNK + n;
                        let s = pass.offsets[i];
                        let direct = offset_bar(near, pass, &seen[i], sums_bar, i);
                        let s_bar = direct
                            + near.pull_sample(
                                blocks,
                                (nodes, node_bars),
                                i,
                                s,
                                &seen_bars[i],
                                found,
                            );
                        found.value += trust[i] * s_bar;
                        // Where nothing is followed, the slope of ω is 0.
                        if trust[i] > T::zero() {
                            found.trust += s_bar * s / trust[i];
                        }
                    }
                },
            );
        });
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
        let [of_cells] =
            parallel::sum_array(nodes.len(), |o| [total[o].f64() * nodes[o].mean.f64()]);
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

    /// From trust and shifts to slopes and areas, and from slopes to places and normals.
    fn pull_trust(&mut self, near: &Near<'_, T>, residual: &Residual<T>) -> f64 {
        let samples = &self.samples;
        let found = |i: usize| [samples[i].trust.f64(), samples[i].value.f64()];
        let smoothing_bar = near.pull_trust(residual, found, &mut self.trust);
        let samples = self.samples.par_iter_mut();
        let parts = self.trust.par_iter().zip(&residual.edges);
        samples
            .zip(parts)
            .for_each(|(found, (&[slope, area, _], edge))| {
                found.slope += T::of(slope);
                found.area += T::of(area);
                let [of_normal, of_place] =
                    [edge.gradient, edge.bend].map(|v| vector::scale(v, found.slope));
                found.normal = vector::add(found.normal, of_normal);
                found.place = vector::add(found.place, of_place);
            });
        smoothing_bar
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

/// Adds `v·∇B` to the cells of a block.
#[inline(always)]
fn spread_slope<T: Real>(stencil: &Stencil<T>, v: [T; 3], block: [usize; 3], nodes: &mut [T]) {
    let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
    Overlap::new(stencil.corner, 3, block).for_each(
        #[inline(always)]
        |i, j, k, at| {
            let flat = v[0] * dx[i] * y[j] + v[1] * x[i] * dy[j];
            nodes[at] += flat * z[k] + v[2] * x[i] * y[j] * dz[k];
        },
    );
}

impl<T: Real> Near<'_, T> {
    /// Writes `M̄` and `D̄` at every node.
    fn pull_nodes(&self, scratch: &mut PullbackScratch<T>, pass: &Pass<T>) {
        let PullbackScratch {
            blocks,
            nodes,
            node_bars,
            total,
            seen_bars,
            ..
        } = scratch;
        let gain = T::of(pass.gain);
        node_bars.resize(nodes.len(), NodeBars::default());
        let work = node_bars.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, bars)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    let cells = block * NODES..(block + 1) * NODES;
                    let (nodes, total) = (&nodes[cells.clone()], &total[cells]);
                    let mut means = [T::zero(); NODES];
                    for (mean, &total) in means.iter_mut().zip(total) {
                        *mean = gain * total;
                    }
                    bars.fill(NodeBars::default());
                    for i in blocks.samples(block) {
                        let bar = (&seen_bars[i], pass.offsets[i]);
                        self.pull_to_nodes(i, bar, blocks.corner(block), nodes, &mut means, bars);
                    }
                    for ((bars, node), mean) in bars.iter_mut().zip(nodes).zip(means) {
                        let sum = mean / node.area;
                        bars.sum += sum;
                        bars.area -= sum * node.mean;
                    }
                },
            );
        });
    }

    /// Adds what sample `i` says of the cells of a block: `ē`, and `M̄` and `D̄` of the forecast without it.
    #[inline(always)]
    fn pull_to_nodes(
        &self,
        i: usize,
        (bar, s): (&Seen<T>, T),
        block: [usize; 3],
        nodes: &[Node<T>],
        means: &mut [T; NODES],
        bars: &mut [NodeBars<T>],
    ) {
        let Some(stencil) = self.stencil(i) else {
            return;
        };
        let slope = vector::scale(self.samples.normals[i], bar.slope);
        spread_slope(&stencil, slope, block, means);
        let ([x, y, z], area, corners) = (stencil.weights(), self.area(i), stencil.corners());
        let [px, py, pz] = corners.place;
        let lowest = std::array::from_fn(|a| stencil.corner[a] + corners.place[a]);
        Overlap::new(lowest, 2, block).for_each(
            #[inline(always)]
            |i, j, k, at| {
                let (weight, _) = corners.weight_and_slope([i, j, k]);
                means[at] += weight * bar.mean;
                let mine = area * x[px + i] * y[py + j] * z[pz + k];
                let [without, others] = nodes[at].without(mine, s);
                let part = weight * bar.without_it / others;
                bars[at].sum += part;
                bars[at].area -= part * without;
            },
        );
    }

    /// From the nodes to sample `i`, whose `ω r` before the pass is `s`. Returns `s̄`, but for that in the sums.
    #[inline(always)]
    fn pull_sample(
        &self,
        blocks: &Blocks,
        (nodes, node_bars): (&[Node<T>], &[NodeBars<T>]),
        i: usize,
        s: T,
        bar: &Seen<T>,
        found: &mut Bars<T>,
    ) -> T {
        let Some(stencil) = self.stencil(i) else {
            return T::zero();
        };
        let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
        let (area, corners) = (self.area(i), stencil.corners());
        let near: [[[Node<T>; 3]; 3]; 3] = blocks.read(nodes, stencil.corner);
        let bars: [[[NodeBars<T>; 3]; 3]; 3] = blocks.read(node_bars, stencil.corner);
        // s M̄ + D̄, and the cotangents of the weights that the sample is left out with.
        let mut weights_bar = bars.map(|plane| plane.map(|row| row.map(|b| s * b.sum + b.area)));
        let (mut s_bar, mut place) = (T::zero(), [T::zero(); 3]);
        for ([i, j, k], at) in corners.cells() {
            let (weight, slope) = corners.weight_and_slope(at);
            let mine = area * x[i] * y[j] * z[k];
            let [without, others] = near[i][j][k].without(mine, s);
            let part = weight * bar.without_it / others;
            weights_bar[i][j][k] += part * (without - s);
            s_bar -= part * mine;
            let value_bar = bar.mean * near[i][j][k].mean + bar.without_it * without;
            place = vector::add(place, vector::scale(slope, value_bar));
        }
        let mut both = T::zero();
        let mut gradient = [T::zero(); 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    let bar = weights_bar[i][j][k];
                    let weight = x[i] * y[j] * z[k];
                    s_bar += area * weight * bars[i][j][k].sum;
                    both += weight * bar;
                    gradient[0] += dx[i] * y[j] * z[k] * bar;
                    gradient[1] += x[i] * dy[j] * z[k] * bar;
                    gradient[2] += x[i] * y[j] * dz[k] * bar;
                }
            }
        }
        let of_mean = stencil.derivatives(|i, j| near[i][j].map(|node| node.mean));
        place = vector::add(place, vector::scale(gradient, area));
        let bend = of_mean.bend(self.samples.normals[i]);
        place = vector::add(place, vector::scale(bend, bar.slope));
        found.place = vector::add(found.place, place);
        let normal = vector::scale(of_mean.gradient, bar.slope);
        found.normal = vector::add(found.normal, normal);
        found.area += both;
        s_bar
    }

    /// Writes into `nodes` what the slopes `u` before the first pass mean for the cells.
    fn spread_slopes(&self, blocks: &Blocks, found: &[Bars<T>], nodes: &mut [T]) {
        let work = nodes.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, nodes)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    nodes.fill(T::zero());
                    for i in blocks.samples(block) {
                        let Some(stencil) = self.stencil(i) else {
                            continue;
                        };
                        let slope = vector::scale(self.samples.normals[i], found[i].slope);
                        spread_slope(&stencil, slope, blocks.corner(block), nodes);
                    }
                },
            );
        });
    }

    /// From index coordinates and areas in cells to those of the user.
    fn add(&self, found: &[Bars<T>], out: &mut SampleCotangent<T>) {
        let h = self.grid.spacing();
        let points = self.samples.points;
        let area = |i: usize| match self.area_weights {
            true => found[i].area / h / h,
            false => found[i].area,
        };
        let point = |i: usize| vector::scale(found[i].place, T::one() / h);
        let bars = out.points.par_iter_mut().zip(&mut out.areas);
        let bars = bars.zip(&mut out.normals).enumerate();
        bars.for_each(|(i, ((point_bar, area_bar), normal_bar))| {
            *point_bar = vector::add(*point_bar, point(i));
            *area_bar += area(i);
            *normal_bar = vector::add(*normal_bar, found[i].normal);
        });
        let [x, y, z, spacing] = parallel::sum_array(points.len(), |i| {
            let mut part = GridCotangent::default();
            part.subtract_point(self.grid, points[i], point(i));
            if self.area_weights {
                let share = self.area(i) * found[i].area / h;
                part.spacing -= 2.0 * share.f64();
            }
            let [x, y, z] = part.lower;
            [x, y, z, part.spacing]
        });
        out.grid.lower = vector::add(out.grid.lower, [x, y, z]);
        out.grid.spacing += spacing;
    }
}
