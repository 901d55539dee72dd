//! The field, the level and the grid in kernels.

use cubecl::prelude::*;
use isograd::isosurface::{SMALLEST_DIFFERENCE, TIE};

use super::Residual;
use super::signs::Signs;
use crate::device::Ready;
use crate::element::crossing::crossing;
use crate::{Device, Error, Scalar};

#[derive(CubeType, CubeLaunch)]
pub struct Values<F: Float + CubeElement> {
    pub chi: Array<F>,
    /// One number.
    pub level: Array<F>,
    /// Low corner and spacing of the grid; the share of the range of `χ` that a difference counts as, at least; the
    /// difference of volumes that counts as none.
    pub scales: Array<F>,
}

impl<T: Scalar> Residual<T> {
    /// Field, level and grid as an argument of a kernel.
    pub(super) fn values<R: Runtime>(
        &self,
        device: &Device<R>,
    ) -> Result<Ready<ValuesLaunch<T, R>>, Error> {
        let [x, y, z] = self.grid.lower();
        let smallest = T::of(SMALLEST_DIFFERENCE);
        let tie = T::of(TIE) * T::EPSILON;
        let scales = device.upload(&[x, y, z, self.grid.spacing(), smallest, tie])?;
        let values = ValuesLaunch::new(self.chi.arg(), self.level.arg(), scales.arg());
        Ok(Ready::new(values))
    }
}

/// Place of the level on the lattice edge along `axis` from the cell at place `p` in memory: as on the CPU,
/// and between 0 and 1 also where the device divides less exactly.
#[cube]
pub(super) fn fraction_on<F: Float + CubeElement>(
    signs: &Signs,
    values: &Values<F>,
    p: usize,
    axis: u32,
) -> F {
    let q = p + stride(signs, axis);
    let eta = crossing::<F>(values.chi[p], values.chi[q], values.level[0]);
    let mut fraction = F::new(0.0);
    if eta > F::new(0.0) {
        fraction = min(eta, F::new(1.0));
    }
    fraction
}

/// Distance in memory to the next cell along an axis.
#[cube]
pub(super) fn stride(signs: &Signs, axis: u32) -> usize {
    let plane = signs.ny * signs.nz;
    select(axis == 0u32, plane, select(axis == 1u32, signs.nz, 1u32)) as usize
}
