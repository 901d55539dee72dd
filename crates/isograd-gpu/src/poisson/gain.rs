//! The factor of each frequency.

use cubecl::prelude::*;

use crate::{Buffer, Scalar};

/// Tables of the gains `G/λ` of a field of some shape.
pub(super) struct Gains<'a, T> {
    pub(super) shape: [usize; 3],
    /// Eigenvalues of the stiffness along the axes, then those of the mass.
    pub(super) spectrum: &'a Buffer<T>,
    /// `G` along the axes, over the factor that the transforms leave.
    pub(super) gaussian: Buffer<T>,
}

/// [`Gains`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(super) struct Spectrum<F: Float + CubeElement> {
    eigenvalues: Array<F>,
    gaussian: Array<F>,
    pub(super) nx: usize,
    pub(super) ny: usize,
    pub(super) nz: usize,
}

impl<T: Scalar> Gains<'_, T> {
    /// The tables as an argument of a kernel.
    pub(super) fn arg<R: Runtime>(&self) -> SpectrumLaunch<T, R> {
        let [nx, ny, nz] = self.shape;
        SpectrumLaunch::new(self.spectrum.arg(), self.gaussian.arg(), nx, ny, nz)
    }
}

/// `G/λ` at the frequencies `x` along the first axis and `line` along the others, `y` and then `z`; 0 for the
/// constant mode.
#[cube]
pub(super) fn gain<F: Float + CubeElement>(gains: &Spectrum<F>, x: usize, line: usize) -> F {
    let y = gains.nx + line / gains.nz;
    let z = gains.nx + gains.ny + line % gains.nz;
    let mass = gains.nx + gains.ny + gains.nz;
    let mass_y = gains.eigenvalues[mass + y];
    let mass_z = gains.eigenvalues[mass + z];
    let mixed = gains.eigenvalues[y] * mass_z + mass_y * gains.eigenvalues[z];
    let eigenvalue = gains.eigenvalues[x] * (mass_y * mass_z) + gains.eigenvalues[mass + x] * mixed;
    let amplitude = gains.gaussian[x] * (gains.gaussian[y] * gains.gaussian[z]);
    select(x + line == 0, F::new(0.0), amplitude / eigenvalue)
}
