//! Refinement: the indicator between its cells, on cells half as large near the surface.
//!
//! # Map
//! At the center `y` of a cell half as large, `χ(y) = Σ_o B_o(y) χ_o`, with `B` the product of quadratic B-splines and `χ`
//! continued across the walls by its even reflection: along an axis, the weights of the nearest three cells are 9/32,
//! 22/32 and 1/32. Values are in blocks that contain every crossing of the iso-value.
//!
//! Marching cubes on these cells follows parts half as thin. And where it cuts the surface from one lattice into
//! triangles hardly shows: as samples move through cells, the surface moves with them, and derivatives vary less within
//! a cell.
//!
//! # Pullback
//! The transpose: `χ̄_o += Σ_y B_o(y) χ̄(y)`.
//!
//! # Not differentiable
//! Which blocks have values is held constant; those without have no crossing.

use std::sync::Arc;

use rayon::prelude::*;

use crate::data::blocks::{BlockField, EDGE, Marks, NODES};
use crate::{Field, Grid, GridError, Real};

/// Cells of the indicator along each side of a block.
const OWN: usize = EDGE / 2;

/// [`OWN`] and one more at both ends.
const WIDE: usize = OWN + 2;

/// Blocks whose cotangents are held at once.
const TASK: usize = 1024;

/// Values at the cells of the indicator under a block and round it.
type Halo<T> = [T; WIDE * WIDE * WIDE];

/// Weights of the cells below, at and above that of a lower half; an upper half has them in reverse.
const WEIGHTS: [f64; 3] = [9.0 / 32.0, 22.0 / 32.0, 1.0 / 32.0];

/// The grid with cells half as large in the same box.
pub(crate) fn grid<T: Real>(grid: &Grid<T>) -> Result<Grid<T>, GridError> {
    let shape = grid.shape().map(|n| 2 * n);
    Grid::new(grid.lower(), grid.spacing() * T::of(0.5), shape)
}

/// The refined indicator near its surface `χ = level`, in the memory of a `previous` one. The same bits for any number of
/// threads.
///
/// # Errors
/// [`GridError`] for a grid with more cells than can be indexed.
pub(crate) fn forward<T: Real>(
    chi: &Field<T>,
    level: T,
    previous: Option<BlockField<T>>,
) -> Result<BlockField<T>, GridError> {
    let fine = grid(chi.grid())?;
    let mut marks = Marks::new(fine.shape());
    marks.add_blocks(&crossed(chi, level));
    let blocks = Arc::new(marks.build());
    let mut values = previous.map(|field| field.values).unwrap_or_default();
    values.resize(blocks.nodes(), T::zero());
    let mut refined = BlockField {
        grid: fine,
        blocks: blocks.clone(),
        values,
    };
    let work = refined.values.par_chunks_exact_mut(NODES).enumerate();
    work.for_each(|(block, out)| {
        let mut halo = [T::zero(); WIDE * WIDE * WIDE];
        for_each_cell(chi.grid(), blocks.corner(block), |place, cell| {
            halo[place] = chi.values()[cell];
        });
        interpolate(&halo, out);
    });
    Ok(refined)
}

/// Adds to `chi_bar` `(nx, ny, nz)` on `grid` the cotangents of the indicator from those of the refined one.
pub(crate) fn pullback<T: Real>(refined_bar: &BlockField<T>, grid: &Grid<T>, chi_bar: &mut [T]) {
    let mut parts: Vec<Halo<T>> = Vec::with_capacity(TASK);
    let mut corners = (0..refined_bar.blocks.len()).map(|block| refined_bar.blocks.corner(block));
    for values in refined_bar.values.chunks(TASK * NODES) {
        let values = values.par_chunks_exact(NODES);
        values
            .map(interpolate_transposed)
            .collect_into_vec(&mut parts);
        for (part, corner) in parts.iter().zip(&mut corners) {
            for_each_cell(grid, corner, |place, cell| chi_bar[cell] += part[place]);
        }
    }
}

/// Blocks of the refined grid that may be crossed: cells of the indicator under them and round them are on both sides.
fn crossed<T: Real>(chi: &Field<T>, level: T) -> Vec<[usize; 3]> {
    let [nx, ny, nz] = chi.grid().shape();
    let [bx, by, bz] = [nx, ny, nz].map(|n| n.div_ceil(OWN));
    // Bit 0: a cell is outside; bit 1: a cell is inside.
    let mut sides = vec![0u8; bx * by * bz];
    let slabs = sides.par_chunks_mut(by * bz);
    slabs
        .zip(chi.values().par_chunks(OWN * ny * nz))
        .for_each(|(sides, values)| {
            for (row, values) in values.chunks_exact(nz).enumerate() {
                let first = row % ny / OWN * bz;
                for (k, &value) in values.iter().enumerate() {
                    sides[first + k / OWN] |= 1 << u8::from(value < level);
                }
            }
        });
    let near = |b: usize, n: usize| b.saturating_sub(1)..(b + 2).min(n);
    let is_crossed = |&[x, y, z]: &[usize; 3]| {
        let mut both = 0;
        for i in near(x, bx) {
            for j in near(y, by) {
                for k in near(z, bz) {
                    both |= sides[(i * by + j) * bz + k];
                }
            }
        }
        both == 3
    };
    let places = (0..sides.len()).into_par_iter();
    let places = places.map(|n| [n / (by * bz), n / bz % by, n % bz]);
    places.filter(is_crossed).collect()
}

/// The cells of the indicator of a block's halo, by place there and place in memory, reflected at the walls.
fn for_each_cell<T: Real>(grid: &Grid<T>, corner: [usize; 3], mut f: impl FnMut(usize, usize)) {
    let shape = grid.shape();
    let cell = |axis: usize, n: usize| {
        let cell = (corner[axis] / 2 + n).saturating_sub(1);
        cell.min(shape[axis] - 1)
    };
    let mut place = 0;
    for i in 0..WIDE {
        for j in 0..WIDE {
            for k in 0..WIDE {
                f(place, grid.index([cell(0, i), cell(1, j), cell(2, k)]));
                place += 1;
            }
        }
    }
}

/// From the three cells round that under half `half` of a block to the value there.
fn weight<T: Real>(half: usize, tap: usize) -> T {
    T::of(WEIGHTS[if half.is_multiple_of(2) { tap } else { 2 - tap }])
}

fn interpolate<T: Real>(halo: &Halo<T>, out: &mut [T]) {
    // Along z, then y, then x.
    let mut rows = [T::zero(); WIDE * WIDE * EDGE];
    for (row, halo) in rows.chunks_exact_mut(EDGE).zip(halo.chunks_exact(WIDE)) {
        for (k, value) in row.iter_mut().enumerate() {
            *value = (0..3).fold(T::zero(), |sum, t| {
                sum + weight::<T>(k, t) * halo[k / 2 + t]
            });
        }
    }
    let mut planes = [T::zero(); WIDE * EDGE * EDGE];
    for (n, value) in planes.iter_mut().enumerate() {
        let (i, j, k) = (n / EDGE / EDGE, n / EDGE % EDGE, n % EDGE);
        let at = |t: usize| rows[(i * WIDE + j / 2 + t) * EDGE + k];
        *value = (0..3).fold(T::zero(), |sum, t| sum + weight::<T>(j, t) * at(t));
    }
    for (n, value) in out.iter_mut().enumerate() {
        let (i, rest) = (n / EDGE / EDGE, n % (EDGE * EDGE));
        let at = |t: usize| planes[(i / 2 + t) * EDGE * EDGE + rest];
        *value = (0..3).fold(T::zero(), |sum, t| sum + weight::<T>(i, t) * at(t));
    }
}

fn interpolate_transposed<T: Real>(bars: &[T]) -> Halo<T> {
    let mut planes = [T::zero(); WIDE * EDGE * EDGE];
    for (n, &bar) in bars.iter().enumerate() {
        let (i, rest) = (n / EDGE / EDGE, n % (EDGE * EDGE));
        for t in 0..3 {
            planes[(i / 2 + t) * EDGE * EDGE + rest] += weight::<T>(i, t) * bar;
        }
    }
    let mut rows = [T::zero(); WIDE * WIDE * EDGE];
    for (n, &bar) in planes.iter().enumerate() {
        let (i, j, k) = (n / EDGE / EDGE, n / EDGE % EDGE, n % EDGE);
        for t in 0..3 {
            rows[(i * WIDE + j / 2 + t) * EDGE + k] += weight::<T>(j, t) * bar;
        }
    }
    let mut halo = [T::zero(); WIDE * WIDE * WIDE];
    for (halo, row) in halo.chunks_exact_mut(WIDE).zip(rows.chunks_exact(EDGE)) {
        for (k, &bar) in row.iter().enumerate() {
            for t in 0..3 {
                halo[k / 2 + t] += weight::<T>(k, t) * bar;
            }
        }
    }
    halo
}

#[cfg(test)]
#[path = "refine_tests.rs"]
mod tests;
