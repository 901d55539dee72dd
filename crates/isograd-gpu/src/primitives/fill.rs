//! Arrays of zeros, and arrays added to arrays.

use cubecl::prelude::*;

use crate::device::{check_length, launch};
use crate::{Buffer, Device, Error, Scalar};

const BLOCK: u32 = 256;

/// `len` zeros.
pub fn zeros<R: Runtime, T: Scalar>(device: &Device<R>, len: usize) -> Result<Buffer<T>, Error> {
    let out = device.empty(len)?;
    launch!(device, len, BLOCK => fill_zeros<T>(out));
    Ok(out)
}

/// `len` zeros of one unit, in registers.
#[cube]
pub(crate) fn own_zeros<F: Float>(#[comptime] len: usize) -> Array<F> {
    let mut zeros = Array::<F>::new(len);
    #[unroll]
    for i in 0..len {
        zeros[i] = F::new(0.0);
    }
    zeros
}

/// Adds `values` to `out`, one by one.
///
/// # Errors
/// [`Error::Length`] where their lengths differ.
pub fn add<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: &Buffer<T>,
    out: &Buffer<T>,
) -> Result<(), Error> {
    add_scaled(device, values, T::of(1.0), out)
}

/// Adds `factor` times `values` to `out`, one by one.
///
/// # Errors
/// [`Error::Length`] where their lengths differ.
pub fn add_scaled<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: &Buffer<T>,
    factor: T,
    out: &Buffer<T>,
) -> Result<(), Error> {
    check_length("the array to add", values, out.len())?;
    launch!(device, out.len(), BLOCK => add_values<T>(values, factor, out));
    Ok(())
}

#[cube(launch)]
fn fill_zeros<F: Float>(out: &mut Array<F>) {
    if ABSOLUTE_POS < out.len() {
        out[ABSOLUTE_POS] = F::new(0.0);
    }
}

#[cube(launch)]
fn add_values<F: Float + CubeElement>(values: &Array<F>, factor: F, out: &mut Array<F>) {
    if ABSOLUTE_POS < out.len() {
        out[ABSOLUTE_POS] += factor * values[ABSOLUTE_POS];
    }
}
