//! From samples to the cells near them and back: the loops of [`pullback`](super::pullback()).

use rayon::prelude::*;

use super::Pass;
use super::blocks::{Blocks, NODES, Overlap};
use super::forward::{Near, Node, Seen, means};
use super::pullback::{Bars, PullbackScratch};
use super::stencil::{CUBE, Stencil};
use crate::{Real, simd, vector};

/// Cotangents at a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeBars<T> {
    /// `M̄`.
    pub(super) sum: T,
    /// `D̄`.
    pub(super) area: T,
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
    pub(super) fn pull_nodes(&self, scratch: &mut PullbackScratch<T>, pass: &Pass<T>) {
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
    pub(super) fn pull_sample(
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
        let mut weights_bar = [[[T::zero(); 3]; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    weights_bar[i][j][k] = s * bars[i][j][k].sum + bars[i][j][k].area;
                }
            }
        }
        let (mut s_bar, mut place) = (T::zero(), [T::zero(); 3]);
        for at in CUBE {
            let [i, j, k] = corners.cell(at);
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
        let of_mean = stencil.derivatives(
            #[inline(always)]
            |i, j| means(&near[i][j]),
        );
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
    pub(super) fn spread_slopes(&self, blocks: &Blocks, found: &[Bars<T>], nodes: &mut [T]) {
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
}
