//! Conjugate gradients over the samples.

use cubecl::prelude::*;
use isograd::poisson::screened::{self, MOST_ITERATIONS};

use super::{Equation, Error};
use crate::device::{Ready, check_length, launch};
use crate::grid::{Lattice, cell_at, from_center, place};
use crate::isosurface::iso_value;
use crate::primitives::fill::zeros;
use crate::primitives::reduce::{BLOCK, sum, write_sum};
use crate::spread::{Before, spread};
use crate::trilinear::{NUMBERS, REACH, Trilinear, interpolate};
use crate::{Buffer, Device, Scalar};

/// Samples of the system in kernels.
#[derive(CubeLaunch, CubeType)]
struct SystemArrays<F: Float + CubeElement> {
    points: Array<F>,
    places: Array<u32>,
    roots: Array<F>,
}

/// The system on a device: numbers of the samples, sorted by cell.
pub(super) struct System<'a, R: Runtime, T: Scalar> {
    device: &'a Device<R>,
    equation: &'a Equation<'a, T>,
    /// `√â`.
    roots: Buffer<T>,
    /// `Σ â`, one number.
    total: Buffer<T>,
    /// Where each sample is in its cell, and what it spreads.
    carriers: Buffer<T>,
}

impl<'a, R: Runtime, T: Scalar> System<'a, R, T> {
    /// The system; none where no sample has an area. Waits for the device.
    pub fn new(
        device: &'a Device<R>,
        equation: &'a Equation<'a, T>,
    ) -> Result<Option<Self>, Error> {
        let order = &equation.splat.order;
        let count = order.keys.len();
        let (roots, carriers) = (device.empty(count)?, device.empty(NUMBERS * count)?);
        launch!(device, count, BLOCK => start<T>(
            equation.samples.points, equation.samples.areas, order.keys, order.places, roots,
            carriers, equation.per_area(), equation.splat.grid,
        ));
        let total: Buffer<T> = dot(device, &roots, &roots)?;
        let area = device.download(&total)?[0];
        Ok((area > T::of(0.0)).then_some(Self {
            device,
            equation,
            roots,
            total,
            carriers,
        }))
    }

    /// `base + factor √â field(x)` for each sample; 0 stands for no base.
    pub fn at_samples(
        &self,
        field: &Buffer<T>,
        factor: f64,
        base: Option<&Buffer<T>>,
    ) -> Result<Buffer<T>, Error> {
        let (device, splat) = (self.device, self.equation.splat);
        let out = device.empty(self.roots.len())?;
        let samples = Ready::new(SystemArraysLaunch::new(
            self.equation.samples.points.arg(),
            splat.order.places.arg(),
            self.roots.arg(),
        ));
        launch!(device, out.len(), BLOCK => find_at_samples<T>(
            field,
            samples,
            base.unwrap_or(&self.roots), out, T::of(factor), splat.grid, base.is_some(),
        ));
        Ok(out)
    }

    /// `u`: `√â (χ(x) − c)` of each sample.
    pub fn offsets(&self, level: &iso_value::Residual<T>) -> Result<Buffer<T>, Error> {
        let (device, places) = (self.device, &self.equation.splat.order.places);
        check_length("the residual", &level.at_samples, 4 * places.len())?;
        let out = device.empty(places.len())?;
        launch!(device, out.len(), BLOCK => find_offsets<T>(
            level.at_samples, level.sums, places, self.roots, out,
        ));
        Ok(out)
    }

    /// Writes `Sᵀ u` to `field`, or adds it.
    pub fn spread(&self, u: &Buffer<T>, before: Before, field: &Buffer<T>) -> Result<(), Error> {
        let device = self.device;
        launch!(device, u.len(), BLOCK => carry<T>(self.roots, u, self.carriers));
        let order = &self.equation.splat.order;
        spread::<R, T, Trilinear>(device, &self.carriers, order, REACH, before, field)?;
        Ok(())
    }

    /// `A⁺ Sᵀ u`.
    pub fn green(&self, u: &Buffer<T>) -> Result<Buffer<T>, Error> {
        let (device, solver) = (self.device, self.equation.solver);
        let field = device.empty(self.equation.splat.grid.cells())?;
        self.spread(u, Before::Replaced, &field)?;
        Ok(solver.solve(device, &field, 0.0)?)
    }

    /// From the right-hand side, which is lost, to the solution, and the iterations it took.
    pub fn solve(&self, rest: &Buffer<T>) -> Result<(Buffer<T>, usize), Error> {
        let (device, alpha) = (self.device, self.equation.screening);
        self.project(rest)?;
        let solution = zeros(device, rest.len())?;
        let direction = zeros(device, rest.len())?;
        let mut now = dot(device, rest, rest)?;
        let start = device.download(&now)?[0].f64();
        self.turn(rest, None, &direction);
        // The square of what the residual may be.
        let goal = start * T::epsilon().f64().powf(1.4);
        let mut left = start;
        for iteration in 0..MOST_ITERATIONS {
            if !(left > goal) {
                return Ok((solution, iteration));
            }
            let field = self.green(&direction)?;
            let image = self.at_samples(&field, alpha, Some(&direction))?;
            drop(field);
            self.project(&image)?;
            let curvature = dot(device, &direction, &image)?;
            launch!(device, rest.len(), BLOCK => take_step<T>(
                now, curvature, direction, image, solution, rest,
            ));
            let before = std::mem::replace(&mut now, dot(device, rest, rest)?);
            self.turn(rest, Some([&now, &before]), &direction);
            left = device.download(&now)?[0].f64();
        }
        Err(Error::Screened(screened::Error::NotConverged {
            iterations: MOST_ITERATIONS,
            residual: (left / start).sqrt(),
        }))
    }

    /// Takes off the part along `d = √â`.
    fn project(&self, v: &Buffer<T>) -> Result<(), Error> {
        let device = self.device;
        let along = dot(device, v, &self.roots)?;
        launch!(device, v.len(), BLOCK => subtract_along<T>(
            self.roots, along, self.total, v,
        ));
        Ok(())
    }

    /// The next direction: what is left, and of the last direction the quotient of the two numbers, or nothing.
    fn turn(&self, rest: &Buffer<T>, share: Option<[&Buffer<T>; 2]>, direction: &Buffer<T>) {
        let [up, down] = share.unwrap_or([&self.total; 2]);
        launch!(self.device, rest.len(), BLOCK => turn_direction<T>(
            rest, up, down, direction, share.is_some(),
        ));
    }
}

/// `Σ a b`, one number.
fn dot<R: Runtime, T: Scalar>(
    device: &Device<R>,
    a: &Buffer<T>,
    b: &Buffer<T>,
) -> Result<Buffer<T>, crate::Error> {
    let sums = device.empty(a.len().div_ceil(BLOCK))?;
    launch!(device, a.len(), BLOCK => sum_products<T>(a, b, sums));
    sum(device, &sums)
}

#[cube(launch)]
fn sum_products<F: Float>(a: &Array<F>, b: &Array<F>, sums: &mut Array<F>) {
    let mut product = F::new(0.0);
    if ABSOLUTE_POS < a.len() {
        product = a[ABSOLUTE_POS] * b[ABSOLUTE_POS];
    }
    write_sum::<F>(product, sums);
}

/// `√â` of each sample, and where it is in its cell.
#[cube(launch)]
fn start<F: Float + CubeElement>(
    points: &Array<F>,
    areas: &Array<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    roots: &mut Array<F>,
    carriers: &mut Array<F>,
    per_area: F,
    grid: Lattice<F>,
) {
    let s = ABSOLUTE_POS;
    if s < roots.len() {
        let i = places[s] as usize;
        let x = place::<F>(points, i, &grid);
        let cell = cell_at(keys[s], grid.ny, grid.nz);
        roots[s] = (areas[i] * per_area).sqrt();
        from_center::<F>(x, cell).store(carriers, NUMBERS * s);
        carriers[NUMBERS * s + 3] = F::new(0.0);
    }
}

/// Sets the number that each sample spreads to `√â u`.
#[cube(launch)]
fn carry<F: Float>(roots: &Array<F>, u: &Array<F>, carriers: &mut Array<F>) {
    let s = ABSOLUTE_POS;
    if s < u.len() {
        carriers[NUMBERS * s + 3] = roots[s] * u[s];
    }
}

#[cube(launch)]
fn find_at_samples<F: Float + CubeElement>(
    field: &Array<F>,
    system: &SystemArrays<F>,
    base: &Array<F>,
    out: &mut Array<F>,
    factor: F,
    grid: Lattice<F>,
    #[comptime] with_base: bool,
) {
    let s = ABSOLUTE_POS;
    if s < out.len() {
        let x = place::<F>(&system.points, system.places[s] as usize, &grid);
        let mut value = factor * system.roots[s] * interpolate::<F>(field, x, &grid).value;
        if with_base {
            value += base[s];
        }
        out[s] = value;
    }
}

#[cube(launch)]
fn find_offsets<F: Float>(
    at_samples: &Array<F>,
    sums: &Array<F>,
    places: &Array<u32>,
    roots: &Array<F>,
    out: &mut Array<F>,
) {
    let s = ABSOLUTE_POS;
    if s < out.len() {
        let chi = at_samples[4 * places[s] as usize];
        out[s] = roots[s] * (chi - sums[0] / sums[1]);
    }
}

#[cube(launch)]
fn subtract_along<F: Float>(
    roots: &Array<F>,
    along: &Array<F>,
    total: &Array<F>,
    v: &mut Array<F>,
) {
    if ABSOLUTE_POS < v.len() {
        v[ABSOLUTE_POS] -= along[0] / total[0] * roots[ABSOLUTE_POS];
    }
}

/// Goes along the direction as far as the quotient of two numbers.
#[cube(launch)]
fn take_step<F: Float>(
    up: &Array<F>,
    down: &Array<F>,
    direction: &Array<F>,
    image: &Array<F>,
    solution: &mut Array<F>,
    rest: &mut Array<F>,
) {
    if ABSOLUTE_POS < rest.len() {
        let step = up[0] / down[0];
        solution[ABSOLUTE_POS] += step * direction[ABSOLUTE_POS];
        rest[ABSOLUTE_POS] -= step * image[ABSOLUTE_POS];
    }
}

#[cube(launch)]
fn turn_direction<F: Float>(
    rest: &Array<F>,
    up: &Array<F>,
    down: &Array<F>,
    direction: &mut Array<F>,
    #[comptime] with_last: bool,
) {
    if ABSOLUTE_POS < rest.len() {
        let mut next = rest[ABSOLUTE_POS];
        if with_last {
            next += up[0] / down[0] * direction[ABSOLUTE_POS];
        }
        direction[ABSOLUTE_POS] = next;
    }
}
