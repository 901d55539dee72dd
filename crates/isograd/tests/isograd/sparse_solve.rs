//! A sparse solve, with the dense one as the oracle.

use crate::common::TORUS;
use isograd::distance::Band;
use isograd::isosurface::Level;
use isograd::orient::Method;
use isograd::{
    CloudCotangent, Cotangent, Error, Grid, Options, Pipeline, PointCloud, PullbackError,
    Reconstruction, Reconstructor, Saved, Solve, SurfaceResolution,
};

fn grid<T: Pipeline>() -> Grid<T> {
    let lower = [-1.213, -1.206, -0.619].map(T::of);
    Grid::new(lower, T::of(0.05), [48, 48, 24]).expect("a grid")
}

fn reconstruct<T: Pipeline>(cloud: &PointCloud<T>, options: Options) -> Reconstruction<T> {
    let options = options.orient(Method::Given);
    let mut plan = Reconstructor::new(grid(), options).expect("options");
    plan.reconstruct(cloud).expect("a surface");
    plan.into_reconstruction()
}

/// The dense and the sparse reconstruction.
fn both<T: Pipeline>(cloud: &PointCloud<T>, options: &Options) -> [Reconstruction<T>; 2] {
    let found = [Solve::Dense, Solve::Sparse].map(|solve| {
        let result = reconstruct(cloud, options.clone().solve(solve));
        assert_eq!(result.solve(), solve);
        result
    });
    let [dense, sparse] = [&found[0], &found[1]].map(|result| result.report());
    println!("cells: {} of {}", sparse.surface_cells, dense.surface_cells);
    assert_eq!(found[0].surface_grid(), found[1].surface_grid());
    found
}

/// Gradient of a smooth function of φ near the surface.
fn gradient<T: Pipeline>(result: &Reconstruction<T>) -> CloudCotangent<T> {
    let phi = result.sdf().values().iter().enumerate();
    let bars = phi.map(|(i, phi)| {
        let near = (-(phi.f64() / 0.1).powi(2)).exp();
        let center = result.sdf().grid().center_f64(result.sdf().grid().cell(i));
        T::of(near * (1.0 + center[0] - 0.5 * center[2]))
    });
    let bars: Vec<T> = bars.collect();
    let cotangent = Cotangent {
        sdf: Some(&bars),
        ..Cotangent::default()
    };
    result.pullback(&cotangent).expect("a pullback")
}

/// Checks that topology, φ and gradients agree.
fn assert_agreement<T: Pipeline>(cloud: &PointCloud<T>, options: &Options) {
    let [dense, sparse] = both(cloud, options);
    let [a, b] = [&dense, &sparse].map(|result| &result.report().surface);
    assert_eq!(
        (a.euler, a.components, a.closed),
        (b.euler, b.components, b.closed)
    );
    let cell = dense.surface_grid().spacing().f64();
    let pairs = dense.sdf().values().iter().zip(sparse.sdf().values());
    let differences = pairs.map(|(a, b)| (*a - *b).f64().abs() / cell);
    let mut differences: Vec<f64> = differences.collect();
    differences.sort_by(f64::total_cmp);
    let last = differences.len() - 1;
    let [most, worst] = [last - last / 1000, last].map(|i| differences[i]);
    println!("φ differs by up to {most:e} cells, at a thousandth of them by up to {worst:e}");
    // χ is right to 1e-4 of its jump, and rises by a third of it or more in a cell. Where a value at a cell changes sides,
    // its triangles are others: then φ changes by the height of an arc of one cell.
    assert!(most < 1e-3 && worst < 0.02);
    let [a, b] = [&dense, &sparse].map(gradient);
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let to_f64 = |v: [T; 3]| v.map(|x| x.f64());
    let squares = a.points.iter().map(|&v| norm(to_f64(v)).powi(2));
    let rms = (squares.sum::<f64>() / a.points.len() as f64).sqrt();
    let pairs = a.points.iter().zip(&b.points);
    let off = pairs.map(|(&a, &b)| {
        let (a, b) = (to_f64(a), to_f64(b));
        norm(std::array::from_fn(|d| a[d] - b[d])) / rms
    });
    let mut off: Vec<f64> = off.collect();
    off.sort_by(f64::total_cmp);
    // At such a cell, the gradients of a few samples change, too.
    let most = off[off.len() - 1 - off.len() / 100];
    println!("gradients differ by up to {most:e}, at a hundredth of the samples by more");
    assert!(most < 1e-3, "{most}");
}

#[test]
fn surface_and_gradients_are_those_of_the_dense_solve() {
    let cloud = TORUS.uniform::<f64>(20_000, 3);
    for (factor, level) in [(1.0, Level::Local), (2.0, Level::Local), (4.0, Level::Mean)] {
        let surface = SurfaceResolution::Factor(factor);
        let options = Options::default().surface(surface).level(level);
        assert_agreement(&cloud, &options);
    }
    let options = Options::default()
        .surface(SurfaceResolution::Factor(2.0))
        .level(Level::Local);
    assert_agreement(&TORUS.uniform::<f32>(20_000, 3), &options);
}

#[test]
fn surface_is_closed_over_holes_that_are_wider_than_a_block() {
    let cloud = TORUS.cloud::<f64>(20_000, 3, |p| f64::from(u8::from(p[0] < 0.6)));
    let options = Options::default()
        .surface(SurfaceResolution::Factor(2.0))
        .level(Level::Local);
    assert_agreement(&cloud, &options);
    let [_, sparse] = both(&cloud, &options);
    assert!(sparse.report().surface.closed);
}

#[test]
fn narrow_band_is_that_of_the_whole_field() {
    let cloud = TORUS.uniform::<f64>(5000, 3);
    let options = Options::default().solve(Solve::Sparse);
    let whole = reconstruct(&cloud, options.clone());
    for width in [0.02, 0.1] {
        let band = reconstruct(&cloud, options.clone().band(Band::Within(width)));
        let pairs = band.sdf().values().iter().zip(whole.sdf().values());
        for (&phi, &full) in pairs {
            assert_eq!(phi, full.clamp(-width, width));
        }
    }
}

#[test]
fn saved_results_restore_the_same_bits() {
    let cloud = TORUS.uniform::<f32>(5000, 3);
    let options = Options::default()
        .orient(Method::Given)
        .solve(Solve::Sparse);
    let result = reconstruct(&cloud, options.clone());
    let mut plan = Reconstructor::new(grid(), options).expect("options");
    let saved = Saved {
        sdf: result.sdf().values(),
        closest: result.closest(),
        normals: result.normals(),
    };
    let restored = plan.restore(&cloud, &saved).expect("the same cloud");
    assert_eq!(restored.mesh(), result.mesh());
    assert_eq!(gradient(restored), gradient(&result));
}

#[test]
fn a_sparse_solve_refuses_what_only_a_dense_one_has() {
    let cloud = TORUS.uniform::<f32>(5000, 3);
    let options = Options::default()
        .orient(Method::Given)
        .solve(Solve::Sparse);
    let screened = options.clone().screening(4.0);
    let mut plan = Reconstructor::new(grid(), screened).expect("options");
    let error = plan.reconstruct(&cloud).err().expect("refused");
    assert!(matches!(error, Error::SparseScreening(_)), "{error}");
    let result = reconstruct(&cloud, options);
    let indicator = vec![1.0; result.indicator().values().len()];
    let cotangent = Cotangent {
        indicator: Some(&indicator),
        ..Cotangent::default()
    };
    let error = result.pullback(&cotangent).expect_err("refused");
    assert_eq!(error, PullbackError::SparseIndicator);
    assert!(error.to_string().contains("solve = dense"), "{error}");
}
