//! One axis: its cosine transforms and its eigenvalues.
//!
//! Two real lines travel as one complex line `x` of length `n`. With `v` its Makhoul order (even places
//! first, then odd places backward), `Z = FFT(v)` and `w_k = exp(−iπk/2n)`, the cosine transforms of both
//! lines are `Y_k = w_k Z_k + w̄_k Z_{n−k} = 2 Σ_j x_j cos(πk(2j+1)/2n)`. Backwards,
//! `Z_k = w̄_k (Y_k − i Y_{n−k})` with `Y_n = 0`, and the result is `2n x`.

use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

use isograd_fourier::{Fft, num_complex::Complex};

use super::scratch::first;
use super::spectrum;
use crate::Real;

/// Tables and Fourier plans of an axis of `n` cells.
pub(super) struct Axis<T> {
    pub(super) n: usize,
    closed: bool,
    /// The places `0..n`.
    pub(super) natural: Vec<usize>,
    /// Place in Makhoul order of each place in the line.
    pub(super) makhoul: Vec<usize>,
    /// Eigenvalues of the stiffness.
    pub(super) stiffness: Vec<T>,
    /// Eigenvalues of the mass.
    pub(super) mass: Vec<T>,
    /// `w_k` for `k` in `0..=n/2`.
    twiddle: Vec<Complex<T>>,
    forward: Arc<dyn Fft<T>>,
    inverse: Arc<dyn Fft<T>>,
}

/// Gain of a line at frequency `k` of its axis:
/// `amplitude · G_k / (K_k · mass + M_k · stiffness)`.
#[derive(Clone, Copy)]
pub(super) struct Gain<T> {
    /// `G` of the other two axes, over the factor of the unnormalized transforms.
    pub(super) amplitude: T,
    /// `M M` of the other two axes.
    pub(super) mass: T,
    /// `K M + M K` of the other two axes.
    pub(super) stiffness: T,
}

impl<T: Real> Axis<T> {
    pub(super) fn new(n: usize, closed: bool) -> Self {
        let place = |j: usize| {
            if j.is_multiple_of(2) {
                j / 2
            } else {
                n - j.div_ceil(2)
            }
        };
        let twiddle = |k: usize| {
            let (sin, cos) = (0.5 * PI * k as f64 / n as f64).sin_cos();
            Complex::new(T::of(cos), T::of(-sin))
        };
        let at = |of: fn(usize, usize) -> f64| {
            let waves = (0..n).map(|k| wave(k, n, closed));
            waves.map(|k| T::of(of(k, n))).collect()
        };
        let [forward, inverse] = T::transforms(n);
        Self {
            n,
            closed,
            natural: (0..n).collect(),
            makhoul: (0..n).map(place).collect(),
            stiffness: at(spectrum::stiffness),
            mass: at(spectrum::mass),
            twiddle: (0..=n / 2).map(twiddle).collect(),
            forward,
            inverse,
        }
    }

    /// Writes `G = exp(−σ²(1 − cos θ))` at all frequencies.
    pub(super) fn gaussian(&self, sigma: f64, out: &mut Vec<T>) {
        out.clear();
        let waves = (0..self.n).map(|k| wave(k, self.n, self.closed));
        out.extend(waves.map(|k| T::of(spectrum::gaussian(k, self.n, sigma))));
    }

    /// Lines in Makhoul order → their Fourier transforms.
    #[inline(always)]
    pub(super) fn fft(&self, lines: &mut [Complex<T>], scratch: &mut Vec<Complex<T>>) {
        let scratch = first(scratch, self.forward.get_inplace_scratch_len());
        self.forward.process_with_scratch(lines, scratch);
    }

    /// The transpose of [`Self::fft`]: `n` times its inverse.
    #[inline(always)]
    pub(super) fn inverse_fft(&self, lines: &mut [Complex<T>], scratch: &mut Vec<Complex<T>>) {
        let scratch = first(scratch, self.inverse.get_inplace_scratch_len());
        self.inverse.process_with_scratch(lines, scratch);
    }

    /// Fourier transform of a line → its cosine transform.
    #[inline(always)]
    pub(super) fn to_cosine(&self, line: &mut [Complex<T>]) {
        let (constant, low, middle, high) = parts(line);
        *constant = constant.scale(T::of(2.0));
        if let Some(middle) = middle {
            *middle = middle.scale(T::of(SQRT_2));
        }
        for ((a, b), w) in low
            .iter_mut()
            .zip(high.iter_mut().rev())
            .zip(&self.twiddle[1..])
        {
            (*a, *b) = pair_to_cosine(*w, *a, *b);
        }
    }

    /// Twice the inverse of [`Self::to_cosine`].
    #[inline(always)]
    pub(super) fn to_fourier(&self, line: &mut [Complex<T>]) {
        let (_, low, middle, high) = parts(line);
        if let Some(middle) = middle {
            *middle = middle.scale(T::of(SQRT_2));
        }
        for ((a, b), w) in low
            .iter_mut()
            .zip(high.iter_mut().rev())
            .zip(&self.twiddle[1..])
        {
            (*a, *b) = pair_to_fourier(*w, *a, *b);
        }
    }

    /// [`Self::to_cosine`], the gains of the two real lines, [`Self::to_fourier`], in one go.
    #[inline(always)]
    pub(super) fn filter(&self, line: &mut [Complex<T>], gains: &mut [Complex<T>]) {
        let two = T::of(2.0);
        let (constant, low, middle, high) = parts(line);
        let (gain, low_gains, middle_gain, high_gains) = parts(gains);
        *constant = amplify(constant.scale(two), *gain);
        if let (Some(middle), Some(gain)) = (middle, middle_gain) {
            *middle = amplify(middle.scale(two), *gain);
        }
        let pairs = low.iter_mut().zip(high.iter_mut().rev());
        let gains = low_gains.iter().zip(high_gains.iter().rev());
        for (((a, b), (g, h)), w) in pairs.zip(gains).zip(&self.twiddle[1..]) {
            let (y, z) = pair_to_cosine(*w, *a, *b);
            (*a, *b) = pair_to_fourier(*w, amplify(y, *g), amplify(z, *h));
        }
    }

    /// Writes the gains of two lines at every frequency.
    #[inline(always)]
    pub(super) fn write_gains(&self, gaussian: &[T], lines: [Gain<T>; 2], out: &mut [Complex<T>]) {
        let [re, im] = lines;
        let eigenvalues = self.stiffness.iter().zip(&self.mass);
        for ((out, (&k, &m)), &g) in out.iter_mut().zip(eigenvalues).zip(gaussian) {
            *out = Complex::new(re.at(k, m, g), im.at(k, m, g));
        }
        // The constant mode of the whole field, where the gain is 0/0, is set to 0.
        if re.stiffness == T::zero() {
            out[0].re = T::zero();
        }
        if im.stiffness == T::zero() {
            out[0].im = T::zero();
        }
    }
}

/// Wave number of place `k` of a transformed line of `n`: with closed walls the sines are in reverse order.
pub(super) fn wave(k: usize, n: usize, closed: bool) -> usize {
    if closed { n - k } else { k }
}

impl<T: Real> Gain<T> {
    /// The gain at a frequency with these eigenvalues and this `G`.
    #[inline(always)]
    fn at(&self, stiffness: T, mass: T, gaussian: T) -> T {
        self.amplitude * gaussian / (stiffness * self.mass + mass * self.stiffness)
    }
}

/// Both real lines times their gains.
#[inline(always)]
fn amplify<T: Real>(y: Complex<T>, gain: Complex<T>) -> Complex<T> {
    Complex::new(y.re * gain.re, y.im * gain.im)
}

/// Place 0, the places below the middle, the middle where `n` is even, and the places above it: `k` and
/// `n − k` are partners.
#[inline(always)]
fn parts<A>(line: &mut [A]) -> (&mut A, &mut [A], Option<&mut A>, &mut [A]) {
    let pairs = (line.len() - 1) / 2;
    let (constant, rest) = line.split_at_mut(1);
    let (low, rest) = rest.split_at_mut(pairs);
    let (middle, high) = rest.split_at_mut(rest.len() - pairs);
    (&mut constant[0], low, middle.first_mut(), high)
}

/// `(Z_k, Z_{n−k}) → (Y_k, Y_{n−k})`.
#[inline(always)]
fn pair_to_cosine<T: Real>(
    w: Complex<T>,
    a: Complex<T>,
    b: Complex<T>,
) -> (Complex<T>, Complex<T>) {
    let (p, q) = (w * a, w.conj() * b);
    (p + q, times_i(p - q))
}

/// `(Y_k, Y_{n−k}) → 2 (Z_k, Z_{n−k})`.
#[inline(always)]
fn pair_to_fourier<T: Real>(
    w: Complex<T>,
    a: Complex<T>,
    b: Complex<T>,
) -> (Complex<T>, Complex<T>) {
    let b = times_i(b);
    (w.conj() * (a - b), w * (a + b))
}

#[inline(always)]
fn times_i<T: Real>(z: Complex<T>) -> Complex<T> {
    Complex::new(-z.im, z.re)
}
