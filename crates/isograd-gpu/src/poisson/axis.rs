//! One axis of the grid: how it is transformed, and the tables of that.

use std::f64::consts::PI;

use cubecl::prelude::*;

use super::{lines, products};
use crate::{Buffer, Device, Error, Scalar};

/// The largest prime factor that is left to the transforms of lines: its pass takes a time that grows with
/// it, and products with matrices waste less.
const LARGEST_FACTOR: usize = 31;

/// The lines of a field along one axis.
#[derive(Clone, Copy)]
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

/// Where cell `j` of a line is in the field; see [`Lines`].
#[cube]
pub(super) fn cell_of_line(n: usize, step: usize, line: usize, j: usize) -> usize {
    (line / step) * (n * step) + line % step + j * step
}

/// An axis of `n` cells.
pub(super) struct Axis<T> {
    pub(super) way: Way<T>,
}

/// How an axis is transformed.
pub(super) enum Way<T> {
    Fourier(Fourier<T>),
    Products(Products<T>),
}

/// Tables of the Fourier transform of lines of `n` cells.
pub(super) struct Fourier<T> {
    /// Real and imaginary parts of `exp(−2πit/n)` for `t` in `0..n`, then of `exp(−πik/2n)`.
    pub(super) roots: Buffer<T>,
    /// The passes: their product is `n`.
    pub(super) radices: Buffer<u32>,
}

/// Table of the cosine transform as a matrix.
pub(super) struct Products<T> {
    /// `2 cos(πt/2n)` for `t` in `0..4n`.
    pub(super) cosines: Buffer<T>,
}

impl<T: Scalar> Axis<T> {
    pub(super) fn new<R: Runtime>(device: &Device<R>, n: usize) -> Result<Self, Error> {
        let radices = radices(n);
        let largest = radices.iter().max();
        if n > lines::capacity::<R, T>(device) || largest.is_some_and(|&r| r > LARGEST_FACTOR) {
            return Self::by_products(device, n);
        }
        let whole = |t: usize| 2.0 * PI * t as f64 / n as f64;
        let quarter = |k: usize| PI * k as f64 / (2 * n) as f64;
        let roots = (0..4 * n).map(|at| match (at / n, at % n) {
            (0, t) => T::of(whole(t).cos()),
            (1, t) => T::of(-whole(t).sin()),
            (2, k) => T::of(quarter(k).cos()),
            (_, k) => T::of(-quarter(k).sin()),
        });
        let radices: Vec<u32> = radices.iter().map(|&r| r as u32).collect();
        let way = Way::Fourier(Fourier {
            roots: device.upload(&roots.collect::<Vec<T>>())?,
            radices: device.upload(&radices)?,
        });
        Ok(Self { way })
    }

    pub(super) fn by_products<R: Runtime>(device: &Device<R>, n: usize) -> Result<Self, Error> {
        if n > products::LONGEST {
            return Err(Error::Axis {
                cells: n,
                limit: products::LONGEST,
            });
        }
        let cosine = |t: usize| T::of(2.0 * (PI * t as f64 / (2 * n) as f64).cos());
        let cosines: Vec<T> = (0..4 * n).map(cosine).collect();
        let way = Way::Products(Products {
            cosines: device.upload(&cosines)?,
        });
        Ok(Self { way })
    }

    /// Lines → `Y_k = 2 Σ_j x_j cos(πk(2j+1)/2n)`.
    pub(super) fn forward<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
    ) {
        match &self.way {
            Way::Fourier(fourier) => fourier.transform(device, lines, from, to, false),
            Way::Products(products) => products.forward(device, lines, from, to, None),
        }
    }

    /// `2n` times the inverse of [`Self::forward`].
    pub(super) fn inverse<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
    ) {
        match &self.way {
            Way::Fourier(fourier) => fourier.transform(device, lines, from, to, true),
            Way::Products(products) => products.inverse(device, lines, from, to),
        }
    }
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
