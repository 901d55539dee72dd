//! Fields between cell centers: trilinear interpolation, and its transpose.

use cubecl::prelude::*;

use crate::element::linear::lerp;
use crate::grid::Lattice;
use crate::spread::Spread;
use crate::vector::Vector3;

/// A field at a point.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Interpolated<F: Float> {
    pub value: F,
    /// Per cell.
    pub gradient: Vector3<F>,
}

/// `field`, `(nx, ny, nz)`, at index coordinates; constant beyond the outermost cell centers.
#[cube]
pub(crate) fn interpolate<F: Float + CubeElement>(
    field: &Array<F>,
    at: Vector3<F>,
    grid: &Lattice<F>,
) -> Interpolated<F> {
    let x = between::<F>(at.x, grid.nx);
    let y = between::<F>(at.y, grid.ny);
    let z = between::<F>(at.z, grid.nz);
    let row = grid.nz as usize;
    let plane = (grid.ny * grid.nz) as usize;
    let first = x.cell as usize * plane + y.cell as usize * row + z.cell as usize;
    let e00 = edge::<F>(field, first, z.fraction);
    let e01 = edge::<F>(field, first + row, z.fraction);
    let e10 = edge::<F>(field, first + plane, z.fraction);
    let e11 = edge::<F>(field, first + plane + row, z.fraction);
    let low = lerp::<F>(e00.value, e01.value, y.fraction);
    let high = lerp::<F>(e10.value, e11.value, y.fraction);
    let low_slope = lerp::<F>(e00.slope, e01.slope, y.fraction);
    let high_slope = lerp::<F>(e10.slope, e11.slope, y.fraction);
    let value = lerp::<F>(low, high, x.fraction);
    let across = lerp::<F>(e01.value - e00.value, e11.value - e10.value, x.fraction);
    Interpolated::<F> {
        value,
        gradient: Vector3::<F> {
            x: (high - low) * x.inside,
            y: across * y.inside,
            z: lerp::<F>(low_slope, high_slope, x.fraction) * z.inside,
        },
    }
}

/// Two neighboring cell centers along an axis, and where a point is between them.
#[derive(CubeType, Clone, Copy)]
struct Between<F: Float> {
    /// The lower one.
    cell: u32,
    /// How far the point is from it, in cells: 0 to 1.
    fraction: F,
    /// 1 between cell centers; 0 beyond the outermost, where the field is constant.
    inside: F,
}

#[cube]
fn between<F: Float>(x: F, cells: u32) -> Between<F> {
    let last = cells - 1u32;
    let mut u = x - F::new(0.5);
    let mut inside = F::new(1.0);
    if u < F::new(0.0) {
        u = F::new(0.0);
        inside = F::new(0.0);
    }
    if u > F::cast_from(last) {
        u = F::cast_from(last);
        inside = F::new(0.0);
    }
    let cell = min(u32::cast_from(u), last - 1u32);
    Between::<F> {
        cell,
        fraction: u - F::cast_from(cell),
        inside,
    }
}

/// Value between a cell and the next along z, and the slope.
#[derive(CubeType, Clone, Copy)]
struct Edge<F: Float> {
    value: F,
    slope: F,
}

#[cube]
fn edge<F: Float>(field: &Array<F>, at: usize, fraction: F) -> Edge<F> {
    let low = field[at];
    let high = field[at + 1];
    Edge::<F> {
        value: lerp::<F>(low, high, fraction),
        slope: high - low,
    }
}

/// Cells between that of a sample and the outermost between whose centers `χ` is interpolated.
pub(crate) const REACH: u32 = 1;

/// Numbers of a sample in the form that is spread: offset from the center of its cell, and what is spread.
pub(crate) const NUMBERS: usize = 4;

/// By the weights of trilinear interpolation. Samples keep 2 cells from the walls, where it would end.
pub(crate) struct Trilinear;

#[cube]
impl Spread for Trilinear {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let at = s * NUMBERS;
        let wx = tent::<F>(samples[at], x);
        let wy = tent::<F>(samples[at + 1], y);
        let wz = tent::<F>(samples[at + 2], z);
        samples[at + 3] * wx * wy * wz
    }
}

/// `max(0, 1 − |Δ|)` in the cell below (0), at (1) or above (2) that of a point `f` from its center.
#[cube]
pub(crate) fn tent<F: Float>(f: F, cell: u32) -> F {
    let zero = F::new(0.0);
    let below = max(-f, zero);
    let above = max(f, zero);
    let at = F::new(1.0) - below - above;
    select(cell == 1u32, at, select(cell == 0u32, below, above))
}
