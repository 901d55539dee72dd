//! A cloud with outliers gives the results of the cloud without them.

use crate::data::{Attribute, PointCloud};
use crate::neighbors::tests::even_sphere;
use crate::orient::Method;
use crate::{
    Cotangent, Error, ExtensionCotangent, Grid, Options, Outliers, Reconstruction, Reconstructor,
    Resolution, Saved, Warning, splat,
};

/// Indices of the outliers in [`points`]: far from all others, inside the sphere, and beside it.
const LEFT_OUT: [usize; 5] = [0, 7, 200, 201, 604];

/// A sphere, without and with outliers.
fn points() -> [Vec<[f64; 3]>; 2] {
    let clean = even_sphere(600);
    let mut spoilt = clean.clone();
    let outliers = [
        [100.0, 3.0, 0.0],
        [0.0; 3],
        [0.0, -50.0, 9.0],
        [-1.0, 1.8, -1.5],
        [0.0, 0.0, 1e4],
    ];
    for (i, p) in LEFT_OUT.into_iter().zip(outliers) {
        spoilt.insert(i, p);
    }
    [clean, spoilt]
}

/// The cloud with outward normals and the attribute `x`.
fn cloud(points: &[[f64; 3]]) -> PointCloud<f64> {
    let attribute = Attribute {
        name: "x".into(),
        components: 1,
        values: points.iter().map(|p| p[0].min(2.0)).collect(),
    };
    PointCloud::new(points.to_vec())
        .and_then(|cloud| cloud.with_normals(points.to_vec()))
        .and_then(|cloud| cloud.with_attribute(attribute))
        .expect("a cloud")
}

fn reconstruct(cloud: &PointCloud<f64>, method: Method) -> Reconstruction<f64> {
    let grid = Grid::fit(cloud, Resolution::Cells(24), 0.1).expect("fits");
    let options = Options::default().orient(method);
    let mut plan = Reconstructor::new(grid, options).expect("a plan");
    plan.reconstruct(cloud).expect("reconstructs");
    plan.into_reconstruction()
}

/// Cotangents of everything, and what they pull back to.
fn pull(cloud: &PointCloud<f64>, of: &Reconstruction<f64>) -> crate::CloudCotangent<f64> {
    let attribute = &cloud.attributes()[0];
    let (extension, residual) = of.extend_with_residual(attribute, 0.2).expect("extends");
    let wave = |n: usize| (0..n).map(|k| (0.7 * k as f64).sin()).collect::<Vec<_>>();
    let at_samples = |scale: f64| {
        let one = |p: &[f64; 3]| match p.iter().all(|x| x.abs() < 2.0) {
            true => p.map(|x| scale * (3.0 * x + 1.0).sin()),
            // Results of samples that are left out are constants: their cotangents have no effect.
            false => [1e3; 3],
        };
        cloud.points().iter().map(one).collect::<Vec<_>>()
    };
    let extensions = [ExtensionCotangent {
        attribute,
        extension: &extension,
        residual: &residual,
        vertices: None,
        values: Some(&wave(extension.values.len())),
    }];
    let areas: Vec<f64> = at_samples(0.3).iter().map(|v| v[1]).collect();
    of.pullback(&Cotangent {
        sdf: Some(&wave(of.sdf().values().len())),
        normals: Some(&at_samples(1.0)),
        areas: Some(&areas),
        extensions: &extensions,
        ..Cotangent::default()
    })
    .expect("pulls back")
}

/// Rows of all samples without those of the outliers, which must be `fill`.
fn used<E: Copy + PartialEq + std::fmt::Debug>(all: &[E], fill: E) -> Vec<E> {
    assert!(LEFT_OUT.iter().all(|&i| all[i] == fill), "{fill:?}");
    let is_used = |(i, &row): (usize, &E)| (!LEFT_OUT.contains(&i)).then_some(row);
    all.iter().enumerate().filter_map(is_used).collect()
}

#[test]
fn results_and_gradients_are_those_without_outliers_to_the_bit() {
    let [clean, spoilt] = points().map(|points| cloud(&points));
    for method in [Method::Auto, Method::Given] {
        let [a, b] = [&clean, &spoilt].map(|cloud| reconstruct(cloud, method));
        assert_eq!(b.outliers(), LEFT_OUT.map(|i| i as u32));
        assert_eq!(b.report().outliers, b.outliers());
        assert_eq!(b.report().warnings[0], Warning::Outliers { samples: 5 });
        assert_eq!(b.report().points, 605);
        assert_eq!(a.report().warnings[..], b.report().warnings[1..]);
        assert_eq!(a.sdf(), b.sdf());
        assert_eq!(a.mesh(), b.mesh());
        assert_eq!(b.points(), spoilt.points());
        assert_eq!(a.normals(), used(b.normals(), [0.0; 3]));
        assert_eq!(a.confidence(), used(b.confidence(), 0.0));
        assert_eq!(a.areas(), used(b.areas(), 0.0));
        assert_eq!(a.neighbor_counts(), used(b.neighbor_counts(), 0));
        let [of_a, of_b] = [pull(&clean, &a), pull(&spoilt, &b)];
        assert_eq!(of_a.points, used(&of_b.points, [0.0; 3]));
        assert_eq!(of_a.attributes[0], used(&of_b.attributes[0], 0.0));
        assert_eq!(of_a.grid, of_b.grid);
        match method {
            Method::Given => assert_eq!(of_a.normals, used(&of_b.normals, [0.0; 3])),
            _ => assert!(of_b.normals.is_empty()),
        }
    }
}

#[test]
fn restored_and_held_reconstructions_leave_the_same_samples_out() {
    let [_, spoilt] = points().map(|points| cloud(&points));
    let result = reconstruct(&spoilt, Method::Auto);
    let mut plan = Reconstructor::new(*result.sdf().grid(), Options::default()).expect("a plan");
    let saved = Saved {
        sdf: result.sdf().values(),
        closest: result.closest(),
        normals: result.normals(),
    };
    let restored = plan.restore(&spoilt, &saved).expect("restores");
    assert_eq!(restored.outliers(), result.outliers());
    assert_eq!(restored.normals(), result.normals());
    assert_eq!(pull(&spoilt, restored), pull(&spoilt, &result));
    let held = plan
        .reconstruct_held(&spoilt, &result)
        .expect("reconstructs");
    assert_eq!(held.sdf(), result.sdf());
    assert_eq!(held.outliers(), result.outliers());
}

#[test]
fn outliers_that_are_kept_or_lie_elsewhere_are_an_error_with_their_number() {
    let [clean, mut spoilt] = points();
    let grid = Grid::fit(&cloud(&clean), Resolution::Cells(24), 0.1).expect("fits");
    assert_eq!(
        Grid::fit(&cloud(&spoilt), Resolution::Cells(24), 0.1),
        Ok(grid)
    );
    let whole = Grid::fit_with(&cloud(&spoilt), Resolution::Cells(24), 0.1, Outliers::Keep);
    assert!(whole.expect("fits").spacing() > 100.0 * grid.spacing());
    let index = |points: &[[f64; 3]], outliers| {
        let options = Options::default().outliers(outliers);
        let mut plan = Reconstructor::new(grid, options).expect("a plan");
        match plan.reconstruct(&cloud(points)) {
            Err(Error::Splat(splat::Error::Outside { index, .. })) => index,
            other => panic!("{:?}", other.map(|result| result.outliers().to_vec())),
        }
    };
    assert_eq!(index(&spoilt, Outliers::Keep), 0);
    // Too near to be an outlier.
    spoilt[300] = [1.5, 0.0, 0.0];
    assert_eq!(index(&spoilt, Outliers::Ignore), 300);
}
