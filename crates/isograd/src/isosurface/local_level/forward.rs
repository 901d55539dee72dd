//! The forward map: means over the samples near each cell, and how far they are to be trusted.

use pulp::Arch;
use rayon::prelude::*;

use super::blocks::{Blocks, NODES, Overlap};
use super::gain::Sums;
use super::stencil::{CUBE, Stencil};
use super::{PASSES, Pass, Residual};
use crate::element::plate::least_area;
use crate::isosurface::iso_value;
use crate::splat::{self, Samples};
use crate::{Field, Grid, Real, parallel, simd, vector};

/// Memory of the stage, kept between calls: some numbers for each cell of the layer round the surface, and for
/// each sample.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    blocks: Blocks,
    /// `D` and `e` at the cells of the blocks.
    nodes: Vec<Node<T>>,
    /// `Σ λ e`.
    total: Vec<T>,
    /// `r` at the samples, as it is now.
    now: Vec<T>,
    /// What the pass says at the samples.
    seen: Vec<Seen<T>>,
}

/// What there is to choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Whether areas count in cells², or each sample as 1.
    pub area_weights: bool,
    /// Width `σ` of the smoothing of the indicator, in cells.
    pub smoothing: f64,
    /// Whether parts thinner than a cell are followed and made thicker: see [`Level::Thin`](crate::isosurface::Level).
    pub thin: bool,
}

/// What a pass has at a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node<T> {
    /// `D_o`.
    pub(super) area: T,
    /// `e_o`.
    pub(super) mean: T,
}

/// What a pass says at a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen<T> {
    /// `m`: `e`, trilinear.
    pub(super) mean: T,
    /// `w`: the slope of `e` along the normal, per cell.
    pub(super) slope: T,
    /// `p`: `e`, trilinear, found without the sample.
    pub(super) without_it: T,
}

/// Takes the local part of the iso-value off `chi`, so that the surface is where it equals the global one. `level`
/// is what [`iso_value::forward`] kept of `chi`, and `order` lists the samples as the splat's
/// [`Residual`](splat::Residual) does. The same bits for any number of threads.
pub fn forward<T: Real>(
    chi: &mut Field<T>,
    samples: Samples<'_, T>,
    choice: Choice,
    level: &iso_value::Residual<T>,
    order: &splat::Residual,
    scratch: &mut Scratch<T>,
    residual: &mut Residual<T>,
) {
    let grid = *chi.grid();
    let near = Near::new(&grid, samples, choice.area_weights);
    scratch.start(&near, order, level);
    let mut slopes = std::mem::take(residual.slopes());
    near.trust(chi, choice, &mut scratch.now, &mut slopes, residual);
    *residual.slopes() = slopes;
    let mut flattened = 0.0;
    let mut made = 0;
    while made < PASSES {
        if residual.passes.len() == made {
            residual.passes.push(Pass::default());
        }
        let (before, pass) = residual.passes.split_at_mut(made);
        let pass = &mut pass[0];
        pass.flattened = flattened;
        scratch.weigh(&residual.trust, &mut pass.offsets);
        if let Some(before) = before.last() {
            scratch.follow_slopes(before, &mut pass.slopes);
        }
        near.average(&scratch.blocks, &pass.offsets, &mut scratch.nodes);
        let (blocks, seen) = (&scratch.blocks, &mut scratch.seen);
        near.see(blocks, &scratch.nodes, &pass.offsets, seen);
        pass.sums = near.sums(seen, &pass.offsets, &pass.slopes);
        [pass.gain, flattened] = pass.sums.gain(flattened);
        if pass.gain == 0.0 {
            break;
        }
        scratch.apply(&near, T::of(pass.gain));
        made += 1;
    }
    residual.passes.truncate(made);
    let blocks = &scratch.blocks;
    blocks.zip_rows(&scratch.total, grid.shape(), chi.values_mut(), |e, chi| {
        for (chi, &e) in chi.iter_mut().zip(e) {
            *chi -= e;
        }
    });
}

impl<T: Real> Scratch<T> {
    /// The blocks, and `χ(x_i) − c`.
    fn start(
        &mut self,
        near: &Near<'_, T>,
        order: &splat::Residual,
        level: &iso_value::Residual<T>,
    ) {
        self.blocks
            .build(near.grid, near.samples.points, &order.order);
        self.total.clear();
        self.total.resize(self.blocks.len() * NODES, T::zero());
        let c = T::of(level.value);
        let values = level.at_samples.par_iter().map(|at| at.value - c);
        values.collect_into_vec(&mut self.now);
    }

    /// `ω r`.
    fn weigh(&self, trust: &[T], offsets: &mut Vec<T>) {
        let now = self.now.par_iter().zip(trust).map(|(&r, &trust)| trust * r);
        now.collect_into_vec(offsets);
    }

    /// `u`: slopes of `χ` along the normals, as they are after the pass `before`.
    fn follow_slopes(&self, before: &Pass<T>, slopes: &mut Vec<T>) {
        let gain = T::of(before.gain);
        let samples = before.slopes.par_iter().zip(&self.seen);
        let now = samples.map(|(&slope, seen)| slope - gain * seen.slope);
        now.collect_into_vec(slopes);
    }

    /// Takes `λ e` off the samples, and adds it to the cells' total.
    fn apply(&mut self, near: &Near<'_, T>, gain: T) {
        near.accumulate(&self.nodes, gain, &mut self.total);
        let samples = self.now.par_iter_mut().zip(&self.seen);
        samples.for_each(|(now, seen)| *now -= gain * seen.mean);
    }
}

/// The samples on their grid.
#[derive(Clone, Copy)]
pub(super) struct Near<'a, T> {
    pub(super) grid: &'a Grid<T>,
    pub(super) samples: Samples<'a, T>,
    pub(super) area_weights: bool,
    pub(super) arch: Arch,
}

impl<'a, T: Real> Near<'a, T> {
    pub(super) fn new(grid: &'a Grid<T>, samples: Samples<'a, T>, area_weights: bool) -> Self {
        Self {
            grid,
            samples,
            area_weights,
            arch: Arch::new(),
        }
    }

    /// `â_i`.
    #[inline(always)]
    pub(super) fn area(&self, i: usize) -> T {
        self.samples.area_in_cells(self.grid, self.area_weights, i)
    }

    #[inline(always)]
    pub(super) fn stencil(&self, i: usize) -> Option<Stencil<T>> {
        Stencil::of(self.grid, self.samples.points[i])
    }

    /// Fills the nodes of the blocks with `D` and `e` for these `ω r`.
    pub(super) fn average(&self, blocks: &Blocks, offsets: &[T], nodes: &mut Vec<Node<T>>) {
        nodes.resize(blocks.len() * NODES, Node::default());
        let work = nodes.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, nodes)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || self.average_block(blocks, block, offsets, nodes),
            );
        });
    }

    #[inline(always)]
    fn average_block(&self, blocks: &Blocks, block: usize, offsets: &[T], nodes: &mut [Node<T>]) {
        nodes.fill(Node::default());
        let corner = blocks.corner(block);
        for i in blocks.samples(block) {
            let Some(stencil) = self.stencil(i) else {
                continue;
            };
            let (area, r) = (self.area(i), offsets[i]);
            let [x, y, z] = stencil.weights();
            Overlap::new(stencil.corner, 3, corner).for_each(
                #[inline(always)]
                |i, j, k, at| {
                    let weight = area * x[i] * y[j] * z[k];
                    nodes[at].area += weight;
                    nodes[at].mean += weight * r;
                },
            );
        }
        for node in nodes {
            node.area += least_area::<T>();
            node.mean /= node.area;
        }
    }

    /// Adds `λ e` to the cells' total.
    pub(super) fn accumulate(&self, nodes: &[Node<T>], gain: T, total: &mut [T]) {
        let blocks = total.par_chunks_mut(NODES).zip(nodes.par_chunks(NODES));
        blocks.for_each(|(total, nodes)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    for (total, node) in total.iter_mut().zip(nodes) {
                        *total += gain * node.mean;
                    }
                },
            );
        });
    }

    /// Runs `f` on what belongs to each sample, compiled for the processor's instruction set.
    #[inline(always)]
    pub(super) fn for_each<E: Send>(&self, items: &mut [E], f: impl Fn(usize, &mut E) + Sync) {
        let chunks = items.par_chunks_mut(parallel::CHUNK).enumerate();
        chunks.for_each(|(chunk, items)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    for (n, item) in items.iter_mut().enumerate() {
                        f(chunk * parallel::CHUNK + n, item);
                    }
                },
            );
        });
    }

    /// What the nodes say at the samples.
    pub(super) fn see(
        &self,
        blocks: &Blocks,
        nodes: &[Node<T>],
        offsets: &[T],
        seen: &mut Vec<Seen<T>>,
    ) {
        seen.resize(offsets.len(), Seen::default());
        self.for_each(
            seen,
            #[inline(always)]
            |i, seen| *seen = self.see_at(blocks, nodes, i, offsets[i]),
        );
    }

    #[inline(always)]
    fn see_at(&self, blocks: &Blocks, nodes: &[Node<T>], i: usize, s: T) -> Seen<T> {
        let Some(stencil) = self.stencil(i) else {
            return Seen::default();
        };
        let near: [[[Node<T>; 3]; 3]; 3] = blocks.read(nodes, stencil.corner);
        let (area, corners, [x, y, z]) = (self.area(i), stencil.corners(), stencil.weights());
        let (mut mean, mut without_it) = (T::zero(), T::zero());
        for at in CUBE {
            let [i, j, k] = corners.cell(at);
            let (weight, _) = corners.weight_and_slope(at);
            let node = near[i][j][k];
            mean += weight * node.mean;
            without_it += weight * node.without(area * x[i] * y[j] * z[k], s)[0];
        }
        let derivatives = stencil.derivatives(
            #[inline(always)]
            |i, j| means(&near[i][j]),
        );
        Seen {
            mean,
            slope: vector::dot(derivatives.gradient, self.samples.normals[i]),
            without_it,
        }
    }

    /// What the gain of a pass is made of.
    fn sums(&self, seen: &[Seen<T>], offsets: &[T], slopes: &[T]) -> Sums {
        Sums::new(parallel::sum_array(seen.len(), |i| {
            let (a, s, u) = (self.area(i).f64(), offsets[i].f64(), slopes[i].f64());
            let (w, p) = (seen[i].slope.f64(), seen[i].without_it.f64());
            [a * w * u, a * u * u, a * s * p, a * s * s, a * p * p]
        }))
    }
}

/// `e` along a row.
#[inline(always)]
pub(super) fn means<T: Real>([a, b, c]: &[Node<T>; 3]) -> [T; 3] {
    [a.mean, b.mean, c.mean]
}

impl<T: Real> Node<T> {
    /// `e` without a sample of this weight and offset, and `D` without it.
    #[inline(always)]
    pub(super) fn without(self, weight: T, offset: T) -> [T; 2] {
        // At least ε, but for rounding.
        let others = (self.area - weight).max(T::of(0.5) * least_area::<T>());
        [(self.mean * self.area - weight * offset) / others, others]
    }
}
