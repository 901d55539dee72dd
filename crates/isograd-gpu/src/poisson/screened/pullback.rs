//! The adjoint solve, and the derivative of the matrix.

use cubecl::prelude::*;

use super::gradients::System;
use super::{Equation, Error};
use crate::device::{Ready, argument, check_length, launch};
use crate::grid::{Lattice, check_field, place};
use crate::isosurface::iso_value;
use crate::poisson::smoothing;
use crate::primitives::fill::add;
use crate::primitives::reduce::{BLOCK, sum_columns};
use crate::splat::{CotangentArrays, SampleArrays, SampleCotangent, subtract_from_grid};
use crate::spread::Before;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Replaces the cotangents `chi_bar`, `(nx, ny, nz)`, of the screened solution by those of the plain one, adds the
/// cotangents of points, areas and grid to `out`, and returns the number of iterations. `level` is the residual of the
/// iso-value; all other arguments are those of [`forward`](super::forward). Waits for the device.
///
/// # Errors
/// Like [`forward`](super::forward); `chi_bar` is then unchanged.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    equation: &Equation<'_, T>,
    level: &iso_value::Residual<T>,
    chi_bar: &Buffer<T>,
    out: &SampleCotangent<T>,
) -> Result<usize, Error> {
    let (grid, samples) = (&equation.splat.grid, equation.samples);
    check_field("the cotangent of the solution", chi_bar, grid)?;
    check_length("the residual", &level.at_samples, 4 * samples.len())?;
    out.check(samples.len())?;
    let Some(system) = System::new(device, equation)? else {
        return Ok(0);
    };
    let smooth = equation.solver.solve(device, chi_bar, 0.0)?;
    let rest = system.at_samples(&smooth, -equation.screening, None)?;
    drop(smooth);
    let (solution, iterations) = system.solve(&rest)?;
    system.spread(&solution, Before::Kept, chi_bar)?;
    let adjoint = equation.solver.solve(device, chi_bar, 0.0)?;
    // Its mean at the samples and what it is there, as that of `χ`.
    let (_, adjoint) = iso_value::forward(device, &adjoint, grid, samples.points, samples.areas)?;
    let factors = Ready::new(FactorsLaunch::new(
        T::of(-equation.screening),
        equation.per_area(),
    ));
    let grid_sums: Buffer<T> = device.empty(4 * samples.len().div_ceil(BLOCK))?;
    launch!(device, samples.len(), BLOCK => pull_matrix<T>(
        samples, level, adjoint, out, grid_sums, factors, grid, equation.area_weights,
    ));
    add(device, &sum_columns(device, &grid_sums, 4)?, &out.grid)?;
    Ok(iterations)
}

/// The part of the cotangent of the smoothing `σ` of the plain solution, one number, that [`smoothing::pullback`] of the
/// screened one, `χ`, leaves out. `plain_bar`, `(nx, ny, nz)`, are the cotangents of the plain solution, as [`pullback`]
/// leaves them; `level` is the residual of the iso-value of `χ`. Waits for the device.
///
/// # Errors
/// [`Error::Device`]: an array of another length, or a failure of the device.
pub fn smoothing_pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    equation: &Equation<'_, T>,
    level: &iso_value::Residual<T>,
    smoothing: f64,
    plain_bar: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let grid = &equation.splat.grid;
    check_field("the cotangent of the plain solution", plain_bar, grid)?;
    let Some(system) = System::new(device, equation)? else {
        return Ok(device.upload(&[T::of(0.0)])?);
    };
    let change = system.green(&system.offsets(level)?)?;
    let factor = equation.screening * smoothing;
    Ok(smoothing::pullback(
        device,
        factor,
        grid.shape(),
        &change,
        plain_bar,
    )?)
}

/// Value and gradient of a field at the samples, and the sums of its area-weighted mean.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct Interpolant<F: Float + CubeElement> {
    pub at_samples: Array<F>,
    pub sums: Array<F>,
}

argument!(
    iso_value::Residual<T> => InterpolantLaunch<T, R>: |of| of.at_samples.arg(), of.sums.arg()
);

/// Factors of the screening term.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
struct Factors<F: Float + CubeElement> {
    screening: F,
    per_area: F,
}

/// Adds the cotangents of points and areas through the derivative of the matrix, and sums that of the grid a group at a
/// time.
#[cube(launch)]
fn pull_matrix<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    chi: &Interpolant<F>,
    adjoint: &Interpolant<F>,
    out: &mut CotangentArrays<F>,
    grid_sums: &mut Array<F>,
    factors: Factors<F>,
    grid: Lattice<F>,
    #[comptime] area_weights: bool,
) {
    let i = ABSOLUTE_POS;
    let mut bar = Vector3::<F>::zero();
    let mut of_spacing = F::new(0.0);
    if i < samples.count as usize {
        let offset = chi.at_samples[4 * i] - chi.sums[0] / chi.sums[1];
        let value = adjoint.at_samples[4 * i] - adjoint.sums[0] / adjoint.sums[1];
        let area = samples.areas[i] * factors.per_area;
        let x = place::<F>(&samples.points, i, &grid);
        let of_chi = Vector3::<F>::load(&chi.at_samples, 4 * i + 1).scale(value);
        let of_adjoint = Vector3::<F>::load(&adjoint.at_samples, 4 * i + 1).scale(offset);
        bar = of_chi
            .add(of_adjoint)
            .scale(factors.screening * area / grid.spacing);
        bar.add_to(&mut out.points, 3 * i);
        let area_bar = factors.screening * value * offset;
        out.areas[i] += area_bar * factors.per_area;
        of_spacing = x.dot(bar);
        if area_weights {
            of_spacing += F::new(2.0) * area * area_bar / grid.spacing;
        }
    }
    subtract_from_grid::<F>(bar, of_spacing, grid_sums);
}
