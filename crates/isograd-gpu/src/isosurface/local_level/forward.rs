//! From the indicator to the one whose level is the mean at every sample that is followed.

use cubecl::prelude::*;
use isograd::isosurface::local_level::coarse::is_needed;
use isograd::isosurface::local_level::{Options, PASSES, Sums};

use super::cells::take_means;
use super::near::Near;
use super::sample::{PassArrays, SAMPLE, SEEN, STATE, corner, is_held, sample, see};
use super::{Pass, Residual};
use crate::device::{check_length, launch};
use crate::grid::{Lattice, check_field};
use crate::isosurface::iso_value;
use crate::primitives::reduce::{BLOCK, sum_columns, sum_of_group};
use crate::splat::{self, Samples};
use crate::{Buffer, Device, Error, Scalar};

/// Sums of a pass.
const SUMS: usize = 5;

/// `chi`, `(nx, ny, nz)`, with the local part of the iso-value taken off, so that the surface is where it equals the
/// global one: a new array, or `chi` itself where the samples are not followed. `mean` is what [`iso_value::forward`]
/// kept of `chi`; `splat` is what the splat of the same samples left, on the grid of `chi`. Waits for the device once,
/// and once a pass.
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::TooLarge`], [`Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    chi: &Buffer<T>,
    samples: Samples<'_, T>,
    options: Options,
    mean: &iso_value::Residual<T>,
    splat: &splat::Residual<T>,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    let (grid, order) = (&splat.grid, &splat.order);
    samples.check()?;
    check_length("the array of areas", samples.areas, order.keys.len())?;
    check_field("the indicator", chi, grid)?;
    check_length("the mean", &mean.at_samples, 4 * samples.len())?;
    let packed: Buffer<T> = device.empty(SAMPLE * samples.len())?;
    let near = Near {
        device,
        grid,
        order,
        samples: &packed,
    };
    near.pack(samples, options.area);
    let (mut state, step, area) = near.slopes(chi, options)?;
    let now = near.trust(&state, &step, mean)?;
    let (areas, sums) = (near.areas()?, near.field()?);
    let (mut out, mut seen) = (chi.clone(), packed.clone());
    let (mut passes, mut flattened, mut gain): (Vec<Pass<T>>, _, _) = (Vec::new(), 0.0, 0.0);
    while passes.len() < PASSES {
        let before = passes.last().map(|pass| &pass.state);
        state = near.weigh(&now, before, &seen, gain, state)?;
        near.sums(&state, &sums)?;
        let five;
        (seen, five) = near.see(&areas, &sums, &state)?;
        let after;
        [gain, after] = five.gain(flattened);
        if gain == 0.0 {
            break;
        }
        out = near.take(&out, &areas, &sums, gain, passes.is_empty())?;
        passes.push(Pass {
            gain,
            sums: five,
            flattened,
            state: state.clone(),
        });
        flattened = after;
    }
    let first_gain = passes.first().map_or(0.0, |pass| pass.gain);
    let mut coarse = None;
    if is_needed(first_gain) {
        if passes.len() == PASSES {
            let before = passes.last().map(|pass| &pass.state);
            state = near.weigh(&now, before, &seen, gain, state)?;
        }
        coarse = near.find_coarse(samples, options.area, first_gain, &state)?;
    }
    if let Some(coarse) = &coarse {
        near.sums(&coarse.given, &sums)?;
        out = near.take(&out, &areas, &sums, 1.0, passes.is_empty())?;
    }
    let residual = Residual {
        area_weights: options.area,
        step,
        area,
        samples: packed,
        first: (passes.first()).map_or_else(|| state.clone(), |pass| pass.state.clone()),
        passes,
        coarse,
    };
    Ok((out, residual))
}

impl<R: Runtime, T: Scalar> Near<'_, R, T> {
    /// `(N, 2)` `s` and `u`, after a pass with this gain if there was one `before`, whose samples saw `seen`; `now`
    /// goes with them. The first has its `u` already.
    fn weigh(
        &self,
        now: &Buffer<T>,
        before: Option<&Buffer<T>>,
        seen: &Buffer<T>,
        gain: f64,
        first: Buffer<T>,
    ) -> Result<Buffer<T>, Error> {
        let state = match before {
            Some(_) => self.device.empty(STATE * self.count())?,
            None => first,
        };
        launch!(self.device, self.count(), BLOCK => weigh_samples<T>(
            self.samples, before.unwrap_or(self.samples), seen, now, state, self.count() as u32,
            T::of(gain), before.is_none(),
        ));
        Ok(state)
    }

    /// `(N, 3)` results of a pass at the samples, and the sums that its gain is made of.
    fn see(
        &self,
        areas: &Buffer<T>,
        sums: &Buffer<T>,
        state: &Buffer<T>,
    ) -> Result<(Buffer<T>, Sums), Error> {
        let seen: Buffer<T> = self.device.empty(SEEN * self.count())?;
        let partial: Buffer<T> = self.device.empty(SUMS * self.shares())?;
        launch!(self.device, self.count(), BLOCK => see_means<T>(
            self.pass(areas, sums), state, seen, partial, self.grid,
        ));
        let found = sum_columns(self.device, &partial, SUMS)?;
        let found = self.device.download(&found)?;
        let found = std::array::from_fn(|k| isograd::Real::f64(found[k]));
        Ok((seen, Sums::new(found)))
    }

    /// `χ − λ e`: a new array the first time.
    fn take(
        &self,
        chi: &Buffer<T>,
        areas: &Buffer<T>,
        sums: &Buffer<T>,
        gain: f64,
        first: bool,
    ) -> Result<Buffer<T>, Error> {
        // No array may be bound twice if one of the two is written.
        let (from, out) = match first {
            true => (chi, self.field()?),
            false => (areas, chi.clone()),
        };
        launch!(self.device, self.grid.cells(), BLOCK => take_means<T>(
            from, areas, sums, out, T::of(gain), first,
        ));
        Ok(out)
    }
}

/// `s = ω r`, and `u`, of each sample, once what a pass with this gain took is off.
#[cube(launch)]
fn weigh_samples<F: Float + CubeElement>(
    samples: &Array<F>,
    before: &Array<F>,
    seen: &Array<F>,
    now: &mut Array<F>,
    state: &mut Array<F>,
    count: u32,
    gain: F,
    #[comptime] first: bool,
) {
    let s = ABSOLUTE_POS;
    if s < count as usize {
        let mut offset = now[s];
        if comptime!(!first) {
            offset -= gain * seen[s * SEEN];
            now[s] = offset;
            state[s * STATE + 1] = before[s * STATE + 1] - gain * seen[s * SEEN + 1];
        }
        state[s * STATE] = sample::<F>(samples, s).trust * offset;
    }
}

/// Results of a pass at each sample; `w u`, `u²`, `s p`, `s²`, `p²`, each times `â`, summed a group at a time.
#[cube(launch)]
fn see_means<F: Float + CubeElement>(
    pass: &PassArrays<F>,
    state: &Array<F>,
    seen: &mut Array<F>,
    partial: &mut Array<F>,
    grid: Lattice<F>,
) {
    let i = ABSOLUTE_POS;
    let zero = F::new(0.0);
    let mut area = zero;
    let mut slope = zero;
    let mut forecast = zero;
    let mut s = zero;
    let mut u = zero;
    if i < pass.keys.len() {
        let mut mean = zero;
        if is_held::<F>(pass.keys[i], &grid) {
            let me = sample::<F>(&pass.samples, i);
            area = me.area;
            s = state[i * STATE];
            u = state[i * STATE + 1];
            let corner = corner::<F>(pass.keys[i], &grid);
            let found = see::<F>(&pass.sums, &pass.areas, corner, &grid, me, s);
            mean = found.mean;
            slope = found.slope;
            forecast = found.forecast;
        }
        seen[i * SEEN] = mean;
        seen[i * SEEN + 1] = slope;
        seen[i * SEEN + 2] = forecast;
    }
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let rise = sum_of_group::<F>(area * slope * u, &mut shared);
    let steep = sum_of_group::<F>(area * u * u, &mut shared);
    let agreement = sum_of_group::<F>(area * s * forecast, &mut shared);
    let offset = sum_of_group::<F>(area * s * s, &mut shared);
    let forecast = sum_of_group::<F>(area * forecast * forecast, &mut shared);
    let own = CUBE_POS * SUMS;
    if UNIT_POS == 0 && own < partial.len() {
        partial[own] = rise;
        partial[own + 1] = steep;
        partial[own + 2] = agreement;
        partial[own + 3] = offset;
        partial[own + 4] = forecast;
    }
}
