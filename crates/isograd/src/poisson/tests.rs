//! The oracles are plain: a stencil applied cell by cell, a dense matrix, and a cosine sum.

use std::f64::consts::PI;

use super::*;
use crate::testing::noise;

/// Random values whose sum is 0 up to rounding: a right-hand side that has a solution.
fn right_hand_side(cells: usize, seed: u64) -> Vec<f64> {
    let mut next = noise(seed);
    let b: Vec<f64> = (0..cells).map(|_| next()).collect();
    let mean = b.iter().sum::<f64>() / cells as f64;
    b.iter().map(|v| v - mean).collect()
}

/// `(side, center, side)` along one axis, with even reflection at the walls, or odd reflection at closed ones.
fn along(
    field: &[f64],
    shape: [usize; 3],
    axis: usize,
    [side, center]: [f64; 2],
    closed: bool,
) -> Vec<f64> {
    let stride: usize = shape[axis + 1..].iter().product();
    let n = shape[axis];
    let at = |i: usize| {
        let p = i / stride % n;
        let inside = |is_inside: bool, at: usize| match is_inside {
            true => field[at],
            false if closed => -field[i],
            false => field[i],
        };
        let low = inside(p > 0, i.wrapping_sub(stride));
        let high = inside(p + 1 < n, i + stride);
        side * (low + high) + center * field[i]
    };
    (0..field.len()).map(at).collect()
}

/// `A χ`, straight from the definition.
pub(super) fn apply_stencil(chi: &[f64], shape: [usize; 3], closed: bool) -> Vec<f64> {
    let mut out = vec![0.0; chi.len()];
    for stiff in 0..3 {
        let mut term = chi.to_vec();
        for axis in 0..3 {
            let weights = match axis == stiff {
                true => [-1.0, 2.0],
                false => [1.0 / 6.0, 4.0 / 6.0],
            };
            term = along(&term, shape, axis, weights, closed);
        }
        out.iter_mut().zip(term).for_each(|(o, t)| *o += t);
    }
    out
}

/// `A` as a dense matrix: it is symmetric, so columns are rows.
pub(super) fn stiffness(shape: [usize; 3], closed: bool) -> Vec<Vec<f64>> {
    let cells: usize = shape.iter().product();
    let unit = |i: usize| {
        let mut unit = vec![0.0; cells];
        unit[i] = 1.0;
        apply_stencil(&unit, shape, closed)
    };
    (0..cells).map(unit).collect()
}

fn norm(a: &[f64]) -> f64 {
    a.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    norm(&a.iter().zip(b).map(|(x, y)| x - y).collect::<Vec<_>>())
}

fn solve<T: Real>(shape: [usize; 3], b: &[f64], smoothing: f64) -> Vec<f64> {
    let mut field: Vec<T> = b.iter().map(|&v| T::of(v)).collect();
    Plan::new(shape)
        .solve(&mut field, smoothing, &mut Scratch::default())
        .expect("the sizes match");
    field.iter().map(|v| v.f64()).collect()
}

/// Backward error of a solve in `T`, measured in f64: the residual over `‖A‖‖χ‖ + ‖b‖`, `‖A‖ = 4`. Where
/// `χ` is much larger than `b`, rounding `χ` alone leaves that much.
fn backward_error<T: Real>(shape: [usize; 3], seed: u64) -> f64 {
    let b = right_hand_side(shape.iter().product(), seed);
    let chi = solve::<T>(shape, &b, 0.0);
    distance(&apply_stencil(&chi, shape, false), &b) / (4.0 * norm(&chi) + norm(&b))
}

/// Solves `matrix x = rhs` by elimination with row pivoting.
pub(crate) fn eliminate(mut matrix: Vec<Vec<f64>>, mut rhs: Vec<f64>) -> Vec<f64> {
    let n = rhs.len();
    for c in 0..n {
        let pivot = (c..n)
            .max_by(|&a, &b| matrix[a][c].abs().total_cmp(&matrix[b][c].abs()))
            .expect("a row");
        matrix.swap(c, pivot);
        rhs.swap(c, pivot);
        for r in c + 1..n {
            let factor = matrix[r][c] / matrix[c][c];
            for k in c..n {
                matrix[r][k] -= factor * matrix[c][k];
            }
            rhs[r] -= factor * rhs[c];
        }
    }
    for c in (0..n).rev() {
        let known: f64 = (c + 1..n).map(|k| matrix[c][k] * rhs[k]).sum();
        rhs[c] = (rhs[c] - known) / matrix[c][c];
    }
    rhs
}

#[test]
fn solution_is_that_of_the_dense_matrix() {
    for shape in [[5, 5, 5], [4, 5, 6], [2, 3, 7]] {
        let cells: usize = shape.iter().product();
        let mut matrix = stiffness(shape, false);
        // Adding 1 everywhere fixes the mean of χ at 0.
        matrix.iter_mut().flatten().for_each(|v| *v += 1.0);
        let b = right_hand_side(cells, 3);
        let expected = eliminate(matrix, b.clone());
        // Condition number below 1e3, so 1e-11 leaves two digits of slack.
        assert!(distance(&solve::<f64>(shape, &b, 0.0), &expected) < 1e-11 * norm(&expected));
    }
}

#[test]
fn stencil_gives_back_the_right_hand_side_for_awkward_sizes() {
    for (seed, shape) in [
        [2, 2, 2],
        [1, 1, 9],
        [3, 1, 2],
        [7, 11, 13],
        [16, 16, 16],
        [17, 6, 33],
        [31, 37, 5],
        [2, 151, 19],
        [45, 32, 64],
    ]
    .into_iter()
    .enumerate()
    {
        // 5 units of rounding, for some ten passes over the numbers.
        let (f32s, f64s) = (
            backward_error::<f32>(shape, seed as u64),
            backward_error::<f64>(shape, seed as u64),
        );
        assert!(f32s < 6e-7, "{shape:?}: {f32s:e}");
        assert!(f64s < 1e-15, "{shape:?}: {f64s:e}");
    }
}

#[test]
fn cosine_transform_is_the_plain_sum() {
    for n in [1, 2, 3, 4, 5, 8, 23, 30, 151] {
        let axis = Axis::<f64>::new(n, false);
        let mut next = noise(n as u64);
        let x: Vec<_> = (0..n).map(|_| (next(), next())).collect();
        let mut line = vec![Default::default(); n];
        for (j, &(re, im)) in x.iter().enumerate() {
            line[axis.makhoul[j]] = isograd_fourier::num_complex::Complex::new(re, im);
        }
        axis.fft(&mut line, &mut Vec::new());
        axis.to_cosine(&mut line);
        for (k, y) in line.iter().enumerate() {
            let c = |j: usize| 2.0 * (PI * (k * (2 * j + 1)) as f64 / (2 * n) as f64).cos();
            let re: f64 = x.iter().enumerate().map(|(j, v)| v.0 * c(j)).sum();
            let im: f64 = x.iter().enumerate().map(|(j, v)| v.1 * c(j)).sum();
            // The plain sum itself rounds at about n · 1e-16.
            assert!((y.re - re).abs() + (y.im - im).abs() < 1e-12, "{n} {k}");
        }
    }
}

/// A product of cosines is an eigenvector: `χ` is `b` over its eigenvalue, times the Gaussian.
#[test]
fn waves_are_scaled_by_gaussian_over_eigenvalue() {
    let (shape, wave, sigma) = ([20, 9, 14], [3, 0, 5], 1.3);
    let theta: [f64; 3] = std::array::from_fn(|a| PI * wave[a] as f64 / shape[a] as f64);
    let b: Vec<f64> = (0..shape.iter().product())
        .map(|i: usize| {
            let cell = [i / (9 * 14), i / 14 % 9, i % 14];
            (0..3)
                .map(|a| (theta[a] * (cell[a] as f64 + 0.5)).cos())
                .product()
        })
        .collect();
    let stiffness = theta.map(|t| 2.0 - 2.0 * t.cos());
    let mass = theta.map(|t| (2.0 + t.cos()) / 3.0);
    let eigenvalue: f64 = (0..3)
        .map(|a| stiffness[a] * mass[(a + 1) % 3] * mass[(a + 2) % 3])
        .sum();
    for smoothing in [0.0, sigma] {
        let gaussian: f64 = theta
            .iter()
            .map(|t| (-smoothing * smoothing * (1.0 - t.cos())).exp())
            .product();
        let expected: Vec<f64> = b.iter().map(|v| v * gaussian / eigenvalue).collect();
        // Rounding in f64, with two digits of slack.
        let error = distance(&solve::<f64>(shape, &b, smoothing), &expected);
        assert!(error < 1e-14 * norm(&expected), "{error:e}");
    }
}

#[test]
fn constant_part_of_the_right_hand_side_is_ignored() {
    let shape = [6, 10, 15];
    let b = right_hand_side(900, 8);
    let shifted: Vec<f64> = b.iter().map(|v| v + 0.7).collect();
    let (chi, other) = (
        solve::<f64>(shape, &b, 0.5),
        solve::<f64>(shape, &shifted, 0.5),
    );
    assert!(distance(&chi, &other) < 1e-13 * norm(&chi));
    assert!(chi.iter().sum::<f64>().abs() < 1e-13 * norm(&chi));
}

fn same_bits_for_any_threads<T: Real>() {
    let shape = [40, 33, 51];
    let b = right_hand_side(shape.iter().product(), 5);
    crate::testing::assert_same_bits(|| solve::<T>(shape, &b, 0.5));
}

#[test]
fn threads_do_not_change_a_bit() {
    same_bits_for_any_threads::<f32>();
    same_bits_for_any_threads::<f64>();
}

#[test]
fn second_solve_with_the_same_scratch_is_the_same() {
    let (shape, mut scratch) = ([12, 20, 9], Scratch::default());
    let plan = Plan::<f64>::new(shape);
    let b = right_hand_side(12 * 20 * 9, 4);
    let mut run = |smoothing| {
        let mut field = b.clone();
        plan.solve(&mut field, smoothing, &mut scratch)
            .expect("sizes match");
        field
    };
    let first = run(0.0);
    assert!(run(2.0) != first);
    assert!(run(0.0) == first);
}

#[test]
fn wrong_sizes_and_smoothings_are_refused_with_a_reason() {
    let mut scratch = Scratch::default();
    let mut refused = |shape, length: usize, smoothing| {
        Plan::<f32>::new(shape)
            .solve(&mut vec![1.0; length], smoothing, &mut scratch)
            .expect_err("refused")
            .to_string()
    };
    assert!(refused([3, 4, 5], 59, 0.0).contains("59 values"));
    assert!(refused([3, 4, 5], 60, -1.0).contains("-1"));
    assert!(refused([3, 4, 5], 60, f64::NAN).contains("NaN"));
    let empty = Plan::<f32>::new([0, 4, 5]).solve(&mut [], 0.0, &mut scratch);
    assert_eq!(empty, Ok(()));
}

#[test]
fn values_that_are_not_finite_do_no_harm_beyond_the_field() {
    let mut field = vec![0.0f32; 7 * 8 * 9];
    field[100] = f32::INFINITY;
    let solved = Plan::new([7, 8, 9]).solve(&mut field, 0.0, &mut Scratch::default());
    assert_eq!(solved, Ok(()));
    assert!(field.iter().any(|v| v.is_nan()));
}
