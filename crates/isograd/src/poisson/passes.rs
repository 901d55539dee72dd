//! The three passes over memory: planes forward, lines across the planes, planes backward.

use isograd_fourier::num_complex::Complex;

use super::axis::{Axis, Gain};
use super::scratch::{Lines, Scratch, first};
use super::{Plan, Symbols};
use crate::{Real, parallel, simd};

/// Complex lines handled together where a line's places are far apart in memory: neighboring lines
/// share cache lines.
const BLOCK: usize = 16;

/// Columns in one task of the pass across the planes.
const COLUMNS: usize = 512;

impl<T: Real> Plan<T> {
    /// Cosine transforms along z, then y, plane by plane.
    pub(super) fn forward_planes(&self, field: &mut [T], scratch: &Scratch<T>) {
        let [_, y, z] = &self.axes;
        parallel::each(field.chunks_mut(y.n * z.n), |i, plane| {
            scratch.with_lines(|buffers| {
                simd::vectorized!(self.arch, {
                    if self.closed {
                        alternate(plane, z.n, i);
                    }
                    forward_rows(z, plane, buffers);
                    forward_columns(y, &mut rows_of(plane, z.n), buffers);
                });
            });
        });
    }

    /// The inverse of [`Self::forward_planes`], times `4 n_y n_z`.
    pub(super) fn inverse_planes(&self, field: &mut [T], scratch: &Scratch<T>) {
        let [_, y, z] = &self.axes;
        parallel::each(field.chunks_mut(y.n * z.n), |i, plane| {
            scratch.with_lines(|buffers| {
                simd::vectorized!(self.arch, {
                    inverse_columns(y, &mut rows_of(plane, z.n), buffers);
                    inverse_rows(z, plane, buffers);
                    if self.closed {
                        alternate(plane, z.n, i);
                    }
                });
            });
        });
    }

    /// Along x: cosine transform, gains, inverse transform.
    pub(super) fn filter_columns(&self, field: &mut [T], scratch: &Scratch<T>) {
        let [nx, ny, nz] = self.shape;
        let mut tasks: Vec<Vec<&mut [T]>> = (0..(ny * nz).div_ceil(COLUMNS))
            .map(|_| Vec::with_capacity(nx))
            .collect();
        for plane in field.chunks_mut(ny * nz) {
            for (task, part) in tasks.iter_mut().zip(plane.chunks_mut(COLUMNS)) {
                task.push(part);
            }
        }
        parallel::each(&mut tasks, |task, rows| {
            scratch.with_lines(|buffers| {
                simd::vectorized!(
                    self.arch,
                    self.filter_task(task * COLUMNS, rows, scratch, buffers)
                );
            });
        });
    }

    #[inline(always)]
    fn filter_task(
        &self,
        column: usize,
        rows: &mut [&mut [T]],
        scratch: &Scratch<T>,
        buffers: &mut Lines<T>,
    ) {
        let axis = &self.axes[0];
        let gains = first(&mut buffers.gains, axis.n);
        for start in (0..rows[0].len()).step_by(2 * BLOCK) {
            let width = (rows[0].len() - start).min(2 * BLOCK);
            let lines = first(&mut buffers.lines, width.div_ceil(2) * axis.n);
            gather(rows, start, lines, &axis.makhoul);
            axis.fft(lines, &mut buffers.fft);
            for (m, line) in lines.chunks_exact_mut(axis.n).enumerate() {
                let c = column + start + 2 * m;
                match &self.symbols {
                    Some(Symbols::Table(table)) => {
                        let (a, b) = table[c * axis.n..].split_at(axis.n);
                        pack(a, b, gains, &axis.natural);
                    }
                    _ => {
                        let pair = [self.gain(c, scratch), self.gain(c + 1, scratch)];
                        axis.write_gains(&scratch.gaussian[0], pair, gains);
                    }
                }
                axis.filter(line, gains);
            }
            axis.inverse_fft(lines, &mut buffers.fft);
            scatter(rows, start, lines, &axis.makhoul);
        }
    }

    /// The gain of the line along x through column `c = j n_z + k`. The imaginary half of the last complex
    /// line may have no column: it holds zeros, and any gain will do.
    #[inline(always)]
    fn gain(&self, c: usize, scratch: &Scratch<T>) -> Gain<T> {
        let [nx, ny, nz] = self.shape;
        let (j, k) = (c / nz % ny, c % nz);
        let [_, y, z] = &self.axes;
        let factor = 8.0 * nx as f64 * ny as f64 * nz as f64;
        Gain {
            amplitude: scratch.gaussian[1][j] * scratch.gaussian[2][k] / T::of(factor),
            mass: y.mass[j] * z.mass[k],
            stiffness: y.stiffness[j] * z.mass[k] + y.mass[j] * z.stiffness[k],
        }
    }
}

fn rows_of<T>(plane: &mut [T], length: usize) -> Vec<&mut [T]> {
    plane.chunks_mut(length).collect()
}

/// Multiplies the value at `(j, k)` of plane `i` by `(−1)^{i+j+k}`.
#[inline(always)]
fn alternate<T: Real>(plane: &mut [T], length: usize, i: usize) {
    for (j, row) in plane.chunks_mut(length).enumerate() {
        for value in row.iter_mut().skip((i + j + 1) % 2).step_by(2) {
            *value = -*value;
        }
    }
}

/// Cosine transform of the rows of a plane, two at a time.
#[inline(always)]
fn forward_rows<T: Real>(axis: &Axis<T>, plane: &mut [T], buffers: &mut Lines<T>) {
    let line = first(&mut buffers.lines, axis.n);
    for rows in plane.chunks_mut(2 * axis.n) {
        let (a, b) = rows.split_at_mut(axis.n);
        pack(a, b, line, &axis.makhoul);
        axis.fft(line, &mut buffers.fft);
        axis.to_cosine(line);
        unpack(a, b, line, &axis.natural);
    }
}

/// The inverse of [`forward_rows`], times `2n`.
#[inline(always)]
fn inverse_rows<T: Real>(axis: &Axis<T>, plane: &mut [T], buffers: &mut Lines<T>) {
    let line = first(&mut buffers.lines, axis.n);
    for rows in plane.chunks_mut(2 * axis.n) {
        let (a, b) = rows.split_at_mut(axis.n);
        pack(a, b, line, &axis.natural);
        axis.to_fourier(line);
        axis.inverse_fft(line, &mut buffers.fft);
        unpack(a, b, line, &axis.makhoul);
    }
}

/// Cosine transform of the columns of `rows`, one row for each place of the axis.
#[inline(always)]
fn forward_columns<T: Real>(axis: &Axis<T>, rows: &mut [&mut [T]], buffers: &mut Lines<T>) {
    for start in (0..rows[0].len()).step_by(2 * BLOCK) {
        let width = (rows[0].len() - start).min(2 * BLOCK);
        let lines = first(&mut buffers.lines, width.div_ceil(2) * axis.n);
        gather(rows, start, lines, &axis.makhoul);
        axis.fft(lines, &mut buffers.fft);
        for line in lines.chunks_exact_mut(axis.n) {
            axis.to_cosine(line);
        }
        scatter(rows, start, lines, &axis.natural);
    }
}

/// The inverse of [`forward_columns`], times `2n`.
#[inline(always)]
fn inverse_columns<T: Real>(axis: &Axis<T>, rows: &mut [&mut [T]], buffers: &mut Lines<T>) {
    for start in (0..rows[0].len()).step_by(2 * BLOCK) {
        let width = (rows[0].len() - start).min(2 * BLOCK);
        let lines = first(&mut buffers.lines, width.div_ceil(2) * axis.n);
        gather(rows, start, lines, &axis.natural);
        for line in lines.chunks_exact_mut(axis.n) {
            axis.to_fourier(line);
        }
        axis.inverse_fft(lines, &mut buffers.fft);
        scatter(rows, start, lines, &axis.makhoul);
    }
}

/// Two rows → one complex line, place `j` to place `places[j]`. An absent row `b` counts as zeros.
#[inline(always)]
fn pack<T: Real>(a: &[T], b: &[T], line: &mut [Complex<T>], places: &[usize]) {
    for (j, (&re, &place)) in a.iter().zip(places).enumerate() {
        let im = b.get(j).copied().unwrap_or(T::zero());
        line[place] = Complex::new(re, im);
    }
}

/// The inverse of [`pack`].
#[inline(always)]
fn unpack<T: Real>(a: &mut [T], b: &mut [T], line: &[Complex<T>], places: &[usize]) {
    for (re, &place) in a.iter_mut().zip(places) {
        *re = line[place].re;
    }
    for (im, &place) in b.iter_mut().zip(places) {
        *im = line[place].im;
    }
}

/// Columns from `start` on → complex lines, two columns each, as many as `lines` holds. An absent last
/// column counts as zeros.
#[inline(always)]
fn gather<T: Real>(rows: &[&mut [T]], start: usize, lines: &mut [Complex<T>], places: &[usize]) {
    let n = rows.len();
    let count = lines.len() / n;
    for (row, &place) in rows.iter().zip(places) {
        let (pairs, rest) = row[start..row.len().min(start + 2 * count)].as_chunks::<2>();
        let to = &mut lines[place..];
        for (to, &[re, im]) in to.iter_mut().step_by(n).zip(pairs) {
            *to = Complex::new(re, im);
        }
        if let [re] = rest {
            to[pairs.len() * n] = Complex::new(*re, T::zero());
        }
    }
}

/// The inverse of [`gather`].
#[inline(always)]
fn scatter<T: Real>(rows: &mut [&mut [T]], start: usize, lines: &[Complex<T>], places: &[usize]) {
    let n = rows.len();
    let count = lines.len() / n;
    for (row, &place) in rows.iter_mut().zip(places) {
        let end = row.len().min(start + 2 * count);
        let (pairs, rest) = row[start..end].as_chunks_mut::<2>();
        let from = &lines[place..];
        for (&from, to) in from.iter().step_by(n).zip(pairs.iter_mut()) {
            *to = [from.re, from.im];
        }
        if let [re] = rest {
            *re = from[pairs.len() * n].re;
        }
    }
}
