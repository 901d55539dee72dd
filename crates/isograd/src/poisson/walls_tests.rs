//! The solve with closed walls, beside dense sums of sines and a dense matrix.

use std::f64::consts::PI;

use super::tests::{apply_stencil, eliminate, stiffness};
use super::{Plan, Scratch, Walls, spectrum};
use crate::testing::{noise, product};
use crate::{Grid, Real};

fn solve<T: Real>(shape: [usize; 3], b: &[f64], smoothing: f64) -> Vec<f64> {
    let mut field: Vec<T> = b.iter().map(|&v| T::of(v)).collect();
    Plan::with_walls(shape, true)
        .solve(&mut field, smoothing, &mut Scratch::default())
        .expect("the sizes match");
    field.iter().map(|v| v.f64()).collect()
}

fn random(shape: [usize; 3], seed: u64) -> Vec<f64> {
    let mut next = noise(seed);
    (0..shape.iter().product()).map(|_| next()).collect()
}

/// Largest difference, relative to the largest number.
fn error(a: &[f64], b: &[f64]) -> f64 {
    let most = |it: &mut dyn Iterator<Item = f64>| it.fold(0.0, |m: f64, x| m.max(x.abs()));
    most(&mut a.iter().zip(b).map(|(x, y)| x - y)) / most(&mut b.iter().copied())
}

/// `χ = Σ_m (s_m·b / s_m·s_m) G/λ s_m` over all products of sines `s_m`.
fn by_sines(shape: [usize; 3], b: &[f64], smoothing: f64) -> Vec<f64> {
    let [nx, ny, nz] = shape;
    let cells: usize = shape.iter().product();
    let mut chi = vec![0.0; cells];
    for mode in 0..cells {
        let m = [mode / (ny * nz), mode / nz % ny, mode % nz].map(|k| k + 1);
        let sine =
            |a: usize, j: usize| (PI * m[a] as f64 * (j as f64 + 0.5) / shape[a] as f64).sin();
        let wave: Vec<f64> = (0..cells)
            .map(|c| sine(0, c / (ny * nz)) * sine(1, c / nz % ny) * sine(2, c % nz))
            .collect();
        let [x, y, z] = [0, 1, 2].map(|a| {
            let (m, n) = (m[a], [nx, ny, nz][a]);
            (
                spectrum::stiffness(m, n),
                spectrum::mass(m, n),
                spectrum::gaussian(m, n, smoothing),
            )
        });
        let eigenvalue = x.0 * y.1 * z.1 + x.1 * y.0 * z.1 + x.1 * y.1 * z.0;
        let factor = x.2 * y.2 * z.2 / eigenvalue * product(&wave, b) / product(&wave, &wave);
        chi.iter_mut()
            .zip(&wave)
            .for_each(|(c, w)| *c += factor * w);
    }
    chi
}

#[test]
fn closed_solution_is_the_dense_sum_of_sines() {
    for (seed, shape) in [[5, 4, 6], [1, 7, 2], [3, 3, 3], [8, 1, 9]]
        .into_iter()
        .enumerate()
    {
        let b = random(shape, seed as u64);
        for smoothing in [0.0, 1.3] {
            let expected = by_sines(shape, &b, smoothing);
            // Rounding, with two digits of slack.
            assert!(
                error(&solve::<f64>(shape, &b, smoothing), &expected) < 1e-13,
                "{shape:?}"
            );
            assert!(
                error(&solve::<f32>(shape, &b, smoothing), &expected) < 1e-5,
                "{shape:?}"
            );
        }
    }
}

#[test]
fn closed_solution_is_that_of_the_dense_matrix_with_odd_reflection() {
    let shape = [4, 5, 3];
    let b = random(shape, 9);
    let expected = eliminate(stiffness(shape, true), b.clone());
    assert!(error(&solve::<f64>(shape, &b, 0.0), &expected) < 1e-12);
}

#[test]
fn closed_stencil_gives_back_the_right_hand_side_for_awkward_sizes() {
    for (seed, shape) in [[31, 37, 5], [2, 151, 19], [45, 32, 64]]
        .into_iter()
        .enumerate()
    {
        let b = random(shape, seed as u64);
        let found = apply_stencil(&solve::<f64>(shape, &b, 0.0), shape, true);
        // χ is up to a thousand times as large as b.
        assert!(error(&found, &b) < 1e-11, "{shape:?}");
    }
}

#[test]
fn closed_solve_is_its_own_transpose() {
    let shape = [9, 14, 11];
    let (x, y) = (random(shape, 1), random(shape, 2));
    let [a, b] = [
        product(&solve::<f64>(shape, &x, 0.8), &y),
        product(&x, &solve::<f64>(shape, &y, 0.8)),
    ];
    assert!((a - b).abs() < 1e-12 * a.abs(), "{a} {b}");
}

#[test]
fn threads_do_not_change_a_bit_of_a_closed_solve() {
    let shape = [40, 33, 51];
    let b = random(shape, 5);
    crate::testing::assert_same_bits(|| solve::<f32>(shape, &b, 0.5));
}

#[test]
fn automatic_walls_are_free_where_a_sample_reaches_one() {
    let grid = Grid::<f64>::new([0.0; 3], 0.5, [20, 30, 40]).expect("valid");
    let middle = [5.0, 7.5, 10.0];
    for (p, closed) in [
        ([1.75, 7.5, 10.0], true),
        ([1.74, 7.5, 10.0], false),
        ([5.0, 7.5, 18.25], true),
        ([5.0, 7.5, 18.26], false),
    ] {
        assert_eq!(Walls::Auto.are_closed(&[middle, p], &grid), closed, "{p:?}");
        assert!(Walls::Closed.are_closed(&[p], &grid) && !Walls::Free.are_closed(&[p], &grid));
    }
}
