//! Against closed forms, observed orders of convergence, and plain versions.

use super::rows::{Order, Stencil};
use super::*;
use crate::data::Field;
use crate::neighbors::tests::even_sphere;

const EXACT: Options = Options { smoothing: 0 };

pub(super) fn field<T: Real>(grid: Grid<T>, f: impl Fn([f64; 3]) -> f64) -> Field<T> {
    let values = (0..grid.cells()).map(|at| T::of(f(grid.center_f64(grid.cell(at)))));
    Field::new(grid, values.collect()).expect("one value a cell")
}

/// About [−1, 1]³, `n` cells along x.
pub(super) fn cube<T: Real>(n: usize) -> Grid<T> {
    let h = T::of(2.0 / n as f64);
    Grid::new([T::of(-1.0); 3], h, [n, n + 1, n + 2]).expect("valid")
}

pub(super) fn sphere(x: [f64; 3]) -> f64 {
    vector::norm(x) - 0.6
}

pub(super) fn torus([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y) - 0.6).hypot(z) - 0.3
}

/// Gradient and curvature of [`torus`].
fn torus_local([x, y, z]: [f64; 3]) -> ([f64; 3], f64) {
    let rho = x.hypot(y);
    let (out, d) = (rho - 0.6, torus([x, y, z]) + 0.3);
    (
        [out / d * x / rho, out / d * y / rho, z / d],
        1.0 / d + out / (d * rho),
    )
}

fn curvature_of<T: Real>(phi: &Field<T>, options: &Options) -> Vec<T> {
    let mut out = Vec::new();
    mean_curvature(phi, options, &mut Scratch::default(), &mut out);
    out
}

#[test]
fn quadratics_are_exact_at_every_cell_walls_included() {
    let phi = |[x, y, z]: [f64; 3]| {
        3.0 * x - 2.0 * y + z + 0.3 * x * x - 0.4 * y * y + 0.2 * z * z + 0.5 * x * y - 0.7 * x * z
            + 0.1 * y * z
    };
    let slope = |[x, y, z]: [f64; 3]| {
        [
            3.0 + 0.6 * x + 0.5 * y - 0.7 * z,
            -2.0 - 0.8 * y + 0.5 * x + 0.1 * z,
            1.0 + 0.4 * z - 0.7 * x + 0.1 * y,
        ]
    };
    let hessian = [[0.6, 0.5, -0.7], [0.5, -0.8, 0.1], [-0.7, 0.1, 0.4]];
    for shape in [[3, 4, 5], [7, 3, 4], [5, 6, 3], [9, 8, 17]] {
        let grid = Grid::new([0.1, -0.2, 0.3], 0.1, shape).expect("valid");
        let phi = field(grid, phi);
        let (mut g, mut n) = (Vec::new(), Vec::new());
        gradient(&phi, &mut g);
        unit_normals(&phi, &mut n);
        for smoothing in [0, 1, 2] {
            let kappa = curvature_of(&phi, &Options { smoothing });
            for at in 0..grid.cells() {
                let exact = slope(grid.center(grid.cell(at)));
                let s = vector::dot(exact, exact);
                let along: f64 = (0..3)
                    .map(|a| exact[a] * vector::dot(hessian[a], exact))
                    .sum();
                let expected = (s * (0.6 - 0.8 + 0.4) - along) / s.powf(1.5);
                // Rounding of values below 10, divided by h² = 0.01.
                assert!(
                    (kappa[at] - expected).abs() < 1e-11,
                    "{} for {expected}",
                    kappa[at]
                );
                assert!(vector::norm(vector::sub(g[at], exact)) < 1e-12);
                assert!(
                    vector::norm(vector::sub(n[at], vector::scale(exact, 1.0 / s.sqrt()))) < 1e-12
                );
            }
        }
    }
}

#[test]
fn stencils_have_the_order_that_is_claimed() {
    // Moments Σ w_t (at_t − i)^m: 1 for the derivative itself, 0 for the orders that must vanish.
    let moment = |s: &Stencil<f64>, i: usize, m: i32| -> f64 {
        (0..3)
            .map(|t| s.weight[t] * (s.at[t] as f64 - i as f64).powi(m))
            .sum()
    };
    for n in 2..8 {
        for i in 0..n {
            let first = Stencil::<f64>::new(Order::First, n, i);
            assert_eq!(moment(&first, i, 1), 1.0);
            assert!(n < 3 || moment(&first, i, 2) == 0.0);
            let second = Stencil::<f64>::new(Order::Second, n, i);
            assert_eq!(moment(&second, i, 1), 0.0);
            assert_eq!(moment(&second, i, 2), if n < 3 { 0.0 } else { 2.0 });
            assert!(n < 4 || moment(&second, i, 3) == 0.0);
            assert!(first.at.iter().chain(&second.at).all(|&at| at < n));
        }
    }
}

/// Largest errors of normal and curvature on the cells that `keep` chooses, walls included.
fn errors(n: usize, options: &Options) -> [f64; 3] {
    let phi = field(cube::<f64>(n), torus);
    let (mut g, mut normals) = (Vec::new(), Vec::new());
    gradient(&phi, &mut g);
    unit_normals(&phi, &mut normals);
    let kappa = curvature_of(&phi, options);
    let mut worst = [0.0f64; 3];
    for at in 0..phi.values().len() {
        let x = phi.grid().center(phi.grid().cell(at));
        // Away from the two creases: the axis and the ring inside the tube.
        if x[0].hypot(x[1]) < 0.25 || torus(x) < -0.15 {
            continue;
        }
        let (exact, curvature) = torus_local(x);
        worst[0] = worst[0].max(vector::norm(vector::sub(g[at], exact)));
        worst[1] = worst[1].max(vector::norm(vector::sub(normals[at], exact)));
        worst[2] = worst[2].max((kappa[at] - curvature).abs());
    }
    worst
}

/// Checks errors on a grid, and on one twice as fine.
fn assert_second_order(coarse: &[f64], fine: &[f64]) {
    for (a, b) in coarse.iter().zip(fine) {
        let order = (a / b).log2();
        // The largest error sits nearest the crease, where the next order still shows.
        assert!(
            (1.7..2.6).contains(&order),
            "order {order}: {coarse:?} {fine:?}"
        );
    }
}

#[test]
fn gradient_normals_and_curvature_converge_at_second_order_up_to_the_walls() {
    for options in [EXACT, Options::default()] {
        assert_second_order(&errors(48, &options), &errors(96, &options));
    }
}

#[test]
fn values_at_points_converge_at_second_order_up_to_the_walls() {
    let error = |n: usize| {
        let phi = field(cube::<f64>(n), torus);
        let differential = Differential::new(&phi, &EXACT);
        let mut worst = [0.0f64; 2];
        let mut points = Vec::new();
        for at in 0..20_000 {
            // An even sequence (R3) over the whole box.
            let x = [0.8191725134, 0.6710436067, 0.5497004779]
                .map(|a| (a * f64::from(at)) % 1.0 * 2.0 - 1.0);
            if x[0].hypot(x[1]) > 0.3 && torus(x) > -0.1 {
                points.push(x);
            }
        }
        let mut out = Vec::new();
        differential
            .at_points(&points, &mut out)
            .expect("all within");
        for (&x, local) in points.iter().zip(&out) {
            let (normal, curvature) = torus_local(x);
            worst[0] = worst[0].max(vector::norm(vector::sub(local.normal, normal)));
            worst[1] = worst[1].max((local.curvature - curvature).abs());
            assert_eq!(differential.at(x), Some(*local));
        }
        worst
    };
    assert_second_order(&error(40), &error(80));
}

#[test]
fn a_sphere_has_curvature_two_over_r_and_its_hollow_the_opposite() {
    let grid = cube::<f64>(64);
    let at = grid.index([51, 32, 32]);
    let x = grid.center(grid.cell(at));
    let expected = 2.0 / vector::norm(x);
    // Second order: (h/r)² is 3e-3 here, times a constant below 1.
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 3e-3;
    assert!(close(
        curvature_of(&field(grid, sphere), &EXACT)[at],
        expected
    ));
    assert!(close(
        curvature_of(&field(grid, |x| -sphere(x)), &EXACT)[at],
        -expected
    ));
}

#[test]
fn facets_a_cell_wide_do_not_spoil_the_curvature() {
    let n = 32;
    let grid = cube::<f64>(n);
    // Planes that touch a sphere, about one for each h² of it: inside, a distance as exact as ours.
    let count = (4.0 * std::f64::consts::PI * 0.36 / grid.spacing().powi(2)) as usize;
    let planes = even_sphere(count);
    let phi = field(grid, |x| {
        planes
            .iter()
            .map(|p| vector::dot(*p, x))
            .fold(f64::MIN, f64::max)
            - 0.6
    });
    let error = |options: &Options| {
        let kappa = curvature_of(&phi, options);
        let near = (0..kappa.len()).filter(|&at| phi.values()[at].abs() < grid.spacing());
        let squares = near.map(|at| {
            let exact = 2.0 / vector::norm(grid.center(grid.cell(at)));
            (kappa[at] / exact - 1.0).powi(2)
        });
        let squares: Vec<f64> = squares.collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let (plain, smoothed) = (error(&EXACT), error(&Options::default()));
    // 0.13 and 0.002 when this was written.
    assert!(plain > 0.1 && smoothed < 0.01, "{plain} {smoothed}");
}

#[test]
fn where_there_is_no_gradient_all_is_zero_and_everywhere_it_is_bounded() {
    let grid = cube::<f32>(11);
    for phi in [
        field(grid, |_| 0.7),
        field(grid, |x| x[0].abs() + x[1].abs()),
        field(grid, |x| -vector::norm(x)),
        field(grid, |x| x[0] * x[1] * 1e-30),
    ] {
        let mut n = Vec::new();
        unit_normals(&phi, &mut n);
        let bound = 2.0 / grid.spacing() * 1.000001;
        for options in [EXACT, Options::default()] {
            let kappa = curvature_of(&phi, &options);
            assert!(kappa.iter().all(|k| k.abs() <= bound));
        }
        assert!(
            n.iter()
                .all(|&n| n == [0.0; 3] || (vector::norm(n) - 1.0).abs() < 1e-6)
        );
    }
    let flat = Differential::new(&field(grid, |_| 0.7), &Options::default());
    assert_eq!(flat.at([0.05, 0.1, 0.2]), Some(Local::default()));
    assert!(flat.curvature().iter().all(|&k| k == 0.0));
}

#[test]
fn single_precision_loses_little_near_the_surface() {
    let (phi64, phi32) = (
        field(cube::<f64>(64), sphere),
        field(cube::<f32>(64), sphere),
    );
    let (k64, k32) = (curvature_of(&phi64, &EXACT), curvature_of(&phi32, &EXACT));
    let h = 2.0 / 64.0;
    for at in 0..k64.len() {
        if phi64.values()[at].abs() < 2.0 * h {
            // |φ| below 5 h in the stencil, 24 terms of at most 5 h ε/2 each.
            assert!((k64[at] - k32[at].f64()).abs() * h < 60.0 * f64::from(f32::EPSILON));
        }
    }
}

#[test]
fn points_outside_the_grid_are_named() {
    let grid = Grid::new([1e5f32, 0.0, -1.0], 0.1, [8, 9, 10]).expect("valid");
    let differential = Differential::new(&field(grid, |x| x[1]), &EXACT);
    for inside in [grid.lower(), grid.upper(), grid.center([3, 4, 5])] {
        let local = differential.at(inside).expect("within");
        assert!((local.gradient[1] - 1.0).abs() < 1e-5, "{local:?}");
    }
    let good = grid.center([1, 2, 3]);
    let mut out = Vec::new();
    for bad in [
        [0.0; 3],
        [f32::NAN; 3],
        [f32::INFINITY; 3],
        vector::add(grid.upper(), [0.0, 1e-3, 0.0]),
    ] {
        assert_eq!(differential.at(bad), None);
        let error = differential
            .at_points(&[good, good, bad, bad], &mut out)
            .expect_err("refused");
        assert!(error.to_string().contains("point 2"), "{error}");
        assert!(out.is_empty());
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let phi = field(cube::<f32>(37), torus);
    crate::testing::assert_same_bits(|| {
        let d = Differential::new(&phi, &Options::default());
        (
            d.gradient.clone(),
            d.curvature.clone(),
            eikonal(&phi, &EikonalOptions::default()),
        )
    });
}

#[test]
fn a_second_update_uses_the_same_memory_and_forgets_the_first() {
    let (a, b) = (
        field(cube::<f64>(20), sphere),
        field(cube::<f64>(20), torus),
    );
    let mut d = Differential::new(&a, &Options::default());
    let places = (d.gradient.as_ptr(), d.curvature.as_ptr());
    d.update(&b, &Options::default());
    assert_eq!(places, (d.gradient.as_ptr(), d.curvature.as_ptr()));
    let fresh = Differential::new(&b, &Options::default());
    assert_eq!(
        (&d.gradient, &d.curvature),
        (&fresh.gradient, &fresh.curvature)
    );
}
