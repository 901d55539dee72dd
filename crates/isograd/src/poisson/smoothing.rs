//! Width of the smoothing of the indicator, and its pullback.

use pulp::Arch;

use super::Plan;
use crate::data::blocks::{BlockField, Blocks, NODES};
use crate::{Real, parallel, simd};

/// Cells of smoothing for each cell of distance between samples. Errors of the vertices of a torus, in cells, mean
/// and maximum, with the local iso-value:
///
/// | samples apart | no smoothing | 0.8 of that | 1.2 of that |
/// |---|---|---|---|
/// | 0.31 cells | 0.0099, 0.037 | 0.0095, 0.036 | 0.0091, 0.034 |
/// | 0.63 cells | 0.0085, 0.049 | 0.0066, 0.037 | 0.0054, 0.029 |
/// | 1.25 cells | 0.0135, 0.108 | 0.0049, 0.053 | 0.0032, 0.056 |
///
/// More would smooth thin parts away where noise keeps the iso-value from following the samples.
const PER_SPACING: f64 = 0.8;

/// Cells handled together by [`laplacian_dot`].
const CELLS: usize = 64;

/// Width `σ` of the Gaussian that the indicator is smoothed with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// 0.8 of the typical distance between samples, which removes ripples between them, and is differentiated. Where samples
    /// count by their areas, that distance is the root of the mean area.
    #[default]
    Auto,
    /// This many cells; 0 for none.
    Cells(f64),
}

impl Smoothing {
    /// `σ` in cells, for samples that are `spacing` cells apart.
    pub fn cells(self, spacing: f64) -> f64 {
        match self {
            Self::Auto if spacing.is_finite() => PER_SPACING * spacing,
            Self::Auto => 0.0,
            Self::Cells(cells) => cells,
        }
    }

    /// Whether the width is finite and not negative.
    pub fn is_valid(self) -> bool {
        match self {
            Self::Auto => true,
            Self::Cells(cells) => cells >= 0.0 && cells.is_finite(),
        }
    }
}

/// `σ χ·Lχ̄`, which is `σ̄` for cotangents `chi_bar` of `chi`, both on the grid of `plan` and `L` the sum of second
/// differences along the axes. The same bits for any number of threads.
pub fn pullback<T: Real>(plan: &Plan<T>, smoothing: f64, chi: &[T], chi_bar: &[T]) -> f64 {
    let [_, ny, nz] = plan.shape;
    let plane = |i: usize, plane: &[T]| -> f64 {
        let rows = plane.chunks_exact(nz).enumerate();
        rows.map(|(j, row)| laplacian_dot(plan, chi_bar, (i * ny + j) * nz, row))
            .sum()
    };
    let planes = parallel::map_each(chi.chunks_exact(ny * nz), plane);
    smoothing * planes.iter().sum::<f64>()
}

/// Like [`pullback`], for fields in blocks. An absent neighbor counts as equal.
pub(crate) fn pullback_in_blocks<T: Real>(
    smoothing: f64,
    chi: &BlockField<T>,
    chi_bar: &BlockField<T>,
) -> f64 {
    let shape = chi.grid.shape();
    let of_cell = |cell: [usize; 3], bar: T| {
        let own = chi.get(cell).unwrap_or(T::zero());
        let mut sum = T::zero();
        for a in 0..3 {
            for step in [0, 2] {
                let mut next = cell;
                next[a] = (cell[a] + step).saturating_sub(1).min(shape[a] - 1);
                sum += chi.get(next).unwrap_or(own) - own;
            }
        }
        (sum * bar).f64()
    };
    let of_block = |block: usize, bars: &[T]| -> f64 {
        let corner = chi_bar.blocks.corner(block);
        let bars = bars
            .iter()
            .enumerate()
            .filter(|(_, bar)| **bar != T::zero());
        let terms = bars.map(|(n, &bar)| {
            let node = Blocks::cell_of(n);
            of_cell(std::array::from_fn(|a| corner[a] + node[a]), bar)
        });
        terms.sum()
    };
    let blocks = parallel::map_each(chi_bar.values.chunks_exact(NODES), of_block);
    smoothing * blocks.iter().sum::<f64>()
}

/// `Σ_k part_k (Lv)_k` over cells along z from place `start` in memory on.
pub(crate) fn laplacian_dot<T: Real>(
    plan: &Plan<T>,
    values: &[T],
    start: usize,
    part: &[T],
) -> f64 {
    let mut sum = 0.0;
    simd::vectorized!(Arch::new(), {
        let mut room = [T::zero(); CELLS];
        for (n, part) in part.chunks(CELLS).enumerate() {
            let differences = &mut room[..part.len()];
            laplacian(values, plan.shape, start + n * CELLS, differences);
            if plan.closed {
                reflect_oddly(values, plan.shape, start + n * CELLS, differences);
            }
            let products = differences.iter().zip(part);
            sum += products.map(|(l, p)| (*l * *p).f64()).sum::<f64>();
        }
    });
    sum
}

/// Second differences, summed, of cells along z from place `start` in memory on; even reflection at the walls.
#[inline(always)]
fn laplacian<T: Real>(values: &[T], [nx, ny, nz]: [usize; 3], start: usize, out: &mut [T]) {
    let (i, j, first) = (start / (ny * nz), start / nz % ny, start % nz);
    let count = out.len();
    let row = |i: usize, j: usize| {
        let start = (i * ny + j) * nz + first;
        &values[start..start + count]
    };
    let [a, b, c, d] = [
        row(i.saturating_sub(1), j),
        row((i + 1).min(nx - 1), j),
        row(i, j.saturating_sub(1)),
        row(i, (j + 1).min(ny - 1)),
    ];
    let (here, four) = (row(i, j), T::of(4.0));
    for k in 0..count {
        out[k] = a[k] + b[k] + (c[k] + d[k]) - four * here[k];
    }
    let line = &values[start - first..start - first + nz];
    for k in first.max(1)..first + count {
        out[k - first] += line[k - 1] - line[k];
    }
    for k in first..(first + count).min(nz - 1) {
        out[k - first] += line[k + 1] - line[k];
    }
}

/// Turns second differences with even reflection at the walls into those with odd reflection.
#[inline(always)]
fn reflect_oddly<T: Real>(values: &[T], [nx, ny, nz]: [usize; 3], start: usize, out: &mut [T]) {
    let (i, j, first) = (start / (ny * nz), start / nz % ny, start % nz);
    let walls = [i == 0, i + 1 == nx, j == 0, j + 1 == ny];
    let walls = walls.into_iter().filter(|&wall| wall).count();
    for (k, out) in (first..).zip(out) {
        let walls = walls + usize::from(k == 0) + usize::from(k + 1 == nz);
        *out -= T::of_usize(2 * walls) * values[start - first + k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::tests::Random;
    use crate::poisson::{Plan, Scratch};

    #[test]
    fn pullback_is_the_derivative_of_a_solve_in_its_smoothing() {
        let shape = [9, 1, 7];
        let mut random = Random::new(5);
        let mut numbers = || {
            (0..63)
                .map(|_| random.uniform() - 0.5)
                .collect::<Vec<f64>>()
        };
        let (b, chi_bar) = (numbers(), numbers());
        for closed in [false, true] {
            let plan = Plan::with_walls(shape, closed);
            let solve = |smoothing: f64| {
                let mut chi = b.clone();
                let solved = plan.solve(&mut chi, smoothing, &mut Scratch::default());
                solved.expect("sizes match");
                chi
            };
            let value = |smoothing| {
                let products = solve(smoothing);
                products
                    .iter()
                    .zip(&chi_bar)
                    .map(|(c, b)| c * b)
                    .sum::<f64>()
            };
            let (sigma, step) = (0.7, 1e-5);
            let difference = (value(sigma + step) - value(sigma - step)) / (2.0 * step);
            let pulled = pullback(&plan, sigma, &solve(sigma), &chi_bar);
            assert!(
                (pulled / difference - 1.0).abs() < 1e-8,
                "{pulled} {difference}"
            );
        }
    }

    #[test]
    fn parts_of_rows_have_the_differences_of_the_rows() {
        let shape = [3, 4, 11];
        let mut random = Random::new(6);
        let values: Vec<f64> = (0..132).map(|_| random.uniform()).collect();
        for plan in [Plan::new(shape), Plan::with_walls(shape, true)] {
            let one = |at: usize| laplacian_dot(&plan, &values, at, &[1.0]);
            for row in [0, 11 * 5, 11 * 11] {
                for (first, count) in [(0, 11), (0, 4), (3, 5), (7, 4)] {
                    let part: Vec<f64> = (0..count).map(|k| k as f64 - 1.7).collect();
                    let start = row + first;
                    let sum = laplacian_dot(&plan, &values, start, &part);
                    let plain = (0..count).map(|k| part[k] * one(start + k)).sum::<f64>();
                    assert!((sum - plain).abs() < 1e-13);
                }
            }
        }
    }
}
