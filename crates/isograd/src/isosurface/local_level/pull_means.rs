//! The pullback of the means: from the readings at the samples to the cells, and from the cells to the samples.

use super::layer::{Layer, NODES, Overlap};
use super::means::{CellMean, GridSamples, Reading, means_of};
use super::pullback::{PassScratch, SampleBars};
use super::stencil::{Corners, Stencil};
use crate::{Real, parallel, simd, vector};

/// Cotangents at a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CellBars<T> {
    /// `M̄`.
    pub(super) sum: T,
    /// `D̄`.
    pub(super) area: T,
}

/// A sample in a pass.
#[derive(Clone, Copy)]
struct PassSample<T> {
    stencil: Stencil<T>,
    corners: Corners<T>,
    /// `â`.
    area: T,
    /// `s`.
    offset: T,
    normal: [T; 3],
    /// Cotangents of `m`, `w`, `p`.
    bar: Reading<T>,
}

/// Adds `v·∇B` to the cells of the block that begins at `block`.
#[inline(always)]
fn spread_slope<T: Real>(stencil: &Stencil<T>, v: [T; 3], block: [usize; 3], cells: &mut [T]) {
    let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
    Overlap::new(stencil.corner, 3, block).for_each(
        #[inline(always)]
        |[i, j, k], at| {
            let flat = v[0] * dx[i] * y[j] + v[1] * x[i] * dy[j];
            cells[at] += flat * z[k] + v[2] * x[i] * y[j] * dz[k];
        },
    );
}

impl<T: Real> GridSamples<'_, T> {
    #[inline(always)]
    fn pass_sample(&self, i: usize, offset: T, bar: Reading<T>) -> Option<PassSample<T>> {
        let stencil = self.stencil(i)?;
        Some(PassSample {
            stencil,
            corners: stencil.corners(self.interpolation),
            area: self.area(i),
            offset,
            normal: self.samples.normals[i],
            bar,
        })
    }

    /// Writes `M̄` and `D̄` at the cells of the layer, where `total` is `Ē`, for a pass with this gain and these `(N,)` offsets.
    pub(super) fn pull_means(
        &self,
        state: &mut PassScratch<T>,
        gain: T,
        offsets: &[T],
        total: &[T],
    ) {
        let PassScratch {
            layer,
            means,
            mean_bars,
            reading_bars,
            ..
        } = state;
        mean_bars.resize(means.len(), CellBars::default());
        parallel::each(mean_bars.chunks_exact_mut(NODES), |block, bars| {
            let cells = block * NODES..(block + 1) * NODES;
            let (means, total) = (&means[cells.clone()], &total[cells]);
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    // ē
                    let mut mean_bars = [T::zero(); NODES];
                    for (bar, &total) in mean_bars.iter_mut().zip(total) {
                        *bar = gain * total;
                    }
                    bars.fill(CellBars::default());
                    for i in layer.samples(block) {
                        let sample = self.pass_sample(i, offsets[i], reading_bars[i]);
                        if let Some(sample) = sample {
                            let corner = layer.corner(block);
                            sample.spread_reading(corner, &mut mean_bars);
                            sample.spread_prediction(corner, means, bars);
                        }
                    }
                    for ((bars, cell), mean_bar) in bars.iter_mut().zip(means).zip(mean_bars) {
                        let sum = mean_bar / cell.area;
                        bars.sum += sum;
                        bars.area -= sum * cell.mean;
                    }
                },
            );
        });
    }

    /// From the cells to sample `i`, whose offset is `s`. Returns `s̄`, without the part through the sums.
    #[inline(always)]
    pub(super) fn pull_sample(
        &self,
        state: &PassScratch<T>,
        i: usize,
        s: T,
        bars: &mut SampleBars<T>,
    ) -> T {
        let Some(sample) = self.pass_sample(i, s, state.reading_bars[i]) else {
            return T::zero();
        };
        let corner = sample.stencil.corner;
        let cells: [[[CellMean<T>; 3]; 3]; 3] = state.layer.read(&state.means, corner);
        let cell_bars: [[[CellBars<T>; 3]; 3]; 3] = state.layer.read(&state.mean_bars, corner);
        // B̄, starting with s M̄ + D̄.
        let mut weight_bars = [[[T::zero(); 3]; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    weight_bars[i][j][k] = s * cell_bars[i][j][k].sum + cell_bars[i][j][k].area;
                }
            }
        }
        let (mut s_bar, mut place) = sample.pull_corners(&cells, &mut weight_bars);
        let gradient = sample.pull_weights(&cell_bars, &weight_bars, &mut s_bar, &mut bars.area);
        let derivatives = sample.stencil.derivatives(
            #[inline(always)]
            |i, j| means_of(&cells[i][j]),
        );
        let slope_bar = sample.bar.slope;
        place = vector::add(place, vector::scale(gradient, sample.area));
        let bend = derivatives.bend(sample.normal);
        place = vector::add(place, vector::scale(bend, slope_bar));
        bars.place = vector::add(bars.place, place);
        let normal = vector::scale(derivatives.gradient, slope_bar);
        bars.normal = vector::add(bars.normal, normal);
        s_bar
    }

    /// Writes `Σ_i ū_i n_i·∇B_o` at the cells of the layer, for the slopes `u` before the first pass.
    pub(super) fn spread_slopes(&self, layer: &Layer, bars: &[SampleBars<T>], cells: &mut [T]) {
        parallel::each(cells.chunks_exact_mut(NODES), |block, cells| {
            simd::dispatch(
                self.arch,
                #[inline(always)]
                || {
                    cells.fill(T::zero());
                    for i in layer.samples(block) {
                        let Some(stencil) = self.stencil(i) else {
                            continue;
                        };
                        let slope = vector::scale(self.samples.normals[i], bars[i].slope);
                        spread_slope(&stencil, slope, layer.corner(block), cells);
                    }
                },
            );
        });
    }
}

impl<T: Real> PassSample<T> {
    /// Adds to `ē` of a block: `T m̄ + n·∇B w̄`.
    #[inline(always)]
    fn spread_reading(&self, block: [usize; 3], mean_bars: &mut [T; NODES]) {
        let slope = vector::scale(self.normal, self.bar.slope);
        spread_slope(&self.stencil, slope, block, mean_bars);
        self.overlap(block).for_each(
            #[inline(always)]
            |at_corner, at| {
                let (weight, _) = self.corners.weight_and_slope(at_corner);
                mean_bars[at] += weight * self.bar.mean;
            },
        );
    }

    /// Adds to `M̄` and `D̄` of a block, through the prediction: `y` and `−y v`.
    #[inline(always)]
    fn spread_prediction(
        &self,
        block: [usize; 3],
        means: &[CellMean<T>],
        bars: &mut [CellBars<T>],
    ) {
        let [x, y, z] = self.stencil.weights();
        let [px, py, pz] = self.corners.place;
        self.overlap(block).for_each(
            #[inline(always)]
            |[i, j, k], at| {
                let (weight, _) = self.corners.weight_and_slope([i, j, k]);
                let own = self.area * x[px + i] * y[py + j] * z[pz + k];
                let [without, others] = means[at].without(own, self.offset);
                let part = weight * self.bar.prediction / others;
                bars[at].sum += part;
                bars[at].area -= part * without;
            },
        );
    }

    /// The cells of the interpolation in a block.
    #[inline(always)]
    fn overlap(&self, block: [usize; 3]) -> Overlap {
        let lowest = std::array::from_fn(|a| self.stencil.corner[a] + self.corners.place[a]);
        Overlap::new(lowest, self.corners.count, block)
    }

    /// Through the interpolated readings `m` and `p`: returns `s̄` and `x̂̄`, and adds `y (v − s)` to `B̄`.
    #[inline(always)]
    fn pull_corners(
        &self,
        cells: &[[[CellMean<T>; 3]; 3]; 3],
        weight_bars: &mut [[[T; 3]; 3]; 3],
    ) -> (T, [T; 3]) {
        let [x, y, z] = self.stencil.weights();
        let (mut s_bar, mut place) = (T::zero(), [T::zero(); 3]);
        for at in self.corners.cells() {
            let [i, j, k] = self.corners.cell(at);
            let (weight, slope) = self.corners.weight_and_slope(at);
            let own = self.area * x[i] * y[j] * z[k];
            let [without, others] = cells[i][j][k].without(own, self.offset);
            let part = weight * self.bar.prediction / others;
            weight_bars[i][j][k] += part * (without - self.offset);
            s_bar -= part * own;
            let value_bar = self.bar.mean * cells[i][j][k].mean + self.bar.prediction * without;
            place = vector::add(place, vector::scale(slope, value_bar));
        }
        (s_bar, place)
    }

    /// Through the B-spline weights: adds to `s̄` and `â̄`, and returns `Σ_o ∇B_o B̄_o`.
    #[inline(always)]
    fn pull_weights(
        &self,
        cell_bars: &[[[CellBars<T>; 3]; 3]; 3],
        weight_bars: &[[[T; 3]; 3]; 3],
        s_bar: &mut T,
        area_bar: &mut T,
    ) -> [T; 3] {
        let ([x, y, z], [dx, dy, dz]) = (self.stencil.weights(), self.stencil.slopes());
        let (mut sum, mut gradient) = (T::zero(), [T::zero(); 3]);
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    let bar = weight_bars[i][j][k];
                    let weight = x[i] * y[j] * z[k];
                    *s_bar += self.area * weight * cell_bars[i][j][k].sum;
                    sum += weight * bar;
                    gradient[0] += dx[i] * y[j] * z[k] * bar;
                    gradient[1] += x[i] * dy[j] * z[k] * bar;
                    gradient[2] += x[i] * y[j] * dz[k] * bar;
                }
            }
        }
        *area_bar += sum;
        gradient
    }
}
