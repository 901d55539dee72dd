//! The quadratic B-spline of an indicator: `χ(x) = Σ_o B_o(x) χ_o`, with the `B` that the splat spreads samples by. Unlike
//! linear interpolation it has a continuous derivative, so that a surface changes little as samples move through cells.

use super::iso_value::AtSample;
use super::local_level::Stencil;
use crate::data::cells::Cells;
use crate::splat::SortedSamples;
use crate::{Grid, Real, parallel};

/// Planes across x that one task of [`spread`] owns.
const SLAB: usize = 8;

/// The spline at a sample and its gradient, per cell.
pub(super) fn at_sample<T: Real>(chi: Cells<'_, T>, point: [T; 3]) -> AtSample<T> {
    let mut at = AtSample::default();
    let Some(stencil) = Stencil::of(chi.grid(), point) else {
        return at;
    };
    let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
    let [low, middle, high] = stencil.corner;
    for i in 0..3 {
        for j in 0..3 {
            let row = chi.row::<3>([low + i, middle + j, high]);
            for (k, value) in row.into_iter().enumerate() {
                at.value += x[i] * y[j] * z[k] * value;
                at.gradient[0] += dx[i] * y[j] * z[k] * value;
                at.gradient[1] += x[i] * dy[j] * z[k] * value;
                at.gradient[2] += x[i] * y[j] * dz[k] * value;
            }
        }
    }
    at
}

/// Adds `value(i)` at every sample to the 3³ cells around it, in memory order: the transpose of [`at_sample`]. Each task
/// owns some planes.
pub(super) fn spread<T: Real>(
    grid: &Grid<T>,
    sorted: SortedSamples<'_, T>,
    value: impl Fn(usize) -> T + Sync,
    out: &mut [T],
) {
    let (strides, points) = (grid.strides(), sorted.samples.points);
    let plane = strides[0];
    parallel::each(out.chunks_mut(SLAB * plane), |task, slab| {
        let planes = task * SLAB..task * SLAB + slab.len() / plane;
        let near = planes.start.saturating_sub(1)..planes.end + 1;
        for &i in sorted.order.in_planes(points, grid, near) {
            let i = i as usize;
            let Some(stencil) = Stencil::of(grid, points[i]) else {
                continue;
            };
            let (corner, [x, y, z], part) = (stencil.corner, stencil.weights(), value(i));
            for a in 0..3 {
                if !planes.contains(&(corner[0] + a)) {
                    continue;
                }
                for b in 0..3 {
                    let row = (corner[0] + a - planes.start) * plane + (corner[1] + b) * strides[1];
                    for c in 0..3 {
                        slab[row + corner[2] + c] += part * (x[a] * y[b] * z[c]);
                    }
                }
            }
        }
    });
}
