//! The Poisson equation, beside the CPU's solve and a stencil.

use cubecl::prelude::Runtime;
use isograd::poisson::{Plan, Scratch, smoothing as cpu};
use isograd_gpu::poisson::{Solver, smoothing};
use isograd_gpu::{Device, Error, Scalar};

use crate::clouds::{difference, largest};
use crate::devices::{Numbers, tests, tolerance};

tests! {
    on_each_device:
        stencil_gives_back_the_right_hand_side,
        constant_part_of_the_right_hand_side_is_ignored, second_solve_has_the_same_bits,
        what_does_not_fit_is_refused_and_no_cells_are_solved,
        values_that_are_not_finite_spread;
    in_each_number: solutions_are_those_of_the_cpu, pullback_is_the_transpose;
}

/// Powers of two, factors of every pass, primes with a pass of their own and without, lines longer than the shared
/// memory, single cells.
const SHAPES: [[usize; 3]; 18] = [
    [16, 16, 16],
    [31, 17, 5],
    [1, 7, 64],
    [64, 48, 80],
    [127, 3, 2],
    [2, 1, 1],
    [1, 1, 1],
    [5, 1, 131],
    [1, 37, 1],
    [3, 149, 67],
    [45, 14, 22],
    [1, 1, 1024],
    [1, 1500, 3],
    [3, 1, 2048],
    [2058, 1, 2],
    [2, 151, 338],
    [1021, 2, 1],
    [1, 2, 2053],
];

/// Solution of the CPU in f64.
fn expected<T: Scalar>(shape: [usize; 3], b: &[T], smoothing: f64) -> Vec<f64> {
    let mut field: Vec<f64> = b.iter().map(|v| v.f64()).collect();
    let plan = Plan::new(shape);
    let solved = plan.solve(&mut field, smoothing, &mut Scratch::default());
    solved.expect("sizes match");
    field
}

/// The largest error over the largest value expected.
fn error<T: Scalar>(found: &[T], expected: &[f64]) -> f64 {
    difference(found, expected, largest(expected).max(f64::MIN_POSITIVE))
}

fn dot<T: Scalar>(a: &[T], b: &[T]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.f64() * b.f64()).sum()
}

fn solutions_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    let mut worst = [0.0f64; 2];
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let b: Vec<T> = Numbers(seed as u64).list(shape.iter().product());
        let solvers = [
            Solver::new(device, shape),
            Solver::by_definition(device, shape),
        ];
        let buffer = device.upload(&b).unwrap();
        for (way, solver) in solvers.into_iter().enumerate() {
            let solver = solver.unwrap();
            // Plain sums of long lines take long.
            if way == 1 && shape.into_iter().max() > Some(1000) {
                continue;
            }
            for sigma in [0.0, 0.9] {
                let chi = solver.solve(device, &buffer, sigma).unwrap();
                let chi = device.download(&chi).unwrap();
                let error = error(&chi, &expected(shape, &b, sigma));
                assert!(
                    error < tolerance,
                    "{shape:?}, way {way}, σ {sigma}: {error:e}"
                );
                worst[way] = worst[way].max(error);
            }
        }
        assert_eq!(device.download(&buffer).unwrap(), b, "the input is kept");
    }
    println!(
        "{}: {:e}, all by definition {:e}",
        T::NAME,
        worst[0],
        worst[1]
    );
}

/// `A χ` from the definition: 1D stencils `(side, center, side)` along the axes, with even reflection.
fn stencil(chi: &[f64], shape: [usize; 3]) -> Vec<f64> {
    let along = |field: &[f64], axis: usize, side: f64, center: f64| -> Vec<f64> {
        let step: usize = shape[axis + 1..].iter().product();
        let at = |i: usize| {
            let p = i / step % shape[axis];
            let low = if p == 0 { i } else { i - step };
            let high = if p + 1 == shape[axis] { i } else { i + step };
            side * (field[low] + field[high]) + center * field[i]
        };
        (0..field.len()).map(at).collect()
    };
    let mut out = vec![0.0; chi.len()];
    for stiff in 0..3 {
        let mut term = chi.to_vec();
        for axis in 0..3 {
            let (side, center) = if axis == stiff {
                (-1.0, 2.0)
            } else {
                (1.0 / 6.0, 4.0 / 6.0)
            };
            term = along(&term, axis, side, center);
        }
        out.iter_mut().zip(term).for_each(|(o, t)| *o += t);
    }
    out
}

fn stencil_gives_back_the_right_hand_side<R: Runtime>(device: &Device<R>) {
    for shape in [[20, 24, 30], [11, 131, 8]] {
        let cells: usize = shape.iter().product();
        let mut b: Vec<f32> = Numbers(7).list(cells);
        let mean = b.iter().sum::<f32>() / cells as f32;
        b.iter_mut().for_each(|v| *v -= mean);
        let solver = Solver::new(device, shape).unwrap();
        let chi = solver.solve(device, &device.upload(&b).unwrap(), 0.0);
        let chi: Vec<f32> = device.download(&chi.unwrap()).unwrap();
        let chi: Vec<f64> = chi.into_iter().map(f64::from).collect();
        // Rounding in f32 of χ, which is some tens of times as large as b.
        let error = error(&b, &stencil(&chi, shape));
        assert!(error < 1e-4, "{shape:?}: {error:e}");
    }
}

fn pullback_is_the_transpose<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for shape in [
        [9, 12, 7],
        [10, 131, 21],
        [1, 1, 1],
        [1, 64, 2],
        [41, 32, 20],
    ] {
        let cells = shape.iter().product();
        let sigma = 0.8;
        // Like b in part: two fields of mere noise have a σ̄ of nearly nothing.
        let (b, other): (Vec<T>, Vec<T>) = (Numbers(1).list(cells), Numbers(2).list(cells));
        let chi_bar: Vec<T> = b.iter().zip(&other).map(|(&b, &o)| b + o).collect();
        let solver = Solver::new(device, shape).unwrap();
        let chi = solver
            .solve(device, &device.upload(&b).unwrap(), sigma)
            .unwrap();
        let cotangent = device.upload(&chi_bar).unwrap();
        let b_bar = solver.solve(device, &cotangent, sigma).unwrap();
        let sigma_bar = smoothing::pullback(device, sigma, shape, &chi, &cotangent).unwrap();
        let [chi, b_bar] = [chi, b_bar].map(|field| device.download(&field).unwrap());
        let size = (dot(&chi, &chi) * dot(&chi_bar, &chi_bar)).sqrt() + f64::MIN_POSITIVE;
        let gap = (dot(&chi, &chi_bar) - dot(&b, &b_bar)).abs();
        assert!(gap < tolerance * size, "{shape:?}: {gap:e} of {size:e}");
        let error = error(&b_bar, &expected(shape, &chi_bar, sigma));
        assert!(error < tolerance, "{shape:?}: {error:e}");

        let sigma_bar = device.download(&sigma_bar).unwrap();
        let wide = |v: &[T]| v.iter().map(|v| v.f64()).collect::<Vec<f64>>();
        let from_cpu = cpu::pullback(&Plan::new(shape), sigma, &wide(&chi), &wide(&chi_bar));
        let gap = (sigma_bar[0].f64() - from_cpu).abs();
        assert_eq!(sigma_bar.len(), 1);
        assert!(gap < tolerance * size, "{shape:?}: {gap:e} of {size:e}");
        assert!(cells == 1 || from_cpu.abs() > 0.01 * size, "says nothing");
    }
}

fn constant_part_of_the_right_hand_side_is_ignored<R: Runtime>(device: &Device<R>) {
    let shape = [6, 10, 149];
    let b: Vec<f32> = Numbers(8).list(6 * 10 * 149);
    let shifted: Vec<f32> = b.iter().map(|v| v + 0.75).collect();
    let solver = Solver::new(device, shape).unwrap();
    let solve = |b: &[f32]| {
        let chi = solver.solve(device, &device.upload(b).unwrap(), 0.5);
        device.download(&chi.unwrap()).unwrap()
    };
    let chi: Vec<f64> = solve(&b).into_iter().map(f64::from).collect();
    let error = error(&solve(&shifted), &chi);
    assert!(error < 1e-4, "{error:e}");
    let mean = chi.iter().sum::<f64>() / chi.len() as f64;
    assert!(mean.abs() < 1e-5 * largest(&chi));
}

fn second_solve_has_the_same_bits<R: Runtime>(device: &Device<R>) {
    for shape in [[24, 40, 64], [37, 5, 48]] {
        let b: Vec<f32> = Numbers(3).list(shape.iter().product());
        let run = || {
            let solver = Solver::new(device, shape).unwrap();
            let b = device.upload(&b).unwrap();
            let chi = solver.solve(device, &b, 0.4).unwrap();
            let sigma = smoothing::pullback(device, 0.4, shape, &chi, &b).unwrap();
            let [chi, sigma] = [chi, sigma].map(|v| device.download(&v).unwrap());
            let bits = chi.into_iter().chain(sigma).map(f32::to_bits);
            bits.collect::<Vec<u32>>()
        };
        assert_eq!(run(), run());
    }
}

fn what_does_not_fit_is_refused_and_no_cells_are_solved<R: Runtime>(device: &Device<R>) {
    let solver = Solver::<f32>::new(device, [3, 4, 5]).unwrap();
    let b = device.upload(&[1.0f32; 59]).unwrap();
    let refused = solver.solve(device, &b, 0.0);
    assert!(matches!(refused, Err(Error::Length { found: 59, .. })));
    let b = device.upload(&[1.0f32; 60]).unwrap();
    for sigma in [-1.0, f64::NAN, f64::INFINITY] {
        let refused = solver.solve(device, &b, sigma);
        assert!(matches!(refused, Err(Error::Smoothing { .. })));
    }
    let long = device.upload(&[1.0f32; 61]).unwrap();
    for (chi, chi_bar) in [(&b, &long), (&long, &b)] {
        let refused = smoothing::pullback(device, 1.0, [3, 4, 5], chi, chi_bar);
        assert!(matches!(refused, Err(Error::Length { found: 61, .. })));
    }
    let refused = solver.solve(device, &long, 1.0);
    assert!(matches!(refused, Err(Error::Length { found: 61, .. })));

    let shape = [0, 4, 5];
    let solver = Solver::<f32>::new(device, shape).unwrap();
    let none = device.empty(0).unwrap();
    assert!(solver.solve(device, &none, 1.0).unwrap().is_empty());
    let sigma_bar = smoothing::pullback(device, 1.0, shape, &none, &none).unwrap();
    assert_eq!(device.download(&sigma_bar).unwrap(), [0.0]);
}

fn values_that_are_not_finite_spread<R: Runtime>(device: &Device<R>) {
    for shape in [[7, 8, 9], [1, 1, 1], [3, 37, 2]] {
        let mut b = vec![0.0f32; shape.iter().product()];
        b[0] = f32::NAN;
        let solver = Solver::new(device, shape).unwrap();
        let chi = solver.solve(device, &device.upload(&b).unwrap(), 0.0);
        let chi = device.download(&chi.unwrap()).unwrap();
        assert!(chi.iter().all(|v| v.is_nan()), "{shape:?}");
    }
}
