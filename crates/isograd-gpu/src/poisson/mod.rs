//! The Poisson equation, solved directly by cosine transforms: [`isograd::poisson`] on a device.
//!
//! # Map
//! `b → χ = IDCT(G/λ · DCT(b))`, one value per cell of a grid of `(nx, ny, nz)` cells in C order, in index
//! space (cell size 1, no unit), with even reflection at the walls; `λ` and the smoothing `G` by `σ` cells are
//! those of [`isograd::poisson::spectrum`], and the constant mode is set to 0. A value that is not finite
//! spreads to all others.
//!
//! Each axis is transformed in shared memory, two lines as one complex line, in `O(n log n)` (J. Makhoul, *A fast
//! cosine transform in one and two dimensions*, IEEE Trans. ASSP 28, 1980). A length with a large prime factor takes
//! the chirp transform (L. Bluestein, *A linear filtering approach to the computation of discrete Fourier transform*,
//! IEEE Trans. AU 18, 1970) or, from half the shared memory on, a pass in `O(n²)`. A line that does not fit in shared
//! memory is transformed by plain sums. The last axis to be transformed is the first to be transformed back, and `G/λ`
//! is applied between: in the same kernel, if a line fits. Besides `b`, two fields are in memory.
//!
//! # Residual
//! `σ` and `χ`. `b̄` needs the first, `σ̄` both.
//!
//! # Pullback
//! The operator is symmetric: `b̄ = IDCT(G/λ · DCT(χ̄))`, [`Solver::solve`] again. With `L` the sum of second
//! differences, `σ̄ = σ χ·Lχ̄`: [`smoothing::pullback`].
//!
//! # Not differentiable
//! Nothing: the map is linear in `b`.

mod axis;
mod gain;
mod lines;
pub mod screened;
pub mod smoothing;
mod sums;

use cubecl::prelude::Runtime;
use isograd::poisson::spectrum;

use crate::device::check_length;
use crate::{Buffer, Device, Error, Scalar};
use axis::{Axis, Lines};
use gain::Gains;

/// Plan of the Poisson equation of a grid: tables on the device that do not depend on the right-hand side.
pub struct Solver<T> {
    shape: [usize; 3],
    /// Shape of the field with axes of one cell moved from the front to the end: the first one, where the gains
    /// are applied, has more if any has.
    turned: [usize; 3],
    /// The first axis and others of more than one cell, of `turned`, in the order of the transforms back.
    axes: Vec<(usize, Axis<T>)>,
    /// Eigenvalues of the stiffness along the axes of `turned`, then those of the mass.
    spectrum: Buffer<T>,
}

impl<T: Scalar> Solver<T> {
    /// For grids of `(nx, ny, nz)` cells, of any size, primes included.
    ///
    /// # Errors
    /// [`Error::NoNumber`] if the device doesn't calculate in `T`, or [`Error::TooLarge`] for tables that it cannot
    /// hold.
    pub fn new<R: Runtime>(device: &Device<R>, shape: [usize; 3]) -> Result<Self, Error> {
        Self::of_axes(device, shape, Axis::new)
    }

    /// Like [`Self::new`], with the sums that define the transforms, `O(n⁴)` for `n³` cells: an oracle.
    pub fn by_definition<R: Runtime>(device: &Device<R>, shape: [usize; 3]) -> Result<Self, Error> {
        Self::of_axes(device, shape, Axis::by_definition)
    }

    fn of_axes<R: Runtime>(
        device: &Device<R>,
        shape: [usize; 3],
        axis: impl Fn(&Device<R>, usize) -> Result<Axis<T>, Error>,
    ) -> Result<Self, Error> {
        device.check_number::<T>()?;
        let mut turned = shape;
        for _ in 0..2 {
            if turned[0] == 1 {
                turned.rotate_left(1);
            }
        }
        let mut axes = vec![(0, axis(device, turned[0])?)];
        for a in 1..3 {
            if turned[a] > 1 {
                axes.push((a, axis(device, turned[a])?));
            }
        }
        let along = |of: fn(usize, usize) -> f64| {
            let lengths = turned.into_iter();
            lengths.flat_map(move |n| (0..n).map(move |k| T::of(of(k, n))))
        };
        let eigenvalues: Vec<T> = along(spectrum::stiffness)
            .chain(along(spectrum::mass))
            .collect();
        Ok(Self {
            shape,
            turned,
            axes,
            spectrum: device.upload(&eigenvalues)?,
        })
    }

    /// Number of cells along each axis, `(nx, ny, nz)`.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// `χ` for the right-hand side `b`, smoothed by `smoothing` cells (0 for none). Its own transpose.
    ///
    /// # Errors
    /// A field of another size than the solver's ([`Error::Length`]), a smoothing that is negative or not finite
    /// ([`Error::Smoothing`]), or a device without the memory ([`Error::TooLarge`]).
    pub fn solve<R: Runtime>(
        &self,
        device: &Device<R>,
        b: &Buffer<T>,
        smoothing: f64,
    ) -> Result<Buffer<T>, Error> {
        check_length("the right-hand side", b, self.shape.iter().product())?;
        if !(smoothing >= 0.0) || !smoothing.is_finite() {
            return Err(Error::Smoothing { smoothing });
        }
        if b.is_empty() {
            return Ok(b.clone());
        }
        let gains = self.gains(device, smoothing)?;
        let mut fields = Fields::new(b);
        let lines = |a: &usize| Lines::new(self.turned, *a);
        let transform = |(a, axis): &(usize, Axis<T>), fields: &mut Fields<T>, inverse| {
            let kernel = |from: &_, to: &_| axis.transform(device, lines(a), from, to, inverse);
            fields.step(device, kernel)
        };
        let (first, others) = self.axes.split_first().expect("an axis");
        for axis in others.iter().rev() {
            transform(axis, &mut fields, false)?;
        }
        if let (a, Axis::Fourier(fourier)) = first {
            let kernel = |from: &_, to: &_| fourier.filter(device, lines(a), from, to, &gains);
            fields.step(device, kernel)?;
        } else {
            transform(first, &mut fields, false)?;
            fields.step(device, |from, to| sums::filter(device, from, to, &gains))?;
            transform(first, &mut fields, true)?;
        }
        for axis in others {
            transform(axis, &mut fields, true)?;
        }
        Ok(fields.last)
    }

    /// `G/λ`, over the factor that the transforms leave.
    fn gains<R: Runtime>(&self, device: &Device<R>, smoothing: f64) -> Result<Gains<'_, T>, Error> {
        let lengths = self.axes.iter().map(|(a, _)| self.turned[*a]);
        let factor: f64 = lengths.map(|n| 2.0 * n as f64).product();
        let mut gaussian = Vec::new();
        for (a, &n) in self.turned.iter().enumerate() {
            let amplitude = if a == 0 { 1.0 / factor } else { 1.0 };
            gaussian.extend((0..n).map(|k| T::of(amplitude * spectrum::gaussian(k, n, smoothing))));
        }
        Ok(Gains {
            shape: self.turned,
            spectrum: &self.spectrum,
            gaussian: device.upload(&gaussian)?,
        })
    }
}

/// Fields of a solve: the output of the last kernel, and a buffer for the next.
struct Fields<T> {
    last: Buffer<T>,
    /// Whether `last` is the caller's input, which is not written to.
    given: bool,
    spare: Option<Buffer<T>>,
}

impl<T: Scalar> Fields<T> {
    fn new(given: &Buffer<T>) -> Self {
        Self {
            last: given.clone(),
            given: true,
            spare: None,
        }
    }

    /// Runs a kernel from the last field to another.
    fn step<R: Runtime>(
        &mut self,
        device: &Device<R>,
        kernel: impl FnOnce(&Buffer<T>, &Buffer<T>),
    ) -> Result<(), Error> {
        let to = match self.spare.take() {
            Some(spare) => spare,
            None => device.empty(self.last.len())?,
        };
        kernel(&self.last, &to);
        let from = std::mem::replace(&mut self.last, to);
        if !std::mem::take(&mut self.given) {
            self.spare = Some(from);
        }
        Ok(())
    }
}
