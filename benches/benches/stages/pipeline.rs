//! The whole pipeline with default options, cloud to field and report, and its pullback from φ: against grid size with
//! 50,000 points, and against number of points with 128³ cells.

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group};
use isograd::{
    CloudCotangent, Cotangent, Options, Pipeline, PointCloud, Reconstructor, SurfaceResolution,
};
use isograd_benches::{CELLS, POINTS, torus};

use crate::common::{for_threads, group};

fn over_cells<T: Pipeline>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-cells");
    for cells in CELLS {
        let (cloud, mut plan) = setting::<T>(50_000, cells);
        for_threads::<T>(&mut group, cells.pow(3), "cells", || {
            plan.reconstruct(&cloud).expect("a torus");
        });
    }
}

fn over_points<T: Pipeline>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-points");
    for count in POINTS {
        let (cloud, mut plan) = setting::<T>(count, 128);
        for_threads::<T>(&mut group, count, "points", || {
            plan.reconstruct(&cloud).expect("a torus");
        });
    }
}

fn pullback_over_cells<T: Pipeline>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-pullback-cells");
    for cells in CELLS {
        pull::<T>(&mut group, cells.pow(3), "cells", setting(50_000, cells));
    }
}

fn pullback_over_points<T: Pipeline>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-pullback-points");
    for count in POINTS {
        pull::<T>(&mut group, count, "points", setting(count, 128));
    }
}

/// The pullback of `Σ φ²/2`, every cell of φ.
fn pull<T: Pipeline>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    size: usize,
    unit: &str,
    (cloud, mut plan): (PointCloud<T>, Reconstructor<T>),
) {
    let result = plan.reconstruct(&cloud).expect("a torus");
    let cotangent = Cotangent {
        sdf: Some(result.sdf().values()),
        ..Cotangent::default()
    };
    let mut out = CloudCotangent::default();
    for_threads::<T>(group, size, unit, || {
        result
            .pullback_into(&cotangent, &mut out)
            .expect("the same cloud");
    });
}

fn setting<T: Pipeline>(count: usize, cells: usize) -> (PointCloud<T>, Reconstructor<T>) {
    let (points, _) = torus::samples(count);
    let cloud = PointCloud::new(points).expect("finite points");
    let plan = Reconstructor::new(
        torus::grid(cells),
        Options::default().surface(SurfaceResolution::Grid),
    );
    (cloud, plan.expect("default options"))
}

criterion_group!(
    benches,
    over_cells::<f32>,
    over_cells::<f64>,
    over_points::<f32>,
    over_points::<f64>,
    pullback_over_cells::<f32>,
    pullback_over_cells::<f64>,
    pullback_over_points::<f32>,
    pullback_over_points::<f64>
);
