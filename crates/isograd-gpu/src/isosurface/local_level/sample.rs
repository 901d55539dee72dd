//! A sample among its 3³ cells: small pure functions.

use cubecl::prelude::*;

use crate::element::plate::least_area;
use crate::grid::Lattice;
use crate::splat::{bspline, bspline_slope, pick};
use crate::vector::Vector3;

/// Numbers of a sample in the form that is worked with: offset from the center of its cell, normal, `â`, `ω`.
pub(super) const SAMPLE: usize = 8;

/// Numbers of a sample as it was before a pass: `s`, `u`.
pub(super) const STATE: usize = 2;

/// Results of a pass at a sample: `m`, `w`, `p`.
pub(super) const SEEN: usize = 3;

/// A sample.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Sample<F: Float> {
    /// Offset from the center of its cell, −½ to ½ cells.
    pub f: Vector3<F>,
    pub normal: Vector3<F>,
    /// `â`.
    pub area: F,
    /// `ω`.
    pub trust: F,
}

/// Samples in sorted order, and the fields of a pass.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct PassArrays<F: Float + CubeElement> {
    /// Cells of the samples.
    pub keys: Array<u32>,
    pub samples: Array<F>,
    /// `D − ε` and `M` at every cell.
    pub areas: Array<F>,
    pub sums: Array<F>,
}

#[cube]
pub(super) fn sample<F: Float>(samples: &Array<F>, s: usize) -> Sample<F> {
    let at = s * SAMPLE;
    Sample::<F> {
        f: Vector3::<F>::load(samples, at),
        normal: Vector3::<F>::load(samples, at + 3),
        area: samples[at + 6],
        trust: samples[at + 7],
    }
}

/// Place in memory of the lowest of the 3³ cells around the cell `key`, which is not at a wall.
#[cube]
pub(super) fn corner<F: Float + CubeElement>(key: u32, grid: &Lattice<F>) -> u32 {
    key - ((grid.ny + 1u32) * grid.nz + 1u32)
}

/// Whether a sample with this key is in the grid, and not left out.
#[cube]
pub(super) fn is_held<F: Float + CubeElement>(key: u32, grid: &Lattice<F>) -> bool {
    key < grid.nx * grid.ny * grid.nz
}

/// `e` at a cell.
#[cube]
pub(super) fn mean<F: Float>(sums: &Array<F>, areas: &Array<F>, at: usize) -> F {
    sums[at] / (areas[at] + least_area::<F>())
}

/// Value of a cell without one of its samples.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Without<F: Float> {
    /// `v = (M − â B s)/(D − â B)`.
    pub value: F,
    /// `D − â B`.
    pub others: F,
}

/// A cell without a sample that has the area `own` in it, with `s = offset`.
#[cube]
pub(super) fn without<F: Float>(
    sums: &Array<F>,
    areas: &Array<F>,
    at: usize,
    own: F,
    offset: F,
) -> Without<F> {
    // At least ε, but for rounding.
    let epsilon = least_area::<F>();
    let others = max(areas[at] + epsilon - own, F::new(0.5) * epsilon);
    Without::<F> {
        value: (sums[at] - own * offset) / others,
        others,
    }
}

/// One of the two cell centers around a sample, along an axis.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Side<F: Float> {
    /// Which of the three cells it is.
    pub cell: u32,
    /// Its weight in linear interpolation, and the derivative.
    pub tent: F,
    pub tent_slope: F,
    /// Its weight as a B-spline, and the derivative.
    pub bump: F,
    pub bump_slope: F,
}

/// The lower (0) or upper (1) cell center around a sample `f` from the center of its cell.
#[cube]
pub(super) fn side<F: Float>(f: F, upper: u32) -> Side<F> {
    let one = F::new(1.0);
    let below = f < F::new(0.0);
    let is_upper = upper == 1u32;
    let fraction = select(below, f + one, f);
    let cell = lowest::<F>(f) + upper;
    Side::<F> {
        cell,
        tent: select(is_upper, fraction, one - fraction),
        tent_slope: select(is_upper, one, -one),
        bump: pick::<F>(bspline::<F>(f), cell + 2u32),
        bump_slope: pick::<F>(bspline_slope::<F>(f), cell + 2u32),
    }
}

/// Which of the three cells along an axis is the lower cell center of a sample.
#[cube]
pub(super) fn lowest<F: Float>(f: F) -> u32 {
    select(f < F::new(0.0), 0u32, 1u32)
}

/// First and second derivatives, per cell, of what quadratic B-splines make of values at cells.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Derivatives<F: Float> {
    pub x: F,
    pub y: F,
    pub z: F,
    pub xx: F,
    pub yy: F,
    pub zz: F,
    pub yz: F,
    pub xz: F,
    pub xy: F,
}

#[cube]
impl<F: Float> Derivatives<F> {
    pub fn gradient(self) -> Vector3<F> {
        Vector3::<F>::of(self.x, self.y, self.z)
    }

    /// `∇(n·∇)`: how the slope along `n` changes with the place.
    pub fn bend(self, n: Vector3<F>) -> Vector3<F> {
        Vector3::<F> {
            x: self.xx * n.x + self.xy * n.y + self.xz * n.z,
            y: self.xy * n.x + self.yy * n.y + self.yz * n.z,
            z: self.xz * n.x + self.yz * n.y + self.zz * n.z,
        }
    }
}

/// Derivatives at offset `f`, from the 3³ cells from `corner` on, of a field; or of `e`, if the values are `M`, with
/// `D − ε` beside them.
#[cube]
pub(super) fn derivatives<F: Float + CubeElement>(
    values: &Array<F>,
    areas: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    f: Vector3<F>,
    #[comptime] means: bool,
) -> Derivatives<F> {
    let zero = F::new(0.0);
    let two = F::new(2.0);
    let (x, dx) = (bspline::<F>(f.x), bspline_slope::<F>(f.x));
    let (y, dy) = (bspline::<F>(f.y), bspline_slope::<F>(f.y));
    let (z, dz) = (bspline::<F>(f.z), bspline_slope::<F>(f.z));
    let mut out = Derivatives::<F> {
        x: zero,
        y: zero,
        z: zero,
        xx: zero,
        yy: zero,
        zz: zero,
        yz: zero,
        xz: zero,
        xy: zero,
    };
    for i in 0..3u32 {
        let (wx, sx) = (pick::<F>(x, i + 2u32), pick::<F>(dx, i + 2u32));
        let bx = select(i == 1u32, -two, F::new(1.0));
        for j in 0..3u32 {
            let (wy, sy) = (pick::<F>(y, j + 2u32), pick::<F>(dy, j + 2u32));
            let by = select(j == 1u32, -two, F::new(1.0));
            let row = (corner + (i * grid.ny + j) * grid.nz) as usize;
            let low = value::<F>(values, areas, row, means);
            let middle = value::<F>(values, areas, row + 1, means);
            let high = value::<F>(values, areas, row + 2, means);
            let along = z.below * low + z.center * middle + z.above * high;
            let slope = dz.below * low + dz.center * middle + dz.above * high;
            let bend = low - two * middle + high;
            out.x += sx * wy * along;
            out.y += wx * sy * along;
            out.z += wx * wy * slope;
            out.xx += bx * wy * along;
            out.yy += wx * by * along;
            out.zz += wx * wy * bend;
            out.yz += wx * sy * slope;
            out.xz += sx * wy * slope;
            out.xy += sx * sy * along;
        }
    }
    out
}

#[cube]
fn value<F: Float>(values: &Array<F>, areas: &Array<F>, at: usize, #[comptime] means: bool) -> F {
    if comptime!(means) {
        mean::<F>(values, areas, at)
    } else {
        values[at]
    }
}

/// Results of a pass at a sample.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Seen<F: Float> {
    /// `m`: `e`, trilinear.
    pub mean: F,
    /// `w`: the slope of `e` along the normal, per cell.
    pub slope: F,
    /// `p`: `e`, trilinear, found without the sample.
    pub forecast: F,
}

/// Results at a sample with `s = offset`, from the cells from `corner` on.
#[cube]
pub(super) fn see<F: Float + CubeElement>(
    sums: &Array<F>,
    areas: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    me: Sample<F>,
    offset: F,
) -> Seen<F> {
    let found = derivatives::<F>(sums, areas, corner, grid, me.f, true);
    let mut seen = Seen::<F> {
        mean: F::new(0.0),
        slope: found.gradient().dot(me.normal),
        forecast: F::new(0.0),
    };
    for i in 0..2u32 {
        let x = side::<F>(me.f.x, i);
        for j in 0..2u32 {
            let y = side::<F>(me.f.y, j);
            for k in 0..2u32 {
                let z = side::<F>(me.f.z, k);
                let at = (corner + (x.cell * grid.ny + y.cell) * grid.nz + z.cell) as usize;
                let tent = x.tent * y.tent * z.tent;
                let own = me.area * x.bump * y.bump * z.bump;
                seen.mean += tent * mean::<F>(sums, areas, at);
                seen.forecast += tent * without::<F>(sums, areas, at, own, offset).value;
            }
        }
    }
    seen
}
