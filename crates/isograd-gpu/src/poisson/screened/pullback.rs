//! The adjoint solve, and the derivative of the matrix.

use cubecl::prelude::*;

use super::gradients::System;
use super::{Equation, Error};
use crate::device::check_length;
use crate::grid::{self, Lattice, check_field, place};
use crate::isosurface::iso_value;
use crate::primitives::fill::add;
use crate::primitives::reduce::{BLOCK, sum_columns};
use crate::splat::{SampleCotangent, subtract_from_grid};
use crate::spread::Before;
use crate::{Buffer, Device, Scalar};

/// Turns the cotangents `chi_bar`, `(nx, ny, nz)`, of the screened solution into those of the plain one, adds what
/// they mean for points, areas and grid to `out`, and returns the iterations it took. `level` is what the
/// iso-value kept of `χ`; all else is as it was in [`forward`](super::forward). Waits for the device.
///
/// # Errors
/// As [`forward`](super::forward); `chi_bar` is then as it was.
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
    let grid_sums: Buffer<T> = device.empty(4 * samples.len().div_ceil(BLOCK))?;
    pull_matrix::launch::<T, R>(
        device.client(),
        device.groups(samples.len(), BLOCK as u32),
        CubeDim::new_1d(BLOCK as u32),
        samples.points.arg(),
        samples.areas.arg(),
        level.at_samples.arg(),
        level.sums.arg(),
        adjoint.at_samples.arg(),
        adjoint.sums.arg(),
        out.points.arg(),
        out.areas.arg(),
        grid_sums.arg(),
        T::of(-equation.screening),
        equation.per_area(),
        grid::arg(grid),
        equation.area_weights,
    );
    add(device, &sum_columns(device, &grid_sums, 4)?, &out.grid)?;
    Ok(iterations)
}

/// What the derivative of the matrix has for each point and area, and summed a group at a time for the grid.
#[cube(launch)]
fn pull_matrix<F: Float + CubeElement>(
    points: &Array<F>,
    areas: &Array<F>,
    chi: &Array<F>,
    chi_sums: &Array<F>,
    adjoint: &Array<F>,
    adjoint_sums: &Array<F>,
    points_bar: &mut Array<F>,
    areas_bar: &mut Array<F>,
    grid_sums: &mut Array<F>,
    factor: F,
    per_area: F,
    grid: Lattice<F>,
    #[comptime] area_weights: bool,
) {
    let i = ABSOLUTE_POS;
    let mut of_grid = Array::<F>::new(4usize);
    for k in 0..4usize {
        of_grid[k] = F::new(0.0);
    }
    if i < areas.len() {
        let offset = chi[4 * i] - chi_sums[0] / chi_sums[1];
        let value = adjoint[4 * i] - adjoint_sums[0] / adjoint_sums[1];
        let area = areas[i] * per_area;
        let x = place::<F>(points, i, &grid);
        for axis in 0..3usize {
            let both = value * chi[4 * i + 1 + axis] + offset * adjoint[4 * i + 1 + axis];
            of_grid[axis] = factor * area / grid.spacing * both;
            points_bar[3 * i + axis] += of_grid[axis];
        }
        let area_bar = factor * value * offset;
        areas_bar[i] += area_bar * per_area;
        of_grid[3] = x.x * of_grid[0] + x.y * of_grid[1] + x.z * of_grid[2];
        if area_weights {
            of_grid[3] += F::new(2.0) * area * area_bar / grid.spacing;
        }
    }
    subtract_from_grid::<F>(of_grid[0], of_grid[1], of_grid[2], of_grid[3], grid_sums);
}
