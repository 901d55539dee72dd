//! Scratch buffers of a solve.

use isograd_fourier::num_complex::Complex;

use crate::Real;
use crate::parallel::Pool;

/// Scratch buffers reused between calls: a few lines of the grid for each thread.
#[derive(Default)]
pub struct Scratch<T> {
    /// `G` at every frequency, per axis.
    pub(super) gaussian: [Vec<T>; 3],
    lines: Pool<Lines<T>>,
}

/// The buffers of one thread.
#[derive(Default)]
pub(super) struct Lines<T> {
    /// Complex lines, one after the other; each holds two real lines of the grid.
    pub(super) lines: Vec<Complex<T>>,
    /// Gains of two real lines.
    pub(super) gains: Vec<Complex<T>>,
    /// Scratch of the Fourier transform.
    pub(super) fft: Vec<Complex<T>>,
}

impl<T: Real> Scratch<T> {
    /// Runs `f` with buffers that no other thread uses meanwhile.
    pub(super) fn with_lines(&self, f: impl FnOnce(&mut Lines<T>)) {
        self.lines.with(Lines::default, f);
    }
}

/// The first `count` places of `buffer`, which grows where it is too short.
pub(super) fn first<T: Real>(buffer: &mut Vec<Complex<T>>, count: usize) -> &mut [Complex<T>] {
    if buffer.len() < count {
        buffer.resize(count, Complex::default());
    }
    &mut buffer[..count]
}
