//! The adjoint solve, and the derivative of the matrix.

use super::{Equation, Error, Scratch};
use crate::isosurface::iso_value;
use crate::poisson::smoothing;
use crate::splat::SampleCotangent;
use crate::trilinear::{self, Cube};
use crate::{Real, parallel, vector};

/// Replaces the cotangent `chi_bar` `(nx, ny, nz)` of the screened solution by that of the plain one, adds those of
/// points, areas and grid to `out`, and returns the number of iterations. `level` is the residual of the iso-value
/// of `χ`; `equation` is that of [`forward`](super::forward).
///
/// # Errors
/// [`Error::NotConverged`]; `chi_bar` is then unchanged.
pub fn pullback<T: Real>(
    equation: &Equation<'_, T>,
    level: &iso_value::Residual<T>,
    chi_bar: &mut [T],
    scratch: &mut Scratch<T>,
    out: &mut SampleCotangent<T>,
) -> Result<usize, Error> {
    let Equation {
        plan,
        grid,
        samples,
        ..
    } = *equation;
    scratch.start(equation);
    if !(scratch.total_area() > 0.0) {
        return Ok(0);
    }
    let alpha = T::of(equation.screening);
    let green = |chi_bar: &[T], scratch: &mut Scratch<T>| {
        scratch.field.copy_from_slice(chi_bar);
        plan.solve(&mut scratch.field, 0.0, &mut scratch.poisson)
    };
    green(chi_bar, scratch)?;
    let field = std::mem::take(&mut scratch.field);
    scratch.set_right_hand_side(|i, root| -alpha * root * equation.at_sample(&field, i));
    scratch.field = field;
    let iterations = scratch.solve(equation)?;
    let added = |i: usize| scratch.root(i) * scratch.solution[i];
    trilinear::spread(grid, samples, added, chi_bar);
    green(chi_bar, scratch)?;
    equation.pull_matrix(&scratch.field, level, out);
    Ok(iterations)
}

/// The part of the cotangent of the smoothing `σ` of the plain solution that [`smoothing::pullback`] of the screened one,
/// `χ`, leaves out. `plain_bar` `(nx, ny, nz)` is the cotangent of the plain solution, as [`pullback`] leaves it; `level` is
/// the residual of the iso-value of `χ`.
///
/// # Errors
/// [`Error::Poisson`].
pub fn smoothing_pullback<T: Real>(
    equation: &Equation<'_, T>,
    level: &iso_value::Residual<T>,
    smoothing: f64,
    plain_bar: &[T],
    scratch: &mut Scratch<T>,
) -> Result<f64, Error> {
    scratch.start(equation);
    let c = T::of(level.value);
    scratch.set_solution(|i, root| root * (level.at_samples[i].value - c));
    scratch.spread_solution(equation)?;
    let of_unit = smoothing::pullback(equation.plan, smoothing, &scratch.field, plain_bar);
    Ok(equation.screening * of_unit)
}

impl<T: Real> Equation<'_, T> {
    /// The derivative of the matrix; `adjoint` is `Λ` up to a constant.
    fn pull_matrix(
        &self,
        adjoint: &[T],
        level: &iso_value::Residual<T>,
        out: &mut SampleCotangent<T>,
    ) {
        let (grid, points) = (self.grid, self.samples.samples.points);
        let at = |i: usize| Cube::new(grid, grid.to_index(points[i])).value_and_gradient(adjoint);
        let [sum, total] = parallel::sum_array(points.len(), |i| {
            let a = self.area_of(i).f64();
            [a * at(i).0.f64(), a]
        });
        let (mean, c) = (T::of(sum / total), T::of(level.value));
        let (h, alpha) = (grid.spacing(), T::of(self.screening));
        // Cotangents of a point and of `â`.
        let of_sample = |i: usize| {
            let (value, gradient) = at(i);
            let (value, chi) = (value - mean, level.at_samples[i]);
            let offset = chi.value - c;
            let both = vector::add(
                vector::scale(chi.gradient, value),
                vector::scale(gradient, offset),
            );
            let point = vector::scale(both, -alpha * self.area_of(i) / h);
            (point, -alpha * value * offset)
        };
        out.add(grid, self.samples.samples, self.area, of_sample);
    }
}
