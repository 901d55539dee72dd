//! The whole, cloud to field and report, with the default options: over grid size at 50,000 points, and
//! over number of points at 128³ cells.

mod common;

use common::{for_threads, group};
use criterion::{Criterion, criterion_group, criterion_main};
use isograd::{Options, PointCloud, Real, Reconstructor};
use isograd_benches::{CELLS, POINTS, torus};

fn over_cells<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-cells");
    for cells in CELLS {
        let (cloud, mut plan) = setting::<T>(50_000, cells);
        for_threads::<T>(&mut group, cells.pow(3), "cells", || {
            plan.reconstruct(&cloud).expect("a torus");
        });
    }
}

fn over_points<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "pipeline-points");
    for count in POINTS {
        let (cloud, mut plan) = setting::<T>(count, 128);
        for_threads::<T>(&mut group, count, "points", || {
            plan.reconstruct(&cloud).expect("a torus");
        });
    }
}

fn setting<T: Real>(count: usize, cells: usize) -> (PointCloud<T>, Reconstructor<T>) {
    let (points, _) = torus::samples(count);
    let cloud = PointCloud::new(points).expect("finite points");
    let plan = Reconstructor::new(torus::grid(cells), Options::default());
    (cloud, plan.expect("default options"))
}

criterion_group!(
    benches,
    over_cells::<f32>,
    over_cells::<f64>,
    over_points::<f32>,
    over_points::<f64>
);
criterion_main!(benches);
