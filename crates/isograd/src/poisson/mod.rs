//! The Poisson equation, solved directly by cosine or sine transforms.
//!
//! # Map
//! `b → χ`, both one value per cell of a grid of `(nx, ny, nz)` cells, in index space (cell size 1, no
//! unit). Trilinear elements at the cell centers with even reflection at the walls (homogeneous
//! Neumann) give, per axis, with `θ_k = πk/n`,
//!
//! - stiffness `K = tridiag(−1, 2, −1)`, end rows `(1, −1)`, eigenvalues `2 − 2 cos θ_k`;
//! - mass `M = tridiag(1, 4, 1)/6`, end rows `(5, 1)/6`, eigenvalues `(2 + cos θ_k)/3`;
//!
//! both diagonal in the DCT-II. The matrix is the constant `A = K⊗M⊗M + M⊗K⊗M + M⊗M⊗K`: the paper's
//! `A` (eq. `linear_system`) on a uniform grid, in index coordinates. Then
//!
//! `χ = IDCT( G/λ · DCT(b) )`, `λ_k = K_x M_y M_z + M_x K_y M_z + M_x M_y K_z`,
//!
//! with the constant mode set to 0: the mean of `b` is ignored, and `χ` has mean 0. `G = exp(−σ²(1 − cos θ))` per
//! axis is the smoothing of `χ` by the Gaussian of lattices, of `σ` cells: diffusion for the time `σ²/2`, with the second
//! differences of the cells as Laplacian (T. Lindeberg, *Scale-space for discrete signals*, IEEE TPAMI 12, 1990). `σ = 0`
//! is the plain equation `Aχ = b − mean(b)`. No iteration, no tolerance: the relative residual is a few units of rounding.
//!
//! With [closed walls](Walls) the reflection is odd (`χ = 0` at the walls: homogeneous Dirichlet), the end rows of `K` are
//! `(3, −1)` and those of `M` are `(3, 1)/6`, and all is diagonal in the DST-II, at `θ_k = π(k+1)/n`. No mode is constant,
//! so nothing of `b` is ignored, and the mean of `χ` is not free. That transform is the DCT-II of the line with alternating
//! signs, in reverse order (`sin(π(j+½)(n−k)/n) = (−1)^j cos(π(j+½)k/n)`), so the same code solves it: `b` and `χ` get the
//! signs `(−1)^{i+j+k}`, and frequency `k` has the eigenvalues of `θ = π(n−k)/n`.
//!
//! # Residual
//! None: the map is linear and constant. The plan and `σ` are all that the pullback needs.
//!
//! # Pullback
//! `b̄ = IDCT( G/λ · DCT(χ̄) )`: the operator is symmetric, so the pullback is [`Plan::solve`] itself,
//! applied to `χ̄` with the same `σ` (the paper's adjoint solve). With `L` the sum of second differences along the axes,
//! `∂χ/∂σ = σ L χ` and `σ̄ = σ χ̄·Lχ`: [`smoothing`].
//!
//! # Not differentiable
//! Nothing: the map is linear.
//!
//! # Reproducibility
//! The number of threads does not change a bit. The Fourier transforms (`rustfft`) are chosen by the
//! instruction set at run time, so two kinds of processor may differ in the last bits.
//!
//! Reference for the transform of a reordered line: J. Makhoul, *A fast cosine transform in one and two
//! dimensions*, IEEE Trans. ASSP 28 (1980).

mod axis;
mod passes;
pub(crate) mod pyramid;
mod scratch;
pub mod screened;
pub mod smoothing;
pub mod spectrum;
#[cfg(test)]
pub(crate) mod tests;
mod walls;
#[cfg(test)]
mod walls_tests;

use std::f64::consts::PI;

use axis::Axis;
use pulp::Arch;

use crate::Real;
pub use scratch::Scratch;
pub use smoothing::Smoothing;
pub use walls::Walls;
pub(crate) use walls::{margin, reaches_wall};

/// Errors of the Poisson stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The field has another size than the plan.
    #[error(
        "a field of {values} values for a plan of {shape:?} cells; make a plan for the field's own grid"
    )]
    Length {
        /// Number of values given.
        values: usize,
        /// Cells of the plan.
        shape: [usize; 3],
    },
    /// The smoothing is negative or not finite.
    #[error("the smoothing is {smoothing} cells; it must be finite and 0 or more")]
    Smoothing {
        /// The smoothing, in cells.
        smoothing: f64,
    },
}

/// Solver for one grid: the Fourier plans and the eigenvalues per axis. Reused for every right-hand side and shared
/// between threads.
pub struct Plan<T: Real> {
    shape: [usize; 3],
    closed: bool,
    axes: [Axis<T>; 3],
    symbols: Option<Symbols<T>>,
    arch: Arch,
}

/// Factors that replace those of the equation.
enum Symbols<T> {
    /// Amplitudes per axis, with which the stiffnesses are replaced, too.
    Axes([Vec<T>; 3]),
    /// The gain of every frequency, `(ny, nz, nx)`.
    Table(Vec<T>),
}

/// Factors along an axis at one frequency: the gain is the product of the amplitudes over the sum of the stiffnesses.
struct Symbol {
    amplitude: f64,
    stiffness: f64,
}

impl<T: Real> Plan<T> {
    /// A plan for grids of `(nx, ny, nz)` cells with free walls, of any size, primes included. Memory and time grow with
    /// `nx + ny + nz` only.
    pub fn new(shape: [usize; 3]) -> Self {
        Self::with_walls(shape, false)
    }

    /// Like [`Self::new`], with closed or free walls.
    pub fn with_walls(shape: [usize; 3], closed: bool) -> Self {
        Self {
            shape,
            closed,
            axes: shape.map(|n| Axis::new(n, closed)),
            symbols: None,
            arch: Arch::new(),
        }
    }

    /// A plan with the factors `symbol(θ)` at each angle `θ` per cell, from 0 to π.
    fn with_symbols(shape: [usize; 3], closed: bool, symbol: impl Fn(f64) -> Symbol) -> Self {
        let mut plan = Self::with_walls(shape, closed);
        let amplitudes = [0, 1, 2].map(|a| {
            let (n, axis) = (shape[a], &mut plan.axes[a]);
            let waves = (0..n).map(|k| axis::wave(k, n, closed));
            let symbols = waves.map(|k| symbol(PI * k as f64 / n as f64));
            let (amplitudes, stiffness) = symbols
                .map(|symbol| (T::of(symbol.amplitude), T::of(symbol.stiffness)))
                .unzip();
            axis.stiffness = stiffness;
            axis.mass.fill(T::one());
            amplitudes
        });
        plan.symbols = Some(Symbols::Axes(amplitudes));
        plan
    }

    /// A plan with the gains of all frequencies, `(ny, nz, nx)`.
    fn with_gains(shape: [usize; 3], gains: impl Iterator<Item = f64>) -> Self {
        let mut plan = Self::new(shape);
        let factor = 8.0 * shape.map(|n| n as f64).iter().product::<f64>();
        let table = gains.map(|gain| T::of(gain / factor)).collect();
        plan.symbols = Some(Symbols::Table(table));
        plan
    }

    /// Number of cells along each axis, `(nx, ny, nz)`.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Whether the walls are closed.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Solves in place: `field` holds `b` and then `χ`, `(nx, ny, nz)` in C order, in index space.
    /// `smoothing` is `σ` in cells, 0 for none. A value that is not finite spreads to all others.
    ///
    /// A second call with the same `scratch` allocates nothing that grows with the field's volume.
    ///
    /// # Errors
    /// A field of another size than the plan, or a smoothing that is negative or not finite. The field is
    /// then left as it was.
    pub fn solve(
        &self,
        field: &mut [T],
        smoothing: f64,
        scratch: &mut Scratch<T>,
    ) -> Result<(), Error> {
        let cells = self.shape.iter().map(|&n| n as u128).product::<u128>();
        if field.len() as u128 != cells {
            return Err(Error::Length {
                values: field.len(),
                shape: self.shape,
            });
        }
        if !(smoothing >= 0.0) || !smoothing.is_finite() {
            return Err(Error::Smoothing { smoothing });
        }
        if field.is_empty() {
            return Ok(());
        }
        self.prepare(smoothing, scratch);
        self.filter(field, scratch);
        Ok(())
    }

    /// Fills the amplitudes of the frequencies.
    fn prepare(&self, smoothing: f64, scratch: &mut Scratch<T>) {
        for axis in 0..3 {
            let amplitude = &mut scratch.gaussian[axis];
            match &self.symbols {
                Some(Symbols::Axes(amplitudes)) => amplitude.clone_from(&amplitudes[axis]),
                Some(Symbols::Table(_)) => amplitude.clear(),
                None => self.axes[axis].gaussian(smoothing, amplitude),
            }
        }
    }

    /// Solves in place, after [`Self::prepare`].
    fn filter(&self, field: &mut [T], scratch: &Scratch<T>) {
        self.forward_planes(field, scratch);
        self.filter_columns(field, scratch);
        self.inverse_planes(field, scratch);
    }
}
