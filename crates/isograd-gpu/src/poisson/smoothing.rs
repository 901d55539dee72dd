//! Cotangent of the smoothing: [`isograd::poisson::smoothing::pullback`] on a device.
//!
//! With `L` the sum of second differences along the axes, even at the walls, `χ·Lχ̄ = −Σ ∇χ·∇χ̄` over the
//! differences of neighboring cells: fewer terms, and smaller ones.

use cubecl::prelude::*;

use crate::device::{check_length, launch};
use crate::primitives::reduce::{self, BLOCK, write_sum};
use crate::{Buffer, Device, Error, Scalar};

/// Cells of a unit.
const OWN: usize = 8;

/// `σ χ·Lχ̄`, one number, which is `σ̄` for cotangents `chi_bar` of `chi`, both `(nx, ny, nz)` in C order.
/// Added in a fixed order.
///
/// # Errors
/// [`Error::Length`] for fields of other sizes, or [`Error::TooLarge`].
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    smoothing: f64,
    shape: [usize; 3],
    chi: &Buffer<T>,
    chi_bar: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let cells = shape.iter().product();
    check_length("the solution", chi, cells)?;
    check_length("its cotangent", chi_bar, cells)?;
    if cells == 0 {
        return device.upload(&[T::of(0.0)]);
    }
    let [nx, ny, nz] = shape;
    let sums: Buffer<T> = device.empty(cells.div_ceil(BLOCK * OWN))?;
    launch!(device, sums.len() * BLOCK, BLOCK => sum_products<T>(
        chi, chi_bar, sums, T::of(-smoothing), nx, ny, nz,
    ));
    reduce::sum(device, &sums)
}

/// `factor` times the sum of products of differences, for each group of cells.
#[cube(launch)]
fn sum_products<F: Float + CubeElement>(
    chi: &Array<F>,
    chi_bar: &Array<F>,
    sums: &mut Array<F>,
    factor: F,
    nx: usize,
    ny: usize,
    nz: usize,
) {
    let first = CUBE_POS * (BLOCK * OWN) + UNIT_POS as usize;
    let mut own = F::new(0.0);
    for i in 0..OWN {
        let at = first + i * BLOCK;
        if at < nx * ny * nz {
            if at % nz + 1 < nz {
                own += (chi[at + 1] - chi[at]) * (chi_bar[at + 1] - chi_bar[at]);
            }
            if at / nz % ny + 1 < ny {
                let next = at + nz;
                own += (chi[next] - chi[at]) * (chi_bar[next] - chi_bar[at]);
            }
            if at / (ny * nz) + 1 < nx {
                let next = at + ny * nz;
                own += (chi[next] - chi[at]) * (chi_bar[next] - chi_bar[at]);
            }
        }
    }
    write_sum::<F>(factor * own, sums);
}
