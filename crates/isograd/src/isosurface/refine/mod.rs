//! Refinement: the surface of the quadratic B-spline of the indicator, on cells half as large.
//!
//! # Map
//! `χ(y) = Σ_o B_o(y) χ_o`, with `B` the product of quadratic B-splines and `χ` continued across the walls by its even
//! reflection. At the center of a cell half as large the weights of the nearest three cells along an axis are 9/32, 22/32 and
//! 1/32. Values are in blocks that contain every crossing of the iso-value. A vertex lies on an edge of the lattice of these
//! centers, at `t` where the spline itself has the iso-value, `χ(p + t e) = c`; but its odds `t/(1 − t)` are at most 16 times
//! those of linear interpolation between the ends, and at least a 16th of them. So it comes to the end of its edge that changes
//! sides, though the spline may have the iso-value there more than once.
//!
//! Marching cubes on these cells follows parts half as thin. And how the surface lies on the lattice hardly shows: samples
//! and vertices read the same smooth function. If vertices are placed by linear interpolation, a plate as thick as 1.4 cells
//! of the indicator becomes thicker and thinner by 0.044 cells as it moves through one; with the spline, by 0.0002.
//!
//! # Pullback
//! With `ȳ` the cotangent of a vertex, and `χ' = e·∇χ` at it: `χ̄_o −= (ȳ·e) B_o/χ'`, `c̄ += (ȳ·e)/χ'`: [`pullback`]. If its odds
//! are bounded, the derivative is that of linear interpolation between the ends, one of them times the bound. As for
//! [linear interpolation](super), a slope below a millionth of the range of `χ` counts as that much.
//!
//! # Not differentiable
//! Which blocks have values is held constant; those without have no crossing.

mod edge;
mod pullback;

use std::sync::Arc;

use crate::data::blocks::{BlockField, EDGE, Marks, NODES};
use crate::{Field, Grid, GridError, LatticeEdge, Real, parallel};
pub(crate) use pullback::pullback;

/// Cells of the indicator along each side of a block.
const OWN: usize = EDGE / 2;

/// [`OWN`] and one more at both ends.
const WIDE: usize = OWN + 2;

/// Values at the cells of the indicator under a block and around it.
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
    parallel::each(refined.values.chunks_exact_mut(NODES), |block, out| {
        let mut halo = [T::zero(); WIDE * WIDE * WIDE];
        for_each_cell(chi.grid(), blocks.corner(block), |place, cell| {
            halo[place] = chi.values()[cell];
        });
        interpolate(&halo, out);
    });
    Ok(refined)
}

/// Where a vertex lies on its edge, from 0 to 1. `fine` is the [refined grid](grid) of `chi`.
pub(crate) fn on_edge<T: Real>(chi: &Field<T>, fine: &Grid<T>, level: T, edge: LatticeEdge) -> T {
    let edge = edge::Edge::new(chi.grid(), fine, edge);
    let crossing = edge.crossing(&edge.line(chi), level.f64());
    T::of(crossing.fraction())
}

/// Blocks of the refined grid that may be crossed: cells of the indicator under them and around them are on both sides.
fn crossed<T: Real>(chi: &Field<T>, level: T) -> Vec<[usize; 3]> {
    let [nx, ny, nz] = chi.grid().shape();
    let [bx, by, bz] = [nx, ny, nz].map(|n| n.div_ceil(OWN));
    // Bit 0: a cell is outside; bit 1: a cell is inside.
    let mut sides = vec![0u8; bx * by * bz];
    let slabs = sides.chunks_mut(by * bz);
    let slabs = slabs.zip(chi.values().chunks(OWN * ny * nz));
    parallel::each(slabs, |_, (sides, values)| {
        for (row, values) in values.chunks_exact(nz).enumerate() {
            let first = row % ny / OWN * bz;
            for (k, &value) in values.iter().enumerate() {
                sides[first + k / OWN] |= 1 << u8::from(value < level);
            }
        }
    });
    let near = |b: usize, n: usize| b.saturating_sub(1)..(b + 2).min(n);
    let crossed = |n: usize| {
        let [x, y, z] = [n / (by * bz), n / bz % by, n % bz];
        let mut both = 0;
        for i in near(x, bx) {
            for j in near(y, by) {
                for k in near(z, bz) {
                    both |= sides[(i * by + j) * bz + k];
                }
            }
        }
        (both == 3).then_some([x, y, z])
    };
    parallel::flat_map(sides.len(), crossed)
}

/// The cells of the indicator of a block's halo, by place there and place in memory, reflected at the walls.
fn for_each_cell<T: Real>(grid: &Grid<T>, corner: [usize; 3], mut f: impl FnMut(usize, usize)) {
    let cell = |axis: usize, n: usize| cell_near(grid.shape()[axis], corner[axis], n);
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

/// The `n`th cell of the indicator along an axis with `cells`, from the one before that of cell `half` of the refined grid on,
/// reflected at the walls.
#[inline(always)]
fn cell_near(cells: usize, half: usize, n: usize) -> usize {
    (half / 2 + n).saturating_sub(1).min(cells - 1)
}

/// From the three cells around that under half `half` of a block to the value there.
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

#[cfg(test)]
mod tests;
