//! One axis of the grid: how its lines are transformed, and the tables of that.

use std::f64::consts::PI;

use cubecl::prelude::*;

use super::lines;
use crate::device::Argument;
use crate::{Buffer, Device, Error, Scalar};

/// The largest prime factor that has a pass of its own where the chirp transform fits: the time of a pass grows with
/// its factor.
const LARGEST_FACTOR: usize = 31;

/// The lines of a field along one axis.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(super) struct Lines {
    /// Cells of a line.
    pub(super) n: usize,
    /// Distance in memory between neighbors on a line.
    pub(super) step: usize,
    /// Lines of the field.
    pub(super) count: usize,
}

impl Lines {
    pub(super) fn new(shape: [usize; 3], axis: usize) -> Self {
        Self {
            n: shape[axis],
            step: shape[axis + 1..].iter().product(),
            count: shape.iter().product::<usize>() / shape[axis],
        }
    }
}

impl<R: Runtime> Argument<R> for Lines {
    type Parameter = LinesLaunch<R>;

    fn argument(&self, _: &Device<R>) -> Self::Parameter {
        LinesLaunch::new(self.n, self.step, self.count)
    }
}

/// Where cell `j` of a line is in the field.
#[cube]
pub(super) fn cell_of_line(lines: &Lines, line: usize, j: usize) -> usize {
    (line / lines.step) * (lines.n * lines.step) + line % lines.step + j * lines.step
}

/// How an axis is transformed.
pub(super) enum Axis<T> {
    /// By Fourier transforms in shared memory.
    Fourier(Fourier<T>),
    /// By the sums that define the cosine transform.
    Sums(Sums<T>),
}

/// Tables of the Fourier transform of lines of `n` cells, by passes over `m` numbers: `m = n`, or `m ≥ 2n − 1` for the
/// chirp transform.
pub(super) struct Fourier<T> {
    /// Real and imaginary parts of `exp(−2πit/m)` for `t` in `0..m`, then of `exp(−πik/2n)` for `k` in `0..n`.
    pub(super) roots: Buffer<T>,
    /// The passes: their product is `m`.
    pub(super) radices: Buffer<u32>,
    /// For the chirp transform: real and imaginary parts of `w_j = exp(−πij²/n)` for `j` in `0..n`, then of the Fourier
    /// transform of `w̄`, over `m`.
    pub(super) chirp: Option<Buffer<T>>,
    /// `m`.
    pub(super) length: usize,
}

/// Table of the sums that define the cosine transform.
pub(super) struct Sums<T> {
    /// `2 cos(πt/2n)` for `t` in `0..4n`.
    pub(super) cosines: Buffer<T>,
}

impl<T: Scalar> Axis<T> {
    /// The fastest way for an axis of `n` cells.
    pub(super) fn new<R: Runtime>(device: &Device<R>, n: usize) -> Result<Self, Error> {
        let capacity = lines::capacity::<R, T>(device);
        let largest = radices(n).into_iter().max().unwrap_or(1);
        let padded = padded_length(n);
        if largest > LARGEST_FACTOR && padded <= capacity {
            Ok(Self::Fourier(Fourier::chirped(device, n, padded)?))
        } else if n <= capacity {
            Ok(Self::Fourier(Fourier::of_length(device, n, n, None)?))
        } else {
            Self::by_definition(device, n)
        }
    }

    /// An axis of `n` cells by sums, in `O(n²)` for a line.
    pub(super) fn by_definition<R: Runtime>(device: &Device<R>, n: usize) -> Result<Self, Error> {
        let cosine = |t: usize| T::of(2.0 * (PI * t as f64 / (2 * n) as f64).cos());
        let cosines: Vec<T> = (0..4 * n).map(cosine).collect();
        let cosines = device.upload(&cosines)?;
        Ok(Self::Sums(Sums { cosines }))
    }

    /// Lines → `Y_k = 2 Σ_j x_j cos(πk(2j+1)/2n)`; or, if `inverse`, `Y` → lines times `2n`.
    pub(super) fn transform<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        inverse: bool,
    ) {
        match self {
            Self::Fourier(fourier) => fourier.transform(device, lines, from, to, inverse),
            Self::Sums(sums) => sums.transform(device, lines, from, to, inverse),
        }
    }
}

impl<T: Scalar> Fourier<T> {
    /// By the chirp transform, a cyclic convolution of `length` numbers.
    fn chirped<R: Runtime>(device: &Device<R>, n: usize, length: usize) -> Result<Self, Error> {
        let chirp: Vec<[f64; 2]> = (0..n)
            .map(|j| {
                let (sin, cos) = (PI * (j * j % (2 * n)) as f64 / n as f64).sin_cos();
                [cos, -sin]
            })
            .collect();
        let mut kernel = vec![[0.0; 2]; length];
        for (j, &[re, im]) in chirp.iter().enumerate() {
            kernel[j] = [re, -im];
            kernel[(length - j) % length] = [re, -im];
        }
        let kernel = fourier_transform(&kernel);
        let parts = |numbers: &[[f64; 2]], scale: f64| -> Vec<T> {
            let part = |p: usize| numbers.iter().map(move |number| T::of(number[p] * scale));
            part(0).chain(part(1)).collect()
        };
        let mut table = parts(&chirp, 1.0);
        table.extend(parts(&kernel, 1.0 / length as f64));
        Self::of_length(device, n, length, Some(device.upload(&table)?))
    }

    /// By passes over lines of `n` cells, or, with a chirp, of `length` numbers.
    fn of_length<R: Runtime>(
        device: &Device<R>,
        n: usize,
        length: usize,
        chirp: Option<Buffer<T>>,
    ) -> Result<Self, Error> {
        let whole = (0..length).map(|t| 2.0 * PI * t as f64 / length as f64);
        let quarter = (0..n).map(|k| PI * k as f64 / (2 * n) as f64);
        let roots = (whole.clone().map(f64::cos))
            .chain(whole.map(|angle| -angle.sin()))
            .chain(quarter.clone().map(f64::cos))
            .chain(quarter.map(|angle| -angle.sin()));
        let radices: Vec<u32> = radices(length).iter().map(|&r| r as u32).collect();
        Ok(Self {
            roots: device.upload(&roots.map(T::of).collect::<Vec<T>>())?,
            radices: device.upload(&radices)?,
            chirp,
            length,
        })
    }
}

/// The Fourier transform of complex numbers, by its definition.
fn fourier_transform(numbers: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = numbers.len();
    let roots: Vec<(f64, f64)> = (0..n)
        .map(|t| (2.0 * PI * t as f64 / n as f64).sin_cos())
        .collect();
    let transformed = (0..n).map(|k| {
        let terms = numbers.iter().enumerate().map(|(j, &[re, im])| {
            let (sin, cos) = roots[j * k % n];
            [re * cos + im * sin, im * cos - re * sin]
        });
        terms.fold([0.0; 2], |[a, b], [re, im]| [a + re, b + im])
    });
    transformed.collect()
}

/// The least length of a chirp transform of `n` numbers that has only factors 2, 3 and 5.
fn padded_length(n: usize) -> usize {
    (2 * n.max(1) - 1..)
        .find(|&m| radices(m).iter().all(|&radix| radix <= 5))
        .expect("powers of two have no end")
}

/// Factors of `n`: fours first, then primes.
fn radices(n: usize) -> Vec<usize> {
    let mut rest = n.max(1);
    let mut radices = Vec::new();
    let mut factors = std::iter::once(4).chain(2..);
    while rest > 1 {
        let factor = factors.next().expect("no end");
        while rest.is_multiple_of(factor) {
            radices.push(factor);
            rest /= factor;
        }
    }
    radices
}
