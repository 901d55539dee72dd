//! The samples on a device, and how they are spread.

use cubecl::prelude::*;

use super::cells::{BUMP, Bump, REACH};
use super::sample::{PassArraysLaunch, STATE, sample};
use crate::device::{Ready, launch};
use crate::primitives::reduce::BLOCK;
use crate::splat::SampleOrder;
use crate::spread::{Before, Spread, spread};
use crate::{Buffer, Device, Error, Scalar};

/// The samples on their grid, in sorted order.
pub(super) struct Near<'a, R: Runtime, T> {
    pub device: &'a Device<R>,
    pub grid: &'a isograd::Grid<T>,
    pub order: &'a SampleOrder,
    /// `(N, 8)`.
    pub samples: &'a Buffer<T>,
}

impl<R: Runtime, T: Scalar> Near<'_, R, T> {
    pub(super) fn count(&self) -> usize {
        self.order.keys.len()
    }

    /// Number of groups that have samples, each of which has its own sums.
    pub(super) fn shares(&self) -> usize {
        self.count().div_ceil(BLOCK).max(1)
    }

    /// The samples and the fields of a pass as an argument of a kernel.
    pub(super) fn pass(
        &self,
        areas: &Buffer<T>,
        sums: &Buffer<T>,
    ) -> Ready<PassArraysLaunch<T, R>> {
        Ready::new(PassArraysLaunch::new(
            self.order.keys.arg(),
            self.samples.arg(),
            areas.arg(),
            sums.arg(),
        ))
    }

    /// A field that holds anything.
    pub(super) fn field(&self) -> Result<Buffer<T>, Error> {
        self.device.empty(self.grid.cells())
    }

    /// `D − ε` at every cell.
    pub(super) fn areas(&self) -> Result<Buffer<T>, Error> {
        let out = self.field()?;
        self.bump(self.samples, true, &out)?;
        Ok(out)
    }

    /// Writes `M` for these `(N, 2)` `s` and `u`.
    pub(super) fn sums(&self, state: &Buffer<T>, out: &Buffer<T>) -> Result<(), Error> {
        self.bump(state, false, out)
    }

    fn bump(&self, state: &Buffer<T>, ones: bool, out: &Buffer<T>) -> Result<(), Error> {
        let bumps: Buffer<T> = self.device.empty(BUMP * self.count())?;
        launch!(self.device, self.count(), BLOCK => make_bumps<T>(
            self.samples, state, bumps, self.count() as u32, ones,
        ));
        self.spread::<Bump>(&bumps, Before::Replaced, out)
    }

    pub(super) fn spread<P: Spread>(
        &self,
        forms: &Buffer<T>,
        before: Before,
        out: &Buffer<T>,
    ) -> Result<(), Error> {
        spread::<R, T, P>(self.device, forms, self.order, REACH, before, out)
    }
}

/// `â s` of each sample, or `â`, in the form that is spread.
#[cube(launch)]
fn make_bumps<F: Float>(
    samples: &Array<F>,
    state: &Array<F>,
    bumps: &mut Array<F>,
    count: u32,
    #[comptime] ones: bool,
) {
    let s = ABSOLUTE_POS;
    if s < count as usize {
        let me = sample::<F>(samples, s);
        let mut much = me.area;
        if comptime!(!ones) {
            much *= state[s * STATE];
        }
        me.f.store(bumps, s * BUMP);
        bumps[s * BUMP + 3] = much;
    }
}
