//! The forward map: means over the samples near each cell, and how far they are to be trusted.

use pulp::Arch;
use rayon::prelude::*;

use super::blocks::{Blocks, NODES, Overlap};
use super::stencil::Stencil;
use super::{FLATTENED, LEAST_AREA, PASSES, Pass, Residual};
use crate::isosurface::iso_value::{self, AtSample};
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
    /// `r` and `∇χ` at the samples, as they are now.
    now: Vec<AtSample<T>>,
    /// `ω r`.
    offsets: Vec<T>,
    /// `e` and `∇e` at the samples, and `e` found without the sample.
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
struct Seen<T> {
    mean: T,
    gradient: [T; 3],
    without_it: T,
}

/// Takes the local part of the iso-value off `chi`, so that the surface is where it equals the global one. `level`
/// is what [`iso_value::forward`] kept of `chi`, and `order` lists the samples as the splat's
/// [`Residual`](splat::Residual) does. Gains, trust and shifts are those of `held`, where it is given. The same bits for
/// any number of threads.
#[allow(clippy::too_many_arguments)]
pub fn forward<T: Real>(
    chi: &mut Field<T>,
    samples: Samples<'_, T>,
    choice: Choice,
    level: &iso_value::Residual<T>,
    order: &splat::Residual,
    held: Option<&Residual<T>>,
    scratch: &mut Scratch<T>,
    residual: &mut Residual<T>,
) {
    let grid = *chi.grid();
    let near = Near::new(&grid, samples, choice.area_weights);
    scratch.blocks.build(&grid, samples.points, &order.order);
    scratch.total.clear();
    scratch
        .total
        .resize(scratch.blocks.len() * NODES, T::zero());
    match held {
        Some(held) => {
            residual.trust.clone_from(&held.trust);
            residual.shifts.clone_from(&held.shifts);
        }
        None => near.trust(chi, choice.smoothing, choice.thin, residual),
    }
    scratch.begin(level, residual);
    let mut flattened = 0.0;
    let mut made = 0;
    for pass in 0..held.map_or(PASSES, |held| held.passes.len()) {
        scratch.weigh(residual);
        near.average(&scratch.blocks, |i| scratch.offsets[i], &mut scratch.nodes);
        near.see(
            &scratch.blocks,
            &scratch.nodes,
            &scratch.offsets,
            &mut scratch.seen,
        );
        let gain = match held {
            Some(held) => held.passes[pass].gain,
            None => T::of(scratch.gain(&near, &mut flattened)),
        };
        if !(gain > T::zero()) {
            break;
        }
        residual
            .passes
            .resize_with(residual.passes.len().max(pass + 1), Pass::default);
        let kept = &mut residual.passes[pass];
        kept.gain = gain;
        kept.offsets.clone_from(&scratch.offsets);
        scratch.apply(gain);
        made = pass + 1;
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
    /// The `r` before the first pass.
    fn begin(&mut self, level: &iso_value::Residual<T>, residual: &Residual<T>) {
        let c = T::of(level.value);
        self.now.clone_from(&level.at_samples);
        let now = self.now.par_iter_mut().enumerate();
        now.for_each(|(i, now)| now.value += residual.shift(i) - c);
    }

    fn weigh(&mut self, residual: &Residual<T>) {
        let now = self.now.par_iter().enumerate();
        let offsets = now.map(|(i, now)| residual.trust(i) * now.value);
        offsets.collect_into_vec(&mut self.offsets);
    }

    /// `λ` of a pass, from what it says at the samples. `flattened` is the share of the slope that the passes took.
    fn gain(&self, near: &Near<'_, T>, flattened: &mut f64) -> f64 {
        let (now, offsets, seen) = (&self.now, &self.offsets, &self.seen);
        let [rise, slope, rp, rr, pp] = parallel::sum_array(now.len(), |i| {
            let a = near.area(i).f64();
            let (r, p) = (offsets[i].f64(), seen[i].without_it.f64());
            let [of_mean, of_chi] = [seen[i].gradient, now[i].gradient].map(vector::to_f64);
            [
                a * vector::dot(of_mean, of_chi),
                a * vector::norm_squared(of_chi),
                a * r * p,
                a * r * r,
                a * p * p,
            ]
        });
        let share = (rise / slope).max(0.0);
        // Of r by p − share · r.
        let fit = (rp - share * rr) / (pp - 2.0 * share * rp + share * share * rr);
        let left = 1.0 - (*flattened + share) / FLATTENED;
        // Neither bound is met by what is not a number.
        let gain = fit.min(1.0) * left;
        if !(gain > 0.0) || !(left > 0.0) {
            return 0.0;
        }
        *flattened += gain * share;
        gain
    }

    /// Takes `λ e` off the samples, and adds it to the cells' total.
    fn apply(&mut self, gain: T) {
        let nodes = self.total.par_iter_mut().zip(&self.nodes);
        nodes.for_each(|(total, node)| *total += gain * node.mean);
        let samples = self.now.par_iter_mut().zip(&self.seen);
        samples.for_each(|(now, seen)| {
            now.value -= gain * seen.mean;
            now.gradient = vector::sub(now.gradient, vector::scale(seen.gradient, gain));
        });
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
        let h = self.grid.spacing();
        match self.area_weights {
            true => self.samples.areas[i] / h / h,
            false => self.samples.areas[i],
        }
    }

    #[inline(always)]
    pub(super) fn stencil(&self, i: usize) -> Option<Stencil<T>> {
        Stencil::of(self.grid, self.samples.points[i])
    }

    /// Fills the nodes of the blocks with `D` and `e` for these `ω r`.
    pub(super) fn average(
        &self,
        blocks: &Blocks,
        offset: impl Fn(usize) -> T + Sync,
        nodes: &mut Vec<Node<T>>,
    ) {
        nodes.resize(blocks.len() * NODES, Node::default());
        let work = nodes.par_chunks_exact_mut(NODES).enumerate();
        work.for_each(|(block, nodes)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || self.average_block(blocks, block, &offset, nodes),
            );
        });
    }

    #[inline(always)]
    fn average_block(
        &self,
        blocks: &Blocks,
        block: usize,
        offset: &(impl Fn(usize) -> T + Sync),
        nodes: &mut [Node<T>],
    ) {
        nodes.fill(Node::default());
        let corner = blocks.corner(block);
        for i in blocks.samples(block) {
            let Some(stencil) = self.stencil(i) else {
                continue;
            };
            let (area, r) = (self.area(i), offset(i));
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
            node.area += T::of(LEAST_AREA);
            node.mean /= node.area;
        }
    }

    /// What the nodes say at the samples.
    fn see(&self, blocks: &Blocks, nodes: &[Node<T>], offsets: &[T], seen: &mut Vec<Seen<T>>) {
        seen.resize(offsets.len(), Seen::default());
        let chunks = seen.par_chunks_mut(parallel::CHUNK).enumerate();
        chunks.for_each(|(chunk, seen)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    for (n, seen) in seen.iter_mut().enumerate() {
                        let i = chunk * parallel::CHUNK + n;
                        *seen = self.see_at(blocks, nodes, i, offsets[i]);
                    }
                },
            );
        });
    }

    #[inline(always)]
    fn see_at(&self, blocks: &Blocks, nodes: &[Node<T>], i: usize, r: T) -> Seen<T> {
        let Some(stencil) = self.stencil(i) else {
            return Seen::default();
        };
        let (area, corners) = (self.area(i), stencil.corners());
        let weights = corners.products();
        let around: [[[Node<T>; 2]; 2]; 2] = blocks.read(nodes, corners.corner);
        // Where the 2³ cells are among the 3³.
        let shift: [usize; 3] = std::array::from_fn(|a| corners.corner[a] - stencil.corner[a]);
        let own = stencil.weights();
        let mut means = [T::zero(); 8];
        let (mut mean, mut without_it) = (T::zero(), T::zero());
        for c in 0..8 {
            let place = [c >> 2, c >> 1 & 1, c & 1];
            let Node { area: d, mean: e } = around[place[0]][place[1]][place[2]];
            let mine = area
                * own[0][place[0] + shift[0]]
                * own[1][place[1] + shift[1]]
                * own[2][place[2] + shift[2]];
            means[c] = e;
            mean += weights[c] * e;
            // D without it is at least ε, but for rounding.
            let others = (d - mine).max(T::of(0.5 * LEAST_AREA));
            without_it += weights[c] * (e * d - mine * r) / others;
        }
        Seen {
            mean,
            gradient: corners.gradient(means),
            without_it,
        }
    }
}
