//! Errors of the isosurface stage: found on the device, worded as on the CPU.

use cubecl::prelude::*;
use isograd::{Grid, isosurface};

use super::signs::{BLOCK, not_finite};
use crate::device::launch;
use crate::primitives::ends::ends;
use crate::{Buffer, Device, Scalar};

/// Errors of the isosurface stage.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The field has none.
    #[error(transparent)]
    Surface(#[from] isosurface::Error),
    /// The device can't make it.
    #[error(transparent)]
    Device(#[from] crate::Error),
}

/// The level is not finite.
pub(super) fn bad_level<R: Runtime, T: Scalar>(device: &Device<R>, level: &Buffer<T>) -> Error {
    match device.download(level) {
        Ok(level) => isosurface::Error::Level {
            level: level[0].f64(),
        }
        .into(),
        Err(error) => error.into(),
    }
}

/// A value is not finite: the first one.
pub(super) fn bad_value<R: Runtime, T: Scalar>(
    device: &Device<R>,
    grid: &Grid<T>,
    chi: &Buffer<T>,
    faults: &Buffer<u32>,
) -> Error {
    let find = || -> Result<Error, crate::Error> {
        let (place, value): (Buffer<u32>, Buffer<T>) = (device.empty(1)?, device.empty(1)?);
        launch!(device, [1; BLOCK] => first_bad<T>(
            chi, faults, place, value, grid.shape()[2] as u32, BLOCK,
        ));
        let cell = grid.cell(device.download(&place)?[0] as usize);
        let value = device.download(&value)?[0].f64();
        Ok(isosurface::Error::NotFinite { cell, value }.into())
    };
    find().unwrap_or_else(Error::from)
}

/// All values are on one side of the level.
pub(super) fn one_sided<R: Runtime, T: Scalar>(
    device: &Device<R>,
    chi: &Buffer<T>,
    level: &Buffer<T>,
    nothing_inside: bool,
) -> Error {
    let find = || -> Result<Error, crate::Error> {
        let level = device.download(level)?[0].f64();
        let values = device.download(&ends(device, chi, 1)?)?;
        let (min, max) = (values[0].f64(), values[1].f64());
        Ok(if nothing_inside {
            isosurface::Error::NothingInside { level, min, max }.into()
        } else {
            isosurface::Error::NothingOutside { level, min, max }.into()
        })
    };
    find().unwrap_or_else(Error::from)
}

/// The first value that is not finite, and its place: one group looks for the first word that has any.
#[cube(launch)]
fn first_bad<F: Float>(
    chi: &Array<F>,
    faults: &Array<u32>,
    place: &mut Array<u32>,
    value: &mut Array<F>,
    nz: u32,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<u32>::new(block);
    let unit = UNIT_POS as usize;
    let mut first = faults.len();
    let mut word = unit;
    while word < first {
        if (faults[word] & 1u32) != 0u32 {
            first = word;
        }
        word += block;
    }
    shared[unit] = first as u32;
    sync_cube();
    if unit == 0 {
        for other in 0..block {
            first = min(first, shared[other] as usize);
        }
        let words = (nz as usize).div_ceil(32usize);
        let begin = first / words * nz as usize;
        let mut at = begin + first % words * 32;
        let end = min(at + 32, begin + nz as usize);
        while at + 1 < end && not_finite::<F>(chi[at]) == 0u32 {
            at += 1;
        }
        place[0] = at as u32;
        value[0] = chi[at];
    }
}
