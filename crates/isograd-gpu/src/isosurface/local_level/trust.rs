//! The samples as the passes take them: how steep `χ` is there, and how far they are followed.

use cubecl::prelude::*;
use isograd::isosurface::local_level::{Options, STEEPEST, Step};

use super::near::Near;
use super::plate::{self, Usual, plate_of, shift};
use super::sample::{SAMPLE, STATE, corner, derivatives, is_held, sample};
use crate::device::launch;
use crate::element::plate::trust;
use crate::grid::{Lattice, cell_at, from_center, place};
use crate::isosurface::iso_value;
use crate::primitives::reduce::{BLOCK, sum_columns, write_two_sums};
use crate::splat::Samples;
use crate::vector::Vector3;
use crate::{Buffer, Error, Scalar};

impl<R: Runtime, T: Scalar> Near<'_, R, T> {
    /// Fills the samples, but for `ω`.
    pub(super) fn pack(&self, samples: Samples<'_, T>, area_weights: bool) {
        launch!(self.device, self.count(), BLOCK => pack_samples<T>(
            samples.points, samples.normals, samples.areas, self.order.keys, self.order.places,
            self.samples, self.grid, area_weights,
        ));
    }

    /// `(N, 2)`: anything, and `u`; the step of `χ`, and `Σ â`.
    pub(super) fn slopes(
        &self,
        chi: &Buffer<T>,
        options: Options,
    ) -> Result<(Buffer<T>, Step, f64), Error> {
        let state: Buffer<T> = self.device.empty(STATE * self.count())?;
        let partial: Buffer<T> = self.device.empty(2 * self.shares())?;
        launch!(self.device, self.count(), BLOCK => find_slopes<T>(
            chi, self.order.keys, self.samples, state, partial, self.count() as u32, self.grid,
        ));
        let found = sum_columns(self.device, &partial, 2)?;
        let found = self.device.download(&found)?;
        let (squares, area) = (isograd::Real::f64(found[0]), isograd::Real::f64(found[1]));
        Ok((state, Step::new(squares, area, options), area))
    }

    /// `(N,)` `χ(x_i) + δ_i − c`; and `ω`, among the samples.
    pub(super) fn trust(
        &self,
        state: &Buffer<T>,
        step: &Step,
        mean: &iso_value::Residual<T>,
    ) -> Result<Buffer<T>, Error> {
        let now: Buffer<T> = self.device.empty(self.count())?;
        launch!(self.device, self.count(), BLOCK => trust_samples<T>(
            state, self.order.places, mean.at_samples, mean.sums, self.samples, now,
            plate::arg(step, STEEPEST), step.thin,
        ));
        Ok(now)
    }
}

/// Samples in the form that is worked with. Those that are left out have no area.
#[cube(launch)]
fn pack_samples<F: Float + CubeElement>(
    points: &Array<F>,
    normals: &Array<F>,
    areas: &Array<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    samples: &mut Array<F>,
    grid: Lattice<F>,
    #[comptime] area_weights: bool,
) {
    let s = ABSOLUTE_POS;
    if s < keys.len() {
        let i = places[s] as usize;
        let mut f = Vector3::<F>::zero();
        let mut normal = Vector3::<F>::zero();
        let mut area = F::new(0.0);
        if is_held::<F>(keys[s], &grid) {
            let x = place::<F>(points, i, &grid);
            f = from_center::<F>(x, cell_at(keys[s], grid.ny, grid.nz));
            normal = Vector3::<F>::at(normals, i);
            area = areas[i];
            if comptime!(area_weights) {
                area = areas[i] / grid.spacing / grid.spacing;
            }
        }
        let at = s * SAMPLE;
        f.store(samples, at);
        normal.store(samples, at + 3);
        samples[at + 6] = area;
        samples[at + 7] = F::new(0.0);
    }
}

/// `u` of each sample, and `â u²` of those where `χ` rises and `â`, summed a group at a time.
#[cube(launch)]
fn find_slopes<F: Float + CubeElement>(
    chi: &Array<F>,
    keys: &Array<u32>,
    samples: &Array<F>,
    state: &mut Array<F>,
    partial: &mut Array<F>,
    count: u32,
    grid: Lattice<F>,
) {
    let s = ABSOLUTE_POS;
    let zero = F::new(0.0);
    let mut square = zero;
    let mut area = zero;
    if s < count as usize {
        let me = sample::<F>(samples, s);
        let mut slope = zero;
        if is_held::<F>(keys[s], &grid) {
            let corner = corner::<F>(keys[s], &grid);
            let found = derivatives::<F>(chi, chi, corner, &grid, me.f, false);
            slope = found.gradient().dot(me.normal);
        }
        let rising = max(slope, zero);
        area = me.area;
        square = area * rising * rising;
        state[s * STATE] = zero;
        state[s * STATE + 1] = slope;
    }
    write_two_sums::<F>(square, area, partial);
}

/// `ω` of each sample, and `χ(x_i) + δ_i − c`.
#[cube(launch)]
fn trust_samples<F: Float + CubeElement>(
    state: &Array<F>,
    places: &Array<u32>,
    at_samples: &Array<F>,
    mean_sums: &Array<F>,
    samples: &mut Array<F>,
    now: &mut Array<F>,
    usual: Usual<F>,
    #[comptime] thin: bool,
) {
    let s = ABSOLUTE_POS;
    if s < now.len() {
        let of = plate_of::<F>(state[s * STATE + 1], &usual);
        samples[s * SAMPLE + 7] = trust::<F>(of.followed);
        let c = mean_sums[0] / max(mean_sums[1], F::new(0.0));
        let mut offset = at_samples[4 * places[s] as usize] - c;
        if comptime!(thin) {
            offset += shift::<F>(of, &usual);
        }
        now[s] = offset;
    }
}
