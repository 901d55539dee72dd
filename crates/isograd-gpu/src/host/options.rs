//! Options of the CPU's pipeline as those of the device's.

use super::Error;
use crate::pipeline;

/// The same options on a device.
///
/// # Errors
/// [`Error::Option`] for what devices do not have; [`isograd::Error`] for what makes no sense anywhere.
pub fn translate(options: &isograd::Options) -> Result<pipeline::Options, Error> {
    if !options.smoothing.is_valid() {
        return Err(isograd::Error::Smoothing(options.smoothing).into());
    }
    if !(options.screening >= 0.0) || !options.screening.is_finite() {
        return Err(isograd::Error::Screening(options.screening).into());
    }
    Ok(pipeline::Options {
        weights: options.weights,
        area_weights: options.area_weights,
        smoothing: options.smoothing,
        screening: options.screening,
        level: options.level,
        band: options.band,
    })
}
