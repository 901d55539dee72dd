//! The pullbacks of gradient and unit normal.

use pulp::Arch;

use super::columns::{Column, Strided, add_across, add_along, component};
use super::rows::{self, Order, Rows};
use super::sample_pullback::PointBars;
use super::{Error, Scratch};
use crate::data::{Field, Grid};
use crate::gather::Buckets;
use crate::{Real, parallel, vector};

/// Scratch buffers of the pullbacks reused between calls: up to nine values per cell.
#[derive(Debug, Default)]
pub struct PullbackScratch<T> {
    /// The smoothed field, and one more.
    pub(super) smoothing: Scratch<T>,
    /// Cotangents of values differenced along x: once, twice, and not at all.
    pub(super) once: Vec<T>,
    pub(super) twice: Vec<T>,
    pub(super) rest: Vec<T>,
    /// Cotangents of the gradient and of the curvature.
    pub(super) gradient: Vec<[T; 3]>,
    pub(super) curvature: Vec<T>,
    /// Of points: cotangents of gradient and curvature, and which points are between which planes.
    pub(super) at_points: Vec<PointBars>,
    pub(super) between: Buckets,
}

/// Adds the cotangent of `φ` for that of its [`gradient`](super::gradient): `bar` is `(cells, 3)`, in length
/// over the unit of `φ` for a loss without a unit; `phi_bar` is `(cells,)`, in memory order. The map is linear,
/// so the result does not depend on `φ`: this is its exact transpose, walls included. The cell size is held
/// constant.
///
/// # Errors
/// [`Error::Mismatch`]; nothing is then written.
pub fn gradient_pullback<T: Real>(
    phi: &Field<T>,
    bar: &[[T; 3]],
    phi_bar: &mut [T],
) -> Result<(), Error> {
    check_cells(phi, "the cotangent of the gradient", bar.len())?;
    check_cells(phi, "the cotangent of the field", phi_bar.len())?;
    add_gradient(phi.grid(), bar, phi_bar);
    Ok(())
}

/// Adds the cotangent of `φ` for that of its [`unit_normals`](super::unit_normals), `(cells, 3)`, in memory
/// order. Returns how many cells are guarded: where the gradient is 0, or so small that its reciprocal is not
/// finite, a cotangent that is not 0 is left out.
///
/// # Errors
/// [`Error::Mismatch`]; nothing is then written.
pub fn unit_normals_pullback<T: Real>(
    phi: &Field<T>,
    bar: &[[T; 3]],
    scratch: &mut PullbackScratch<T>,
    phi_bar: &mut [T],
) -> Result<usize, Error> {
    check_cells(phi, "the cotangent of the normals", bar.len())?;
    check_cells(phi, "the cotangent of the field", phi_bar.len())?;
    let rows = Rows::of(phi);
    let [_, ny, nz] = rows.shape;
    let gradient_bar = &mut scratch.gradient;
    gradient_bar.resize(bar.len(), [T::zero(); 3]);
    let planes = gradient_bar.chunks_exact_mut(ny * nz);
    let planes = planes.zip(bar.chunks_exact(ny * nz));
    let guarded = parallel::map_each(planes, |i, (out, bar)| {
        let mut g = rows::buffers::<T, 3>(nz);
        let mut guarded = 0;
        for j in 0..ny {
            rows.gradient([i, j], &mut g);
            for k in 0..nz {
                let at = j * nz + k;
                let own = unit_pullback([g[0][k], g[1][k], g[2][k]], bar[at]);
                guarded += usize::from(own.is_none());
                out[at] = own.unwrap_or([T::zero(); 3]);
            }
        }
        guarded
    });
    let guarded: usize = guarded.into_iter().sum();
    Ok(guarded + add_gradient(phi.grid(), gradient_bar, phi_bar))
}

/// `(n̄ − n (n·n̄))/|g|`; none where that does not exist and `n̄` is not 0.
#[inline(always)]
pub(super) fn unit_pullback<T: Real>(g: [T; 3], bar: [T; 3]) -> Option<[T; 3]> {
    if bar == [T::zero(); 3] {
        return Some(bar);
    }
    let n = vector::normalized(g)?;
    let across = vector::sub(bar, vector::scale(n, vector::dot(n, bar)));
    let length = vector::norm(g);
    let out = across.map(|x| x / length);
    vector::is_finite(out).then_some(out)
}

/// Adds `Σ_a D_aᵀ ḡ_a`. Returns how many numbers were out of range, and left out.
pub(super) fn add_gradient<T: Real>(grid: &Grid<T>, bar: &[[T; 3]], phi_bar: &mut [T]) -> usize {
    let [_, ny, nz] = grid.shape();
    let guarded = parallel::map_each(phi_bar.chunks_exact_mut(ny * nz), |i, plane| {
        let (mut sum, mut guarded) = (vec![T::zero(); nz], 0);
        crate::simd::vectorized!(Arch::new(), {
            for (j, out) in plane.chunks_exact_mut(nz).enumerate() {
                sum.fill(T::zero());
                add_row(grid, bar, [i, j], &mut sum);
                guarded += add_finite(&sum, grid.spacing().recip(), out);
            }
        });
        guarded
    });
    guarded.into_iter().sum()
}

/// `h Σ_a D_aᵀ ḡ_a` on one row.
#[inline(always)]
fn add_row<T: Real>(grid: &Grid<T>, bar: &[[T; 3]], [i, j]: [usize; 2], sum: &mut [T]) {
    let ([nx, ny, nz], one) = (grid.shape(), T::one());
    let along_x = Strided {
        values: bar,
        start: j * nz,
        stride: ny * nz,
    };
    let along_y = Strided {
        values: bar,
        start: i * ny * nz,
        stride: nz,
    };
    let own = &bar[(i * ny + j) * nz..][..nz];
    let column = Column::new(Order::First, nx, i);
    add_across(&column, one, along_x, component::<0, T>, sum);
    let column = Column::new(Order::First, ny, j);
    add_across(&column, one, along_y, component::<1, T>, sum);
    add_along(Order::First, one, own, component::<2, T>, sum);
}

/// Adds `factor` times the numbers that are finite; returns how many are not.
#[inline(always)]
pub(super) fn add_finite<T: Real>(numbers: &[T], factor: T, out: &mut [T]) -> usize {
    let n = out.len();
    let numbers = &numbers[..n];
    let mut guarded = 0;
    for k in 0..n {
        let x = factor * numbers[k];
        let finite = x.is_finite();
        out[k] += if finite { x } else { T::zero() };
        guarded += usize::from(!finite);
    }
    guarded
}

/// Checks that an array has one entry per cell.
pub(super) fn check_cells<T: Real>(
    phi: &Field<T>,
    what: &'static str,
    length: usize,
) -> Result<(), Error> {
    check(what, length, phi.values().len())
}

pub(super) fn check(what: &'static str, length: usize, expected: usize) -> Result<(), Error> {
    if length == expected {
        return Ok(());
    }
    Err(Error::Mismatch {
        what,
        length,
        expected,
    })
}
