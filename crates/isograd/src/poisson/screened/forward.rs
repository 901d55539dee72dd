//! Conjugate gradients over the samples.

use super::{Equation, Error, MOST_ITERATIONS};
use crate::trilinear::{self, Cube};
use crate::{Real, parallel, poisson};

/// Scratch buffers reused between calls: a field, and five numbers per sample.
#[derive(Default)]
pub struct Scratch<T> {
    /// A right-hand side, then its solution.
    pub(super) field: Vec<T>,
    /// `√â_i`.
    roots: Vec<T>,
    /// `u`.
    pub(super) solution: Vec<T>,
    rest: Vec<T>,
    direction: Vec<T>,
    /// The matrix times the direction.
    image: Vec<T>,
    pub(super) poisson: poisson::Scratch<T>,
}

/// Replaces the plain solution `chi` `(nx, ny, nz)` by the screened one, and returns the number of iterations.
///
/// # Errors
/// [`Error::NotConverged`]; `chi` is then unchanged.
pub fn forward<T: Real>(
    equation: &Equation<'_, T>,
    chi: &mut [T],
    scratch: &mut Scratch<T>,
) -> Result<usize, Error> {
    scratch.start(equation);
    if !(scratch.total_area() > 0.0) {
        return Ok(0);
    }
    let Scratch { roots, rest, .. } = &mut *scratch;
    parallel::fill(rest, roots.len(), |i| roots[i] * equation.at_sample(chi, i));
    let iterations = scratch.solve(equation)?;
    scratch.spread_solution(equation)?;
    add(chi, &scratch.field, -equation.screening);
    Ok(iterations)
}

impl<T: Real> Equation<'_, T> {
    /// The value of a field at a sample.
    pub(super) fn at_sample(&self, field: &[T], i: usize) -> T {
        Cube::new(
            self.grid,
            self.grid.to_index(self.samples.samples.points[i]),
        )
        .value(field)
    }
}

impl<T: Real> Scratch<T> {
    pub(super) fn start(&mut self, equation: &Equation<'_, T>) {
        let samples = equation.samples.samples.points.len();
        parallel::fill(&mut self.roots, samples, |i| equation.area_of(i).sqrt());
        self.field.resize(equation.grid.cells(), T::zero());
    }

    /// `√â_i`.
    pub(super) fn root(&self, i: usize) -> T {
        self.roots[i]
    }

    /// `Σ â_i`.
    pub(super) fn total_area(&self) -> f64 {
        dot(&self.roots, &self.roots)
    }

    /// Fills `rest` with numbers of the samples.
    pub(super) fn set_right_hand_side(&mut self, value: impl Fn(usize, T) -> T + Sync) {
        let roots = &self.roots;
        parallel::fill(&mut self.rest, roots.len(), |i| value(i, roots[i]));
    }

    /// Fills the solution with numbers of the samples.
    pub(super) fn set_solution(&mut self, value: impl Fn(usize, T) -> T + Sync) {
        let roots = &self.roots;
        parallel::fill(&mut self.solution, roots.len(), |i| value(i, roots[i]));
    }

    /// `field = A⁺ Sᵀ u` for the solution `u`.
    pub(super) fn spread_solution(&mut self, equation: &Equation<'_, T>) -> Result<(), Error> {
        let Self {
            field,
            roots,
            solution,
            poisson,
            ..
        } = self;
        green(equation, roots, solution, field, poisson)
    }

    /// From the right-hand side in `rest` to the solution.
    pub(super) fn solve(&mut self, equation: &Equation<'_, T>) -> Result<usize, Error> {
        let Self {
            field,
            roots,
            solution,
            rest,
            direction,
            image,
            poisson,
        } = self;
        let alpha = T::of(equation.screening);
        project(rest, roots);
        solution.clear();
        solution.resize(rest.len(), T::zero());
        direction.clone_from(rest);
        let start = dot(rest, rest);
        // Square of the residual at which iterations end.
        let goal = start * T::epsilon().f64().powf(1.4);
        let mut now = start;
        for iteration in 0..MOST_ITERATIONS {
            if !(now > goal) {
                return Ok(iteration);
            }
            green(equation, roots, direction, field, poisson)?;
            parallel::fill(image, roots.len(), |i| {
                direction[i] + alpha * roots[i] * equation.at_sample(field, i)
            });
            project(image, roots);
            let step = now / dot(direction, image);
            add(solution, direction, step);
            add(rest, image, -step);
            let before = std::mem::replace(&mut now, dot(rest, rest));
            let share = T::of(now / before);
            parallel::for_each(direction, |i, p| *p = rest[i] + share * *p);
        }
        Err(Error::NotConverged {
            iterations: MOST_ITERATIONS,
            residual: (now / start).sqrt(),
        })
    }
}

/// `field = A⁺ Sᵀ u`.
fn green<T: Real>(
    equation: &Equation<'_, T>,
    roots: &[T],
    u: &[T],
    field: &mut [T],
    scratch: &mut poisson::Scratch<T>,
) -> Result<(), Error> {
    let Equation {
        plan,
        grid,
        samples,
        ..
    } = *equation;
    parallel::for_each(field, |_, value| *value = T::zero());
    trilinear::spread(grid, samples, |i| roots[i] * u[i], field);
    Ok(plan.solve(field, 0.0, scratch)?)
}

fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    let [sum] = parallel::sum_array(a.len(), |i| [a[i].f64() * b[i].f64()]);
    sum
}

/// `a += s b`.
fn add<T: Real>(a: &mut [T], b: &[T], s: f64) {
    let s = T::of(s);
    parallel::for_each(a, |i, a| *a += s * b[i]);
}

/// Subtracts the projection on `d = √â`.
fn project<T: Real>(v: &mut [T], roots: &[T]) {
    add(v, roots, -dot(v, roots) / dot(roots, roots));
}
