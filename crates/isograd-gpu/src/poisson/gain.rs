//! What every frequency is multiplied by.

use cubecl::prelude::*;

use crate::Buffer;

/// Tables of the gains `G/λ`.
pub(super) struct Gains<'a, T> {
    pub(super) shape: [usize; 3],
    /// Eigenvalues of the stiffness along the axes, then those of the mass.
    pub(super) spectrum: &'a Buffer<T>,
    /// `G` along the axes, over the factor that the transforms leave.
    pub(super) gaussian: Buffer<T>,
}

/// `G/λ` at the frequencies `x` along the first axis and `line` along the others, `y` and then `z`; 0 for the
/// constant mode.
#[cube]
pub(super) fn gain<F: Float>(
    spectrum: &Array<F>,
    gaussian: &Array<F>,
    x: usize,
    line: usize,
    nx: usize,
    ny: usize,
    nz: usize,
) -> F {
    let y = nx + line / nz;
    let z = nx + ny + line % nz;
    let mass = nx + ny + nz;
    let (mass_y, mass_z) = (spectrum[mass + y], spectrum[mass + z]);
    let mixed = spectrum[y] * mass_z + mass_y * spectrum[z];
    let eigenvalue = spectrum[x] * (mass_y * mass_z) + spectrum[mass + x] * mixed;
    let amplitude = gaussian[x] * (gaussian[y] * gaussian[z]);
    select(x + line == 0, F::new(0.0), amplitude / eigenvalue)
}
