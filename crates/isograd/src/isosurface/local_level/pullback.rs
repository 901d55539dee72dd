//! Cotangents of the indicator to cotangents of its values at the samples, of points, areas and grid.

use rayon::prelude::*;

use super::Residual;
use super::blocks::{Blocks, NODES, Overlap};
use super::forward::{Near, Node};
use crate::data::GridCotangent;
use crate::splat::{self, SampleCotangent, Samples};
use crate::{Grid, Real, parallel, simd, vector};

/// Memory of the pullback, kept between calls.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    blocks: Blocks,
    /// `D` and `e` at the cells of the blocks, then `R̄` in place of `D`; `D̄ = −R̄ e`.
    nodes: Vec<Node<T>>,
    /// `Ē`.
    total: Vec<T>,
    /// `r̄`, and the cotangents of index coordinates and of `â`.
    samples: Vec<Bars<T>>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Bars<T> {
    offset: T,
    place: [T; 3],
    area: T,
}

/// Writes into `values_bar` `(N,)` the cotangents of `χ(x_i)`, and adds to `out` what the cotangents `chi_bar` of
/// the indicator that came out mean for points, areas and grid. Those of the indicator that went in are `chi_bar`
/// too. All else is as it was in [`forward`](super::forward). Returns the cotangent of the iso-value.
#[allow(clippy::too_many_arguments)]
pub fn pullback<T: Real>(
    grid: &Grid<T>,
    samples: Samples<'_, T>,
    area_weights: bool,
    order: &splat::Residual,
    residual: &Residual<T>,
    chi_bar: &[T],
    scratch: &mut PullbackScratch<T>,
    values_bar: &mut Vec<T>,
    out: &mut SampleCotangent<T>,
) -> f64 {
    let near = Near::new(grid, samples, area_weights);
    scratch.start(grid, samples.points, order, chi_bar);
    let PullbackScratch {
        blocks,
        nodes,
        total,
        samples: found,
    } = scratch;
    for pass in residual.passes.iter().rev() {
        near.average(blocks, |i| pass.offsets[i], nodes);
        near.pull_nodes(blocks, total, found, pass.gain, nodes);
        let chunks = found.par_chunks_mut(parallel::CHUNK).enumerate();
        chunks.for_each(|(chunk, found)| {
            simd::dispatch(
                pulp::Arch::new(),
                #[inline(always)]
                || {
                    for (n, found) in found.iter_mut().enumerate() {
                        let i = chunk * parallel::CHUNK + n;
                        let mean_bar =
                            near.pull_sample(blocks, nodes, i, pass.gain, pass.offsets[i], found);
                        found.offset += near.area(i) * residual.trust(i) * mean_bar;
                    }
                },
            );
        });
    }
    let offsets = found.par_iter().map(|found| found.offset);
    offsets.collect_into_vec(values_bar);
    near.add(found, out);
    let [sum] = parallel::sum_array(found.len(), |i| [found[i].offset.f64()]);
    -sum
}

impl<T: Real> PullbackScratch<T> {
    fn start(&mut self, grid: &Grid<T>, points: &[[T; 3]], order: &splat::Residual, chi_bar: &[T]) {
        self.blocks.build(grid, points, &order.order);
        self.samples.clear();
        self.samples.resize(points.len(), Bars::default());
        self.total.clear();
        self.total.resize(self.blocks.len() * NODES, T::zero());
        let blocks = &self.blocks;
        let work = self.total.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, total)| {
            let rows = blocks.rows(block, grid.shape());
            for (row, total) in rows.zip(total.chunks_exact_mut(super::blocks::EDGE)) {
                let Some((start, count)) = row else { continue };
                let bars = &chi_bar[start..start + count];
                for (total, &bar) in total.iter_mut().zip(bars) {
                    *total = -bar;
                }
            }
        });
    }
}

impl<T: Real> Near<'_, T> {
    /// Writes `R̄` over `D` at every node.
    fn pull_nodes(
        &self,
        blocks: &Blocks,
        total: &[T],
        found: &[Bars<T>],
        gain: T,
        nodes: &mut [Node<T>],
    ) {
        let work = nodes.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, nodes)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    let mut bars = [T::zero(); NODES];
                    bars.copy_from_slice(&total[block * NODES..(block + 1) * NODES]);
                    self.subtract_samples(blocks, block, found, &mut bars);
                    for (node, &bar) in nodes.iter_mut().zip(&bars) {
                        node.area = gain * bar / node.area;
                    }
                },
            );
        });
    }

    /// `−Σ_i T_o(x_i) r̄_i` at the cells of a block.
    #[inline(always)]
    fn subtract_samples(
        &self,
        blocks: &Blocks,
        block: usize,
        found: &[Bars<T>],
        bars: &mut [T; NODES],
    ) {
        let corner = blocks.corner(block);
        for i in blocks.samples(block) {
            let Some(stencil) = self.stencil(i) else {
                continue;
            };
            let corners = stencil.corners();
            let ([x, y, z], bar) = (corners.weights(), found[i].offset);
            Overlap::new(corners.corner, 2, corner).for_each(
                #[inline(always)]
                |i, j, k, at| bars[at] -= bar * x[i] * y[j] * z[k],
            );
        }
    }

    /// From the nodes to sample `i`, whose `ω r` before the pass is `r` and whose `r̄` after it is `found.offset`.
    /// Returns `Σ_o B_o(x_i) R̄_o`.
    #[inline(always)]
    fn pull_sample(
        &self,
        blocks: &Blocks,
        nodes: &[Node<T>],
        i: usize,
        gain: T,
        r: T,
        found: &mut Bars<T>,
    ) -> T {
        let Some(stencil) = self.stencil(i) else {
            return T::zero();
        };
        let corners = stencil.corners();
        let around: [[[Node<T>; 2]; 2]; 2] = blocks.read(nodes, corners.corner);
        let means = std::array::from_fn(|c| around[c >> 2][c >> 1 & 1][c & 1].mean);
        let slope = vector::scale(corners.gradient(means), -gain * found.offset);
        let near: [[[Node<T>; 3]; 3]; 3] = blocks.read(nodes, stencil.corner);
        let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
        let (mut mean_bar, mut both) = (T::zero(), T::zero());
        let mut gradient = [T::zero(); 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    let Node {
                        area: of_mean,
                        mean,
                    } = near[i][j][k];
                    // ω r R̄ + D̄.
                    let sum = of_mean * (r - mean);
                    let weight = x[i] * y[j] * z[k];
                    mean_bar += weight * of_mean;
                    both += weight * sum;
                    gradient[0] += dx[i] * y[j] * z[k] * sum;
                    gradient[1] += x[i] * dy[j] * z[k] * sum;
                    gradient[2] += x[i] * y[j] * dz[k] * sum;
                }
            }
        }
        let area = self.area(i);
        let place = vector::add(slope, vector::scale(gradient, area));
        found.place = vector::add(found.place, place);
        found.area += both;
        mean_bar
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
        let bars = out.points.par_iter_mut().zip(&mut out.areas).enumerate();
        bars.for_each(|(i, (point_bar, area_bar))| {
            *point_bar = vector::add(*point_bar, point(i));
            *area_bar += area(i);
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
