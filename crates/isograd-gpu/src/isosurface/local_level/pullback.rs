//! Cotangents of the indicator that came out to those of the one that went in, of its values at the samples, and of
//! points, normals, areas and grid.

use cubecl::prelude::*;
use isograd::isosurface::local_level::{STEEPEST, Step, Sums};

use super::cells::{FORM, Others, Taken, Tilt, pull_means, put_means_back};
use super::near::Near;
use super::plate;
use super::pull_samples::{
    BARS, GainBarsLaunch, SlopesLaunch, add_bars, add_bars_of_grid, pull_cells, pull_plates,
    pull_seen_means, pull_slopes, see_means_again,
};
use super::sample::{SAMPLE, SEEN};
use super::{Pass, Residual};
use crate::device::{Ready, check_length, launch};
use crate::grid::check_field;
use crate::primitives::fill::{add, zeros};
use crate::primitives::reduce::{BLOCK, sum, sum_columns};
use crate::splat::{self, SampleCotangent, Samples};
use crate::spread::Before;
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents that are returned, besides those that are added.
#[derive(Clone, Debug)]
pub struct Cotangents<T> {
    /// `(nx, ny, nz)` the indicator that went in, to rounding; the array of the one that came out, if that is the same.
    pub chi: Buffer<T>,
    /// `(N,)` cotangents of `χ(x_i)`, which the pullback of the mean takes.
    pub values: Buffer<T>,
    /// `(1,)` cotangent of the iso-value `c`.
    pub level: Buffer<T>,
    /// Of the smoothing `σ`, in cells, as far as trust and shifts depend on it.
    pub smoothing: f64,
}

/// Adds to `out` what the cotangents `chi_bar` `(nx, ny, nz)` of the indicator `chi` that came out mean for points,
/// normals, areas and grid. `chi_bar` becomes that of the indicator that went in, but for what
/// [`Cotangents::values`] means for it. All else is as it was in [`forward`](super::forward()). Waits for the device once,
/// and once a pass; not at all if there was none.
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::TooLarge`], [`Error::Failed`].
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    splat: &splat::Residual<T>,
    samples: Samples<'_, T>,
    chi: &Buffer<T>,
    chi_bar: &Buffer<T>,
    out: &SampleCotangent<T>,
) -> Result<Cotangents<T>, Error> {
    let (grid, order, count) = (&splat.grid, &splat.order, samples.len());
    samples.check()?;
    check_length("the array of areas", samples.areas, order.keys.len())?;
    check_length("the residual", &residual.samples, SAMPLE * count)?;
    check_field("the indicator", chi, grid)?;
    check_field("the cotangent of the indicator", chi_bar, grid)?;
    out.check(count)?;
    let values: Buffer<T> = zeros(device, count)?;
    if residual.passes.is_empty() && residual.coarse.is_none() {
        return Ok(Cotangents {
            chi: chi.clone(),
            values,
            level: zeros(device, 1)?,
            smoothing: 0.0,
        });
    }
    let near = Near {
        device,
        grid,
        order,
        samples: &residual.samples,
    };
    let mut pulled = Pulled {
        bars: zeros(device, BARS * count)?,
        forms: device.empty(FORM * count)?,
        areas: near.areas()?,
        sums: near.field()?,
        node_bars: near.field()?,
        chi: chi.clone(),
        is_own: false,
    };
    let mut of_coarse = 0.0;
    if let Some(coarse) = &residual.coarse {
        pulled.pull_given(&near, &coarse.given, chi_bar)?;
        let bars = &mut pulled.bars;
        of_coarse = near.pull_coarse(samples, residual.area_weights, coarse, bars)?;
    }
    let mut flattened_bar = 0.0;
    for (k, pass) in residual.passes.iter().enumerate().rev() {
        let of_gain = if k == 0 { of_coarse } else { 0.0 };
        flattened_bar = pulled.pull_pass(&near, pass, chi_bar, [of_gain, flattened_bar])?;
    }
    let smoothing = pulled.pull_trust(&near, &residual.first, residual)?;
    near.spread::<Tilt>(&pulled.forms, Before::Kept, chi_bar)?;
    let level = pulled.add(&near, residual.area_weights, &values, out)?;
    Ok(Cotangents {
        chi: pulled.chi,
        values,
        level,
        smoothing,
    })
}

/// State carried from pass to pass.
struct Pulled<T> {
    /// `(N, 10)` cotangents of the samples.
    bars: Buffer<T>,
    /// `(N, 23)` samples in the form that is spread.
    forms: Buffer<T>,
    /// `D − ε` at every cell.
    areas: Buffer<T>,
    /// `M`, then `D̄`.
    sums: Buffer<T>,
    /// `M̄`.
    node_bars: Buffer<T>,
    /// `χ` before the passes that were pulled, and whether it is an array of its own.
    chi: Buffer<T>,
    is_own: bool,
}

impl<T: Scalar> Pulled<T> {
    /// One pass backward. Takes and returns the cotangent of the share of the slope that is gone; `of_gain` is that of `λ` through
    /// the coarse pass.
    fn pull_pass<R: Runtime>(
        &mut self,
        near: &Near<'_, R, T>,
        pass: &Pass<T>,
        chi_bar: &Buffer<T>,
        [of_gain, flattened_bar]: [f64; 2],
    ) -> Result<f64, Error> {
        near.sums(&pass.state, &self.sums)?;
        let (seen, gain_bar) = self.see_again(near, &pass.state, pass.gain, chi_bar)?;
        let gain_bar = of_gain + gain_bar;
        let (bars, before_bar) = pass.sums.pullback(pass.flattened, gain_bar, flattened_bar);
        self.pull_seen(near, &pass.state, pass.gain, &seen, bars);
        self.pull_cell_means(near, pass.gain, chi_bar)?;
        near.spread::<Others>(&self.forms, Before::Kept, &self.node_bars)?;
        near.spread::<Taken>(&self.forms, Before::Kept, &self.sums)?;
        launch!(near.device, near.count(), BLOCK => pull_cells<T>(
            near.order.keys, near.samples, self.node_bars, self.sums, pass.state, self.bars,
            near.count() as u32, near.grid,
        ));
        Ok(before_bar)
    }

    /// The coarse pass backward, from cells to the means that samples were given. `bars` are 0 before, and then those of samples
    /// that are all trusted.
    fn pull_given<R: Runtime>(
        &mut self,
        near: &Near<'_, R, T>,
        given: &Buffer<T>,
        chi_bar: &Buffer<T>,
    ) -> Result<(), Error> {
        near.sums(given, &self.sums)?;
        let (seen, _) = self.see_again(near, given, 1.0, chi_bar)?;
        self.pull_seen(near, given, 1.0, &seen, Sums::default());
        self.pull_cell_means(near, 1.0, chi_bar)?;
        let samples = near.trusting()?;
        launch!(near.device, near.count(), BLOCK => pull_cells<T>(
            near.order.keys, samples, self.node_bars, self.sums, given, self.bars,
            near.count() as u32, near.grid,
        ));
        Ok(())
    }

    /// `M̄` and `D̄` at the cells, but for the samples left out.
    fn pull_cell_means<R: Runtime>(
        &self,
        near: &Near<'_, R, T>,
        gain: f64,
        chi_bar: &Buffer<T>,
    ) -> Result<(), Error> {
        near.spread::<Tilt>(&self.forms, Before::Replaced, &self.node_bars)?;
        launch!(near.device, near.grid.cells(), BLOCK => pull_means<T>(
            self.areas, chi_bar, self.node_bars, self.sums, T::of(gain),
        ));
        Ok(())
    }

    /// `(N, 3)` results of the pass at the samples, and `λ̄` but for the share of the slope. `χ` becomes that before
    /// the pass.
    fn see_again<R: Runtime>(
        &mut self,
        near: &Near<'_, R, T>,
        state: &Buffer<T>,
        gain: f64,
        chi_bar: &Buffer<T>,
    ) -> Result<(Buffer<T>, f64), Error> {
        let device = near.device;
        let seen: Buffer<T> = device.empty(SEEN * near.count())?;
        let partial: Buffer<T> = device.empty(near.shares() + near.grid.cells().div_ceil(BLOCK))?;
        launch!(device, near.count(), BLOCK => see_means_again<T>(
            near.pass(&self.areas, &self.sums), state, self.bars, seen, partial, near.grid,
        ));
        // No array may be bound twice if one of the two is written.
        let first = !self.is_own;
        let (from, out) = match first {
            true => (&self.chi, near.field()?),
            false => (&self.areas, self.chi.clone()),
        };
        launch!(device, near.grid.cells(), BLOCK => put_means_back<T>(
            from, self.areas, self.sums, chi_bar, out, partial, T::of(gain), first,
        ));
        (self.chi, self.is_own) = (out, true);
        let gain_bar = device.download(&sum(device, &partial)?)?[0];
        Ok((seen, isograd::Real::f64(gain_bar)))
    }

    fn pull_seen<R: Runtime>(
        &self,
        near: &Near<'_, R, T>,
        state: &Buffer<T>,
        gain: f64,
        seen: &Buffer<T>,
        bars: Sums,
    ) {
        let of_gain = GainBarsLaunch::new(
            T::of(gain),
            T::of(bars.rise),
            T::of(bars.slope),
            T::of(bars.agreement),
            T::of(bars.offset),
            T::of(bars.prediction),
        );
        launch!(near.device, near.count(), BLOCK => pull_seen_means<T>(
            near.pass(&self.areas, &self.sums), seen, state, self.bars, self.forms,
            Ready::new(of_gain), near.grid,
        ));
    }

    /// From trust, shifts and slopes before the first pass to places, normals and areas; and to cells, as forms to
    /// spread. Returns the cotangent of the smoothing.
    fn pull_trust<R: Runtime>(
        &self,
        near: &Near<'_, R, T>,
        state: &Buffer<T>,
        residual: &Residual<T>,
    ) -> Result<f64, Error> {
        let device = near.device;
        let step: Step = residual.step;
        let partial: Buffer<T> = device.empty(2 * near.shares())?;
        launch!(device, near.count(), BLOCK => pull_plates<T>(
            state, self.bars, partial, near.count() as u32, plate::arg(&step, STEEPEST), step.thin,
        ));
        let found = device.download(&sum_columns(device, &partial, 2)?)?;
        let share = step.usual_pullback(isograd::Real::f64(found[0]), residual.area);
        let slopes = SlopesLaunch::new(
            self.chi.arg(),
            near.order.keys.arg(),
            near.samples.arg(),
            state.arg(),
        );
        launch!(device, near.count(), BLOCK => pull_slopes<T>(
            Ready::new(slopes), self.bars, self.forms, T::of(share), plate::arg(&step, STEEPEST),
            near.grid, step.thin,
        ));
        Ok(step.width_pullback(isograd::Real::f64(found[1])))
    }

    /// From index coordinates and areas in cells to those of the user, in the order of the input. Returns the
    /// cotangent of the iso-value.
    fn add<R: Runtime>(
        &self,
        near: &Near<'_, R, T>,
        area_weights: bool,
        values: &Buffer<T>,
        out: &SampleCotangent<T>,
    ) -> Result<Buffer<T>, Error> {
        let device = near.device;
        launch!(device, near.count(), BLOCK => add_bars<T>(
            near.order.places, self.bars, values, out.points, out.normals, out.areas,
            near.grid.spacing(), area_weights,
        ));
        let grid_sums: Buffer<T> = device.empty(4 * near.shares())?;
        let level_sums: Buffer<T> = device.empty(near.shares())?;
        launch!(device, near.count(), BLOCK => add_bars_of_grid<T>(
            near.order.keys, near.samples, self.bars, grid_sums, level_sums, near.count() as u32,
            near.grid, area_weights,
        ));
        add(device, &sum_columns(device, &grid_sums, 4)?, &out.grid)?;
        sum(device, &level_sums)
    }
}
