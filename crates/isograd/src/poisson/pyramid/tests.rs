//! The dense solve is the oracle.

use std::sync::Arc;

use super::{Octaves, Pyramid};
use crate::data::blocks::{Blocks, Marks};
use crate::neighbors::tests::Random;
use crate::poisson::{Plan, Scratch};
use crate::{Field, Grid, Real, splat};

/// Samples of an ellipsoid of half-axes `axes`, in cells, around the center of a grid, and their right-hand side.
fn ellipsoid<T: Real>(cells: usize, axes: [f64; 3], count: usize) -> (Vec<[T; 3]>, Field<T>) {
    let mut random = Random::new(7);
    let (mut points, mut normals, mut areas) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..count {
        let z = 2.0 * random.uniform() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * random.uniform()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let u = [r * cos, r * sin, z];
        let normal: [f64; 3] = std::array::from_fn(|a| u[a] / axes[a]);
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let stretch = axes.iter().product::<f64>() * length;
        areas.push(T::of(4.0 * std::f64::consts::PI * stretch / count as f64));
        normals.push(normal.map(|n| T::of(n / length)));
        points.push(std::array::from_fn(|a| {
            T::of(0.5 * cells as f64 + 0.3 * a as f64 + axes[a] * u[a])
        }));
    }
    let grid = Grid::new([T::zero(); 3], T::one(), [cells; 3]).expect("a grid");
    let mut b = Field::zeros(grid);
    let samples = splat::Samples {
        points: &points,
        normals: &normals,
        areas: &areas,
    };
    let (scratch, residual) = (
        &mut splat::Scratch::default(),
        &mut splat::Residual::default(),
    );
    splat::forward(samples, splat::Weights::BSpline, scratch, residual, &mut b).expect("inside");
    (points, b)
}

fn near_samples<T: Real>(points: &[[T; 3]], cells: usize) -> Arc<Blocks> {
    let mut marks = Marks::new([cells; 3]);
    for point in points {
        let cell = point.map(|x| x.f64() as isize);
        marks.mark(cell.map(|c| c - 5), cell.map(|c| c + 5));
    }
    Arc::new(marks.build())
}

/// Largest and rms difference from the dense solution in the blocks.
fn errors<T: Real>(
    [cells, octaves]: [usize; 2],
    closed: bool,
    smoothing: f64,
    axes: [f64; 3],
) -> [f64; 3] {
    let (points, mut b) = ellipsoid::<T>(cells, axes, 40 * cells * cells / 48);
    let sets = Octaves::new(near_samples(&points, cells), octaves);
    let blocks = &sets.0[0];
    let mut values = vec![T::zero(); blocks.nodes()];
    blocks.read_dense(b.values(), &mut values);
    let mut pyramid = Pyramid::new([cells; 3], octaves, closed, smoothing);
    pyramid.solve(&sets, &mut values).expect("sizes match");
    let plan = Plan::<T>::with_walls([cells; 3], closed);
    plan.solve(b.values_mut(), smoothing, &mut Scratch::default())
        .expect("sizes match");
    let mut dense = vec![T::zero(); blocks.nodes()];
    blocks.read_dense(b.values(), &mut dense);
    let differences = values.iter().zip(&dense).map(|(a, b)| (*a - *b).f64());
    let (worst, squares) = differences.fold((0.0, 0.0), |(m, s): (f64, f64), d| {
        (m.max(d.abs()), s + d * d)
    });
    let share = blocks.nodes() as f64 / (cells * cells * cells) as f64;
    [worst, (squares / dense.len() as f64).sqrt(), share]
}

#[test]
fn solution_near_the_samples_is_that_of_the_dense_solve() {
    for (cells, octaves, closed) in [
        (96, 1, false),
        (96, 2, false),
        (96, 2, true),
        (192, 2, false),
    ] {
        let size = cells as f64;
        for axes in [[0.33, 0.3, 0.25], [0.4, 0.2, 0.008]] {
            for smoothing in [0.0, 0.8, 2.0] {
                let axes = axes.map(|a| a * size);
                let found = errors::<f64>([cells, octaves], closed, smoothing, axes);
                println!("{cells} {octaves} {closed} {axes:?} {smoothing}: {found:?}");
                // The jump is 1. Cut at the halo, 4 widths off, and images of the splines.
                assert!(found[0] < 1e-4, "{found:?}");
            }
        }
    }
    let found = errors::<f32>([96, 1], false, 0.8, [30.0, 25.0, 20.0]);
    println!("f32: {found:?}");
    assert!(found[0] < 1e-4, "{found:?}");
}

#[test]
fn map_is_its_own_transpose() {
    let cells = 96;
    let (points, _) = ellipsoid::<f64>(cells, [40.0, 43.0, 9.0], 2000);
    let sets = Octaves::new(near_samples(&points, cells), 2);
    for closed in [false, true] {
        map_is_symmetric(&sets, &mut Pyramid::new([cells; 3], 2, closed, 0.7));
    }
}

fn map_is_symmetric(sets: &Octaves, pyramid: &mut Pyramid<f64>) {
    let mut random = Random::new(11);
    let mut numbers = || -> Vec<f64> {
        let count = sets.0[0].nodes();
        (0..count).map(|_| random.uniform() - 0.5).collect()
    };
    let [u, v] = [numbers(), numbers()];
    let mut solved = |values: &[f64]| {
        let mut values = values.to_vec();
        pyramid.solve(sets, &mut values).expect("sizes match");
        values
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [a, b] = [dot(&solved(&u), &v), dot(&u, &solved(&v))];
    // Rounding of sums of 10⁵ numbers.
    assert!((a - b).abs() < 1e-11 * dot(&u, &u), "{a} {b}");
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let cells = 96;
    let (points, b) = ellipsoid::<f32>(cells, [40.0, 30.0, 20.0], 2000);
    let sets = Octaves::new(near_samples(&points, cells), 1);
    crate::testing::assert_same_bits(|| {
        let mut values = vec![0.0; sets.0[0].nodes()];
        sets.0[0].read_dense(b.values(), &mut values);
        let mut pyramid = Pyramid::new([cells; 3], 1, false, 0.8);
        pyramid.solve(&sets, &mut values).expect("sizes match");
        values
    });
}
