//! What every frequency is multiplied by.

use cubecl::prelude::*;

use crate::Buffer;

/// Tables of the gains `G/λ`.
pub(super) struct Gains<'a, T> {
    pub(super) shape: [usize; 3],
    /// Eigenvalues of the stiffness along x, y and z, then those of the mass.
    pub(super) spectrum: &'a Buffer<T>,
    /// `G` along x, over the factor that the transforms leave, then along y and z.
    pub(super) gaussian: Buffer<T>,
}

/// `G/λ` at the place `at` of a field of `(nx, ny, nz)` frequencies; 0 for the constant mode.
#[cube]
pub(super) fn gain<F: Float>(
    spectrum: &Array<F>,
    gaussian: &Array<F>,
    at: usize,
    nx: usize,
    ny: usize,
    nz: usize,
) -> F {
    let x = at / (ny * nz);
    let y = nx + at / nz % ny;
    let z = nx + ny + at % nz;
    let mass = nx + ny + nz;
    let (kx, ky, kz) = (spectrum[x], spectrum[y], spectrum[z]);
    let (mx, my, mz) = (spectrum[mass + x], spectrum[mass + y], spectrum[mass + z]);
    let eigenvalue = kx * my * mz + mx * (ky * mz + my * kz);
    let amplitude = gaussian[x] * gaussian[y] * gaussian[z];
    select(at == 0, F::new(0.0), amplitude / eigenvalue)
}
