//! From the plain solution to the screened one.

use cubecl::prelude::Runtime;

use super::gradients::System;
use super::{Equation, Error};
use crate::grid::check_field;
use crate::primitives::fill::add_scaled;
use crate::{Buffer, Device, Scalar};

/// Turns the plain solution `chi`, `(nx, ny, nz)`, into the screened one, and returns the iterations it took.
/// Waits for the device.
///
/// # Errors
/// [`screened::Error::NotConverged`](isograd::poisson::screened::Error::NotConverged), `chi` then being as it
/// was; those of the device.
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    equation: &Equation<'_, T>,
    chi: &Buffer<T>,
) -> Result<usize, Error> {
    check_field("the plain solution", chi, &equation.splat.grid)?;
    let Some(system) = System::new(device, equation)? else {
        return Ok(0);
    };
    let rest = system.at_samples(chi, 1.0, None)?;
    let (solution, iterations) = system.solve(&rest)?;
    let change = system.green(&solution)?;
    add_scaled(device, &change, T::of(-equation.screening), chi)?;
    Ok(iterations)
}
