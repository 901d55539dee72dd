//! Cotangents of the right-hand side to cotangents of points, normals, areas and grid: one gather a sample.

use pulp::Arch;

use super::stencil::{self, Gathered, REACH, WIDTH};
use super::{Residual, Samples, central_cell};
use crate::data::GridCotangent;
use crate::data::cells::Cells;
use crate::parallel::{self, CHUNK};
use crate::{Field, Grid, Real, simd, vector};

/// Samples in one task.
const TASK: usize = 512;

/// Cotangents of the inputs of the splat, samples in input order. Every stage that reads the samples adds to these.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleCotangent<T> {
    /// `(N, 3)` of the points.
    pub points: Vec<[T; 3]>,
    /// `(N, 3)` of the outward unit normals.
    pub normals: Vec<[T; 3]>,
    /// `(N,)` of the areas.
    pub areas: Vec<T>,
    /// Of the grid.
    pub grid: GridCotangent<f64>,
}

impl<T: Real> SampleCotangent<T> {
    /// Adds `bar(i)` of each sample: the cotangents of its point, and of its [area in
    /// cells](Samples::area_in_cells). Adds those of the grid that follow; sums are in one fixed order.
    pub(crate) fn add(
        &mut self,
        grid: &Grid<T>,
        samples: Samples<'_, T>,
        in_cells: bool,
        bar: impl Fn(usize) -> ([T; 3], T) + Sync,
    ) {
        let (h, points) = (grid.spacing(), samples.points);
        let unit = if in_cells { h } else { T::one() };
        let chunks = self.points.chunks_mut(CHUNK);
        let chunks = chunks.zip(self.areas.chunks_mut(CHUNK));
        parallel::each(chunks, |chunk, (points, areas)| {
            for (i, (point_bar, area_bar)) in points.iter_mut().zip(areas).enumerate() {
                let (point, area) = bar(chunk * CHUNK + i);
                *point_bar = vector::add(*point_bar, point);
                *area_bar += area / unit / unit;
            }
        });
        let [x, y, z, spacing] = parallel::sum_array(points.len(), |i| {
            let (point, area) = bar(i);
            let mut part = GridCotangent::default();
            part.subtract_point(grid, points[i], point);
            if in_cells {
                let share = samples.area_in_cells(grid, in_cells, i) * area / h;
                part.spacing -= 2.0 * share.f64();
            }
            let [x, y, z] = part.lower;
            [x, y, z, part.spacing]
        });
        self.grid.lower = vector::add(self.grid.lower, [x, y, z]);
        self.grid.spacing += spacing;
    }
}

/// Buffers of the pullback.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    /// In the order of the grid.
    sorted: Vec<Gathered<T>>,
}

/// Pulls the cotangent `b_bar` of the right-hand side back, and adds to `out` the cotangents of the samples and the
/// grid. `samples` and `residual` are those of [`forward`](super::forward); `b_bar` is on its grid.
pub fn pullback<T: Real>(
    samples: Samples<'_, T>,
    residual: &Residual,
    b_bar: &Field<T>,
    scratch: &mut PullbackScratch<T>,
    out: &mut SampleCotangent<T>,
) {
    pullback_on(samples, residual, b_bar.into(), scratch, out);
}

/// Like [`pullback`], for a field that is dense or in blocks.
pub(crate) fn pullback_on<T: Real>(
    samples: Samples<'_, T>,
    residual: &Residual,
    b_bar: Cells<'_, T>,
    scratch: &mut PullbackScratch<T>,
    out: &mut SampleCotangent<T>,
) {
    let (grid, arch) = (b_bar.grid(), Arch::new());
    scratch
        .sorted
        .resize(residual.order.len(), Gathered::default());
    let tasks = scratch.sorted.chunks_mut(TASK);
    parallel::each(
        tasks.zip(residual.order.chunks(TASK)),
        |_, (gathered, order)| {
            simd::vectorized!(arch, {
                for (gathered, &i) in gathered.iter_mut().zip(order) {
                    *gathered = samples.gather(i as usize, residual, b_bar);
                }
            });
        },
    );
    let h = grid.spacing();
    let Samples {
        points,
        normals,
        areas,
    } = samples;
    for (gathered, &i) in scratch.sorted.iter().zip(&residual.order) {
        let i = i as usize;
        let spread = gathered.spread.map(|s| s / h / h);
        let point = vector::scale(gathered.gradient, T::one() / h);
        out.normals[i] = vector::add(out.normals[i], vector::scale(spread, areas[i]));
        out.areas[i] += vector::dot(spread, normals[i]);
        out.points[i] = vector::add(out.points[i], point);
        out.grid.subtract_point(grid, points[i], point);
        // The areas are divided by h².
        out.grid.spacing -= 2.0 * (areas[i] * vector::dot(spread, normals[i]) / h).f64();
    }
}

impl<T: Real> Samples<'_, T> {
    /// `â_i`: the area of a sample in cells² with `in_cells`, else the weight itself.
    #[inline(always)]
    pub(crate) fn area_in_cells(&self, grid: &Grid<T>, in_cells: bool, i: usize) -> T {
        let h = grid.spacing();
        match in_cells {
            true => self.areas[i] / h / h,
            false => self.areas[i],
        }
    }

    /// Cotangents of sample `i` from the 5³ cells of `b_bar` around it.
    #[inline(always)]
    fn gather(&self, i: usize, residual: &Residual, b_bar: Cells<'_, T>) -> Gathered<T> {
        let grid = b_bar.grid();
        let x = grid.to_index(self.points[i]);
        let Some(cell) = central_cell(grid.shape(), x) else {
            return Gathered::default();
        };
        let h = grid.spacing();
        let vector = vector::scale(self.normals[i], self.areas[i] / h / h);
        let f = std::array::from_fn(
            #[inline(always)]
            |a| x[a] - T::of_usize(cell[a]) - T::of(0.5),
        );
        let corner = cell.map(|c| c - REACH);
        let mut block = [[[T::zero(); WIDTH]; WIDTH]; WIDTH];
        for (p, rows) in block.iter_mut().enumerate() {
            for (j, out) in rows.iter_mut().enumerate() {
                *out = b_bar.row([corner[0] + p, corner[1] + j, corner[2]]);
            }
        }
        stencil::gather(residual.weights, vector, f, &block)
    }
}
