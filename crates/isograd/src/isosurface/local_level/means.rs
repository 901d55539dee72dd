//! Means of the offsets at the cells, and their values and slopes back at the samples.

use pulp::Arch;

use super::gain::Sums;
use super::layer::{Layer, NODES, Overlap};
use super::stencil::Stencil;
use crate::element::plate::least_area;
use crate::isosurface::Interpolation;
use crate::parallel::{self, CHUNK};
use crate::splat::Samples;
use crate::{Grid, Real, simd, vector};

/// Weighted mean of the offsets at a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CellMean<T> {
    /// `D_o`.
    pub(super) area: T,
    /// `e_o`.
    pub(super) mean: T,
}

/// The means of a pass at a sample; in the pullback, the cotangents of these three.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reading<T> {
    /// `m`: `e`, trilinear.
    pub(super) mean: T,
    /// `w`: the slope of `e` along the normal, per cell.
    pub(super) slope: T,
    /// `p`: `e`, trilinear, computed without the sample.
    pub(super) prediction: T,
}

/// The samples on the grid of the indicator.
#[derive(Clone, Copy)]
pub(super) struct GridSamples<'a, T> {
    pub(super) grid: &'a Grid<T>,
    pub(super) samples: Samples<'a, T>,
    /// Whether areas count in cells², or each sample as 1.
    pub(super) in_cells: bool,
    pub(super) interpolation: Interpolation,
    pub(super) arch: Arch,
}

impl<'a, T: Real> GridSamples<'a, T> {
    pub(super) fn new(
        grid: &'a Grid<T>,
        samples: Samples<'a, T>,
        in_cells: bool,
        interpolation: Interpolation,
    ) -> Self {
        Self {
            grid,
            samples,
            in_cells,
            interpolation,
            arch: Arch::new(),
        }
    }

    /// `â_i`.
    #[inline(always)]
    pub(super) fn area(&self, i: usize) -> T {
        self.samples.area_in_cells(self.grid, self.in_cells, i)
    }

    #[inline(always)]
    pub(super) fn stencil(&self, i: usize) -> Option<Stencil<T>> {
        Stencil::of(self.grid, self.samples.points[i])
    }

    /// Writes `D` and `e` at the cells of the layer for the `(N,)` offsets `s`.
    pub(super) fn average(&self, layer: &Layer, offsets: &[T], means: &mut Vec<CellMean<T>>) {
        means.resize(layer.len() * NODES, CellMean::default());
        parallel::each(means.chunks_exact_mut(NODES), |block, means| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || self.average_block(layer, block, offsets, means),
            );
        });
    }

    #[inline(always)]
    fn average_block(&self, layer: &Layer, block: usize, offsets: &[T], means: &mut [CellMean<T>]) {
        means.fill(CellMean::default());
        let corner = layer.corner(block);
        for i in layer.samples(block) {
            let Some(stencil) = self.stencil(i) else {
                continue;
            };
            let (area, s) = (self.area(i), offsets[i]);
            let [x, y, z] = stencil.weights();
            Overlap::new(stencil.corner, 3, corner).for_each(
                #[inline(always)]
                |[i, j, k], at| {
                    let weight = area * x[i] * y[j] * z[k];
                    means[at].area += weight;
                    means[at].mean += weight * s;
                },
            );
        }
        for cell in means {
            cell.area += least_area::<T>();
            cell.mean /= cell.area;
        }
    }

    /// Adds `λ e` to `sum`, cell by cell of the layer.
    pub(super) fn accumulate(&self, means: &[CellMean<T>], gain: T, sum: &mut [T]) {
        let chunks = sum.chunks_mut(CHUNK).zip(means.chunks(CHUNK));
        parallel::each(chunks, |_, (sum, means)| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    for (sum, cell) in sum.iter_mut().zip(means) {
                        *sum += gain * cell.mean;
                    }
                },
            );
        });
    }

    /// Runs `f(i, item)` for the item of every sample, compiled for the processor's instruction set.
    #[inline(always)]
    pub(super) fn for_each<E: Send>(&self, items: &mut [E], f: impl Fn(usize, &mut E) + Sync) {
        parallel::each(items.chunks_mut(CHUNK), |chunk, items| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    for (n, item) in items.iter_mut().enumerate() {
                        f(chunk * CHUNK + n, item);
                    }
                },
            );
        });
    }

    /// Writes the readings of the means at the samples.
    pub(super) fn read(
        &self,
        layer: &Layer,
        means: &[CellMean<T>],
        offsets: &[T],
        readings: &mut Vec<Reading<T>>,
    ) {
        readings.resize(offsets.len(), Reading::default());
        self.for_each(
            readings,
            #[inline(always)]
            |i, reading| *reading = self.read_at(layer, means, i, offsets[i]),
        );
    }

    #[inline(always)]
    fn read_at(&self, layer: &Layer, means: &[CellMean<T>], i: usize, s: T) -> Reading<T> {
        let Some(stencil) = self.stencil(i) else {
            return Reading::default();
        };
        let cells: [[[CellMean<T>; 3]; 3]; 3] = layer.read(means, stencil.corner);
        let (area, corners, [x, y, z]) = (
            self.area(i),
            stencil.corners(self.interpolation),
            stencil.weights(),
        );
        let (mut mean, mut prediction) = (T::zero(), T::zero());
        for at in corners.cells() {
            let [i, j, k] = corners.cell(at);
            let (weight, _) = corners.weight_and_slope(at);
            let cell = cells[i][j][k];
            mean += weight * cell.mean;
            prediction += weight * cell.without(area * x[i] * y[j] * z[k], s)[0];
        }
        let derivatives = stencil.derivatives(
            #[inline(always)]
            |i, j| means_of(&cells[i][j]),
        );
        Reading {
            mean,
            slope: vector::dot(derivatives.gradient, self.samples.normals[i]),
            prediction,
        }
    }

    /// The samples on another grid.
    pub(super) fn on<'b>(&'b self, grid: &'b Grid<T>) -> GridSamples<'b, T> {
        GridSamples { grid, ..*self }
    }

    /// The sums that determine the gain of a pass, from its `(N,)` offsets and the slopes `u`.
    pub(super) fn sums(
        &self,
        readings: &[Reading<T>],
        offsets: &[T],
        slope: impl Fn(usize) -> T + Sync,
    ) -> Sums {
        Sums::new(parallel::sum_array(readings.len(), |i| {
            let (a, s, u) = (self.area(i).f64(), offsets[i].f64(), slope(i).f64());
            let (w, p) = (readings[i].slope.f64(), readings[i].prediction.f64());
            [a * w * u, a * u * u, a * s * p, a * s * s, a * p * p]
        }))
    }
}

/// `e` along a row of cells.
#[inline(always)]
pub(super) fn means_of<T: Real>([a, b, c]: &[CellMean<T>; 3]) -> [T; 3] {
    [a.mean, b.mean, c.mean]
}

impl<T: Real> CellMean<T> {
    /// `e` and `D` without a sample of this weight and offset.
    #[inline(always)]
    pub(super) fn without(self, weight: T, offset: T) -> [T; 2] {
        // At least ε, but for rounding.
        let others = (self.area - weight).max(T::of(0.5) * least_area::<T>());
        [(self.mean * self.area - weight * offset) / others, others]
    }
}
