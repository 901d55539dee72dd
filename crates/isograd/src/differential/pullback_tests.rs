//! Pullbacks against whole Jacobians on a tiny grid, and against products with them on a larger one.

use super::columns::{Column, Strided, add_across, add_along, same};
use super::rows::{self, Order, Stencil};
use super::tests::{cube, field, sphere, torus};
use super::*;
use crate::data::Field;
use crate::testing::{inner, product};

fn noise<T: Real>(n: usize, seed: u64) -> Vec<T> {
    let mut next = crate::testing::noise(seed);
    (0..n).map(|_| T::of(next())).collect()
}

fn vectors<T: Real>(n: usize, seed: u64) -> Vec<[T; 3]> {
    noise(3 * n, seed)
        .chunks_exact(3)
        .map(|v| [v[0], v[1], v[2]])
        .collect()
}

fn gradient_of(phi: &Field<f64>) -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    gradient(phi, &mut out);
    out
}

fn normals_of(phi: &Field<f64>) -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    unit_normals(phi, &mut out);
    out
}

fn curvature_of(phi: &Field<f64>, options: &Options) -> Vec<f64> {
    let mut out = Vec::new();
    mean_curvature(phi, options, &mut Scratch::default(), &mut out);
    out
}

fn moved(phi: &Field<f64>, direction: &[f64], t: f64) -> Field<f64> {
    let values = phi.values().iter().zip(direction).map(|(p, d)| p + t * d);
    Field::new(*phi.grid(), values.collect()).expect("one value a cell")
}

#[test]
fn columns_are_the_transpose_of_stencils() {
    for order in [Order::First, Order::Second] {
        for n in 2..14 {
            // The whole matrix, from the stencils.
            let mut matrix = vec![vec![0.0f64; n]; n];
            for (i, row) in matrix.iter_mut().enumerate() {
                let stencil = Stencil::<f64>::new(order, n, i);
                for t in 0..3 {
                    row[stencil.at[t]] += stencil.weight[t];
                    row[i] -= stencil.weight[t];
                }
            }
            let bar = noise::<f64>(n, 3);
            let mut along = vec![0.0; n];
            add_along(order, 0.7, &bar, same, &mut along);
            for i in 0..n {
                let expected: f64 = (0..n).map(|r| 0.7 * matrix[r][i] * bar[r]).sum();
                let column = Column::<f64>::new(order, n, i);
                let rows = Strided {
                    values: &bar[..],
                    start: 0,
                    stride: 1,
                };
                let mut across = [0.0];
                add_across(&column, 0.7, rows, same, &mut across);
                // Rounding of sums of a few terms below 10.
                assert!((across[0] - expected).abs() < 1e-14, "{order:?} {n} {i}");
                assert!((along[i] - expected).abs() < 1e-14, "{order:?} {n} {i}");
            }
            // The stencil that is transposed is the one that is applied.
            let (u, mut out) = (noise::<f64>(n, 4), vec![0.0; n]);
            rows::along(order, &u, 0.7, &mut out);
            assert!((product(&out, &bar) - product(&u, &along)).abs() < 1e-13);
        }
    }
}

#[test]
fn gradient_gets_the_exact_transpose_of_every_column() {
    for shape in [[6, 5, 4], [2, 3, 9], [11, 2, 3]] {
        let grid = Grid::new([0.1, -0.2, 0.3], 0.25, shape).expect("valid");
        let cells = grid.cells();
        let mut columns = vec![vec![0.0; 3 * cells]; cells];
        for (i, column) in columns.iter_mut().enumerate() {
            let mut one = Field::zeros(grid);
            one.values_mut()[i] = 1.0;
            column.copy_from_slice(gradient_of(&one).as_flattened());
        }
        for row in 0..3 * cells {
            let mut bar = vec![[0.0; 3]; cells];
            bar[row / 3][row % 3] = 1.0;
            let mut found = vec![0.0; cells];
            gradient_pullback(&Field::zeros(grid), &bar, &mut found).expect("matching");
            for i in 0..cells {
                // Weights are multiples of 1/2 over h = 1/4: exact.
                assert_eq!(found[i], columns[i][row], "{shape:?} {row} {i}");
            }
        }
    }
}

#[test]
fn curvature_gets_the_transpose_of_every_column() {
    let grid = Grid::new([-0.7, -0.6, -0.5], 0.25, [6, 5, 4]).expect("valid");
    let bend =
        |[x, y, z]: [f64; 3]| x + 0.4 * y - 0.3 * z + 0.2 * x * x - 0.3 * y * z + 0.1 * z * z;
    let (phi, cells, step) = (field(grid, bend), grid.cells(), 3e-7);
    for smoothing in [0, 1, 2] {
        let options = Options { smoothing };
        let ends = |i: usize| {
            let mut one = vec![0.0; cells];
            one[i] = 1.0;
            [-step, step].map(|t| curvature_of(&moved(&phi, &one, t), &options))
        };
        let columns: Vec<[Vec<f64>; 2]> = (0..cells).map(ends).collect();
        let mut scratch = PullbackScratch::default();
        for row in 0..cells {
            let (mut bar, mut found) = (vec![0.0; cells], vec![0.0; cells]);
            bar[row] = 1.0;
            let guarded = mean_curvature_pullback(&phi, &options, &bar, &mut scratch, &mut found);
            assert_eq!(guarded, Ok(0));
            for i in 0..cells {
                let expected = (columns[i][1][row] - columns[i][0][row]) / (2.0 * step);
                // Third derivatives are up to 1e7, times the step squared.
                let close = (found[i] - expected).abs() < 1e-6 * (1.0 + expected.abs());
                assert!(close, "{} {expected}", found[i]);
            }
        }
    }
}

#[test]
fn products_with_the_jacobians_agree_on_a_torus() {
    let phi = field(cube::<f64>(24), torus);
    let (cells, step) = (phi.values().len(), 1e-7);
    let direction = noise(cells, 1);
    let ends = [-step, step].map(|t| moved(&phi, &direction, t));
    let scratch = &mut PullbackScratch::default();
    let check = |found: &[f64], low: f64, high: f64| {
        let (found, expected) = (product(found, &direction), (high - low) / (2.0 * step));
        // Of sums over 16 thousand cells of derivatives up to 1/h² = 144.
        assert!(
            (found - expected).abs() < 1e-6 * expected.abs(),
            "{found} {expected}"
        );
    };

    let bar = vectors(cells, 2);
    let mut found = vec![0.0; cells];
    gradient_pullback(&phi, &bar, &mut found).expect("matching");
    let loss = |phi: &Field<f64>| inner(&gradient_of(phi), &bar);
    check(&found, loss(&ends[0]), loss(&ends[1]));

    let mut found = vec![0.0; cells];
    assert_eq!(
        unit_normals_pullback(&phi, &bar, scratch, &mut found),
        Ok(0)
    );
    let loss = |phi: &Field<f64>| inner(&normals_of(phi), &bar);
    check(&found, loss(&ends[0]), loss(&ends[1]));

    for smoothing in [0, 1, 3] {
        let options = Options { smoothing };
        let mut bar = noise::<f64>(cells, 3);
        let kappa = [&ends[0], &phi, &ends[1]].map(|phi| curvature_of(phi, &options));
        let bound = 2.0 / phi.grid().spacing() - 1e-3;
        let mut bounded = 0;
        for i in 0..cells {
            // Where the bound is passed there is no derivative: at a crease.
            let limited = kappa.each_ref().map(|k| k[i].abs() >= bound);
            if limited[0] != limited[2] {
                bar[i] = 0.0;
            }
            bounded += usize::from(limited[1] && bar[i] != 0.0);
        }
        let mut found = vec![0.0; cells];
        let guarded = mean_curvature_pullback(&phi, &options, &bar, scratch, &mut found);
        assert_eq!(guarded, Ok(bounded));
        check(&found, product(&kappa[0], &bar), product(&kappa[2], &bar));
    }
}

/// Random points of the grid, walls included, and cotangents of everything there.
fn locals<T: Real>(grid: &Grid<T>, n: usize) -> (Vec<[T; 3]>, Vec<Local<T>>) {
    let (half, size) = (T::of(0.5), grid.shape().map(T::of_usize));
    let inside = |v: [T; 3]| grid.from_index([0, 1, 2].map(|a| half * (v[a] + T::one()) * size[a]));
    let points = vectors(n, 11).into_iter().map(inside).collect();
    let numbers = vectors(n, 12)
        .into_iter()
        .zip(vectors(n, 13))
        .zip(noise(n, 14));
    let local = |((gradient, normal), curvature)| Local {
        gradient,
        normal,
        curvature,
    };
    (points, numbers.map(local).collect())
}

#[test]
fn products_with_the_jacobian_at_points_agree() {
    let phi = field(cube::<f64>(16), |[x, y, z]| {
        (x + 1.6).hypot(y - 1.7).hypot(z + 1.8) + 0.05 * (3.0 * x).sin() * y
    });
    let (n, step, options) = (500, 1e-7, Options::default());
    let (points, bar) = locals(phi.grid(), n);
    let differential = Differential::new(&phi, &options);
    let (phi_way, point_way) = (noise(phi.values().len(), 1), vectors::<f64>(n, 2));
    let loss = |t: f64| -> f64 {
        let points: Vec<[f64; 3]> = points
            .iter()
            .zip(&point_way)
            .map(|(&p, &d)| vector::add(p, vector::scale(d, t)))
            .collect();
        let mut found = Vec::new();
        let differential = Differential::new(&moved(&phi, &phi_way, t), &options);
        differential
            .at_points(&points, &mut found)
            .expect("in the grid");
        let term = |(a, b): (&Local<f64>, &Local<f64>)| {
            vector::dot(a.gradient, b.gradient)
                + vector::dot(a.normal, b.normal)
                + a.curvature * b.curvature
        };
        found.iter().zip(&bar).map(term).sum()
    };
    let (mut phi_bar, mut points_bar) = (vec![0.0; phi.values().len()], Vec::new());
    let scratch = &mut PullbackScratch::default();
    let guarded = differential.pullback_at_points(
        &phi,
        &points,
        &bar,
        scratch,
        &mut phi_bar,
        &mut points_bar,
    );
    assert_eq!(guarded, Ok(0));
    let found = product(&phi_bar, &phi_way) + inner(&points_bar, &point_way);
    let expected = (loss(step) - loss(-step)) / (2.0 * step);
    // Rounding of 500 terms divided by h² and by the step.
    assert!(
        (found - expected).abs() < 1e-6 * (1.0 + expected.abs()),
        "{found} {expected}"
    );
    assert!(inner(&points_bar, &point_way).abs() > 1e-3);
}

/// Everything that comes back: from normals and curvature at cells, and from points.
fn all_of<T: Real>(phi: &Field<T>) -> (Vec<T>, Vec<[T; 3]>, usize) {
    let cells = phi.values().len();
    let (mut out, mut points_bar, options) =
        (vec![T::zero(); cells], Vec::new(), Options::default());
    let scratch = &mut PullbackScratch::default();
    gradient_pullback(phi, &vectors(cells, 4), &mut out).expect("matching");
    let mut guarded =
        unit_normals_pullback(phi, &vectors(cells, 5), scratch, &mut out).expect("matching");
    let bar = noise(cells, 6);
    guarded += mean_curvature_pullback(phi, &options, &bar, scratch, &mut out).expect("matching");
    let (points, bar) = locals(phi.grid(), 3000);
    let differential = Differential::new(phi, &options);
    guarded += differential
        .pullback_at_points(phi, &points, &bar, scratch, &mut out, &mut points_bar)
        .expect("matching");
    (out, points_bar, guarded)
}

fn stays_finite<T: Real>() {
    let grid = Grid::new([T::of(-1.0); 3], T::of(0.125), [16, 16, 17]).expect("valid");
    let spread = |x: [f64; 3]| sphere(x).max(-0.3);
    let tiny = T::min_positive_value().f64();
    for (phi, guards) in [
        (Field::zeros(grid), true),
        (field(grid, spread), true),
        (field(grid, |x| tiny * (x[0] + 0.3 * x[1] * x[2])), true),
        (field(grid, |x| 1e30 * sphere(x)), false),
    ] {
        let (out, points, guarded) = all_of(&phi);
        assert!(
            out.iter()
                .chain(points.iter().flatten())
                .all(|x| x.is_finite())
        );
        assert!(!guards || guarded > 0);
    }
}

#[test]
fn fields_without_gradient_and_of_any_size_give_finite_cotangents() {
    stays_finite::<f32>();
    stays_finite::<f64>();
}

#[test]
fn guards_are_counted_only_where_a_cotangent_meets_them() {
    let grid = Grid::new([0.0; 3], 0.5, [6, 5, 4]).expect("valid");
    let (flat, cells) = (Field::<f64>::zeros(grid), grid.cells());
    let scratch = &mut PullbackScratch::default();
    let (mut normals, mut curvature, mut out) =
        (vec![[0.0; 3]; cells], vec![0.0; cells], vec![0.0; cells]);
    for at in [3, 17] {
        (normals[at], curvature[at]) = ([0.0, 1.0, 0.0], -2.0);
    }
    let options = Options::default();
    assert_eq!(
        unit_normals_pullback(&flat, &normals, scratch, &mut out),
        Ok(2)
    );
    let guarded = mean_curvature_pullback(&flat, &options, &curvature, scratch, &mut out);
    assert_eq!((guarded, out), (Ok(2), vec![0.0; cells]));
}

fn same_bits<T: Real>() {
    let phi = field(cube::<T>(20), torus);
    crate::testing::assert_same_bits(|| all_of(&phi));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    same_bits::<f32>();
    same_bits::<f64>();
}

#[test]
fn what_does_not_match_is_refused() {
    let phi = Field::<f32>::zeros(Grid::new([0.0; 3], 1.0, [3, 4, 5]).expect("valid"));
    let scratch = &mut PullbackScratch::default();
    let (v, s, options) = (vec![[0.0; 3]; 60], vec![0.0; 60], Options::default());
    let out = &mut vec![0.0; 60];
    let mismatch = |refused: Result<(), Error>| {
        assert!(
            matches!(refused, Err(Error::Mismatch { expected: 60, .. })),
            "{refused:?}"
        );
    };
    mismatch(gradient_pullback(&phi, &v[1..], out));
    mismatch(gradient_pullback(&phi, &v, &mut out[1..]));
    mismatch(unit_normals_pullback(&phi, &v[1..], scratch, out).map(drop));
    mismatch(unit_normals_pullback(&phi, &v, scratch, &mut out[1..]).map(drop));
    mismatch(mean_curvature_pullback(&phi, &options, &s[1..], scratch, out).map(drop));
    mismatch(mean_curvature_pullback(&phi, &options, &s, scratch, &mut out[1..]).map(drop));
    let differential = Differential::new(&phi, &options);
    let (inside, bar, points_bar) = ([[1.0; 3]; 60], [Local::default(); 60], &mut Vec::new());
    let mut pull = |phi: &Field<f32>, points: &[[f32; 3]], bar: &[Local<f32>]| {
        differential.pullback_at_points(phi, points, bar, scratch, out, points_bar)
    };
    assert_eq!(pull(&phi, &inside, &bar), Ok(0));
    mismatch(pull(&phi, &inside, &bar[1..]).map(drop));
    let outside = pull(&phi, &[[9.0; 3]], &bar[..1]);
    assert!(matches!(outside, Err(Error::Outside { index: 0, .. })));
    let other = Field::zeros(Grid::new([0.0; 3], 2.0, [3, 4, 5]).expect("valid"));
    assert_eq!(pull(&other, &inside, &bar), Err(Error::Grid));
}
