//! Finite results and gradients for any cloud, unit, option and cotangent; clouds that make no sense are errors.

mod random;

use crate::common::Uniform;
use isograd::orient::Method;
use isograd::{
    CloudCotangent, Cotangent, Grid, Options, Pipeline, PointCloud, Reconstruction, Reconstructor,
    Resolution,
};
use random::{Bad, Draw, Outcome, case, of_gradients, plus, times};

/// The case of a seed, in `f32` for even ones and in `f64` for odd ones.
fn run(seed: u64) -> Result<Outcome, String> {
    match seed % 2 {
        0 => case::<f32>(seed),
        _ => case::<f64>(seed),
    }
}

#[test]
fn results_and_gradients_of_random_clouds_are_finite() {
    let (mut pulled, mut replaced) = (0, 0);
    for seed in 0..600 {
        let Ok(outcome) = run(seed) else { continue };
        let bad: Bad = outcome.bad.into_iter().filter(|bad| bad.1 > 0).collect();
        assert!(
            bad.is_empty(),
            "seed {seed}: {bad:?} are not finite: {}",
            outcome.text
        );
        let counted = outcome.maxima == 0 || outcome.guarded > 0;
        assert!(
            counted,
            "seed {seed}: numbers replaced, none counted: {}",
            outcome.text
        );
        pulled += 1;
        replaced += usize::from(outcome.maxima > 0);
    }
    // The rest is refused: clouds too large or too small to be squared, on a line, or off their grid.
    assert!(pulled > 300, "{pulled}");
    assert!(replaced > 20, "{replaced}");
}

fn sphere(n: usize, center: [f64; 3], radius: f64) -> Vec<[f64; 3]> {
    let draw = &mut Draw(Uniform::new(5));
    let point = |_| plus(center, times(radius, draw.direction()));
    (0..n).map(point).collect()
}

fn reconstructed<T: Pipeline>(points: &[[f64; 3]], grid: Option<Grid<T>>) -> Reconstruction<T> {
    let points = points.iter().map(|p| p.map(T::of)).collect();
    let cloud = PointCloud::new(points).expect("finite points");
    let fitted = || Grid::fit(&cloud, Resolution::Cells(32), T::of(0.1)).expect("a grid");
    let grid = grid.unwrap_or_else(fitted);
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    plan.reconstruct(&cloud).expect("reconstructs");
    plan.into_reconstruction()
}

/// Gradients of the sum of all φ times `bar`.
fn pulled<T: Pipeline>(result: &Reconstruction<T>, bar: f64) -> CloudCotangent<T> {
    let sdf = vec![T::of(bar); result.sdf().values().len()];
    let cotangent = Cotangent {
        sdf: Some(&sdf),
        ..Cotangent::default()
    };
    result.pullback(&cotangent).expect("pulls back")
}

fn assert_finite<T: Pipeline>(what: &str, bar: &CloudCotangent<T>) {
    let bad = of_gradients(bar).into_iter().filter(|bad| bad.1 > 0);
    let bad: Bad = bad.collect();
    assert!(bad.is_empty(), "{what}: {bad:?}");
}

/// Checks that the gradients of the sum of all φ are finite, and that none was replaced: all points but one have one that is
/// neither 0 nor the largest number.
fn assert_exact<T: Pipeline>(what: &str, result: &Reconstruction<T>) {
    let bar = pulled(result, 1.0);
    assert_finite(what, &bar);
    let is_exact =
        |p: &&[T; 3]| **p != [T::zero(); 3] && p.iter().all(|x| x.abs() < T::max_value());
    let exact = bar.points.iter().filter(is_exact).count();
    assert!(exact + 1 >= bar.points.len(), "{what}: {exact}");
}

#[test]
fn a_second_body_far_away_leaves_gradients_finite() {
    for far in [1e3, 1e5, 1e7, 1e9, 1e11, 1e13] {
        let mut points = sphere(300, [0.0; 3], 1.0);
        points.push([far, 0.0, 0.0]);
        let result = reconstructed::<f32>(&points, None);
        assert_exact(&format!("a point at {far:e}"), &result);
        points.pop();
        points.extend(sphere(300, [far, 0.0, 0.0], 1.0));
        let what = format!("a sphere at {far:e}");
        assert_exact(&what, &reconstructed::<f32>(&points, None));
        assert_exact(&what, &reconstructed::<f64>(&points, None));
    }
}

#[test]
fn a_body_far_smaller_than_a_cell_leaves_gradients_finite() {
    fn in_cells<T: Pipeline>(size: f64) -> Reconstruction<T> {
        let grid = Grid::new([-T::one(); 3], T::of(1.0 / 16.0), [32; 3]).expect("a grid");
        reconstructed(&sphere(300, [0.0; 3], size), Some(grid))
    }
    for size in [1e-2, 1e-5, 1e-10] {
        assert_exact(&format!("f32, {size:e}"), &in_cells::<f32>(size));
    }
    for size in [1e-2, 1e-5, 1e-10, 1e-20, 1e-50, 1e-100] {
        assert_exact(&format!("f64, {size:e}"), &in_cells::<f64>(size));
    }
    // The square of the indicator is 0 here.
    let bar = pulled(&in_cells::<f64>(1e-140), 1.0);
    assert_finite("f64, 1e-140", &bar);
    assert!(bar.guarded > 0, "nothing counted");
}

fn assert_proportional<T: Pipeline>(exponents: &[i32]) {
    let result = reconstructed::<T>(&sphere(500, [0.3, -0.2, 0.1], 1.0), None);
    let one = pulled(&result, 0.7);
    for &exponent in exponents {
        let bar = pulled(&result, 0.7 * 2f64.powi(exponent));
        let all = bar.points.iter().flatten().zip(one.points.iter().flatten());
        for (x, one) in all {
            let expected = one.f64() * 2f64.powi(exponent);
            assert_eq!(x.f64(), T::of(expected).f64(), "2^{exponent}");
        }
        assert_eq!(bar.guarded, one.guarded);
    }
}

#[test]
fn gradients_are_proportional_to_cotangents_of_any_size() {
    assert_proportional::<f32>(&[-100, -50, 10, 60, 100]);
    assert_proportional::<f64>(&[-900, -300, 20, 400, 1000]);
}

#[test]
fn gradients_larger_than_the_number_type_are_the_largest_number_and_counted() {
    let result = reconstructed::<f32>(&sphere(500, [0.0; 3], 1.0), None);
    let bar = pulled(&result, 1e38);
    assert_finite("1e38", &bar);
    let replaced = bar.points.iter().flatten().filter(|x| x.abs() == f32::MAX);
    let (replaced, before) = (replaced.count(), pulled(&result, 1.0).guarded);
    assert!(replaced > 0);
    assert!(bar.guarded >= before + replaced, "{}", bar.guarded);
}

#[test]
fn given_normals_of_any_length_have_finite_gradients() {
    for length in [1e-310, 1e-160, 1.0, 1e160, 1e308] {
        let points = sphere(300, [0.0; 3], 1.0);
        let normals = points.iter().map(|&p| times(length, p)).collect();
        let cloud = PointCloud::new(points).expect("finite points");
        let cloud = cloud.with_normals(normals).expect("one normal a point");
        let grid = Grid::fit(&cloud, Resolution::Cells(32), 0.1).expect("a grid");
        let options = Options::default().orient(Method::Given);
        let mut plan = Reconstructor::new(grid, options).expect("valid options");
        let bar = pulled(plan.reconstruct(&cloud).expect("reconstructs"), 1.0);
        assert_finite(&format!("{length:e}"), &bar);
        let largest = bar
            .normals
            .iter()
            .flatten()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        assert_eq!(
            largest == f64::MAX,
            length < 1e-308,
            "{length:e}: {largest:e}"
        );
    }
}
