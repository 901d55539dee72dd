//! D-PCA axes and area weights against number of points, number type and threads; the neighborhoods are
//! given.

use criterion::{Criterion, criterion_group};
use isograd::neighbors::{self, Neighborhoods, Radius};
use isograd::splat::area;
use isograd::{Real, normals};
use isograd_benches::{POINTS, torus};

use crate::common::{for_threads, group};

fn axes<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "normals");
    for count in POINTS {
        let neighborhoods = neighborhoods::<T>(count);
        let mut residual = normals::Residual::default();
        for_threads::<T>(&mut group, count, "points", || {
            normals::forward(&neighborhoods, &mut residual);
        });
    }
}

fn areas<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "areas");
    for count in POINTS {
        let neighborhoods = neighborhoods::<T>(count);
        let mut areas = Vec::new();
        for_threads::<T>(&mut group, count, "points", || {
            area::forward(&neighborhoods, &mut areas);
        });
    }
}

fn neighborhoods<T: Real>(count: usize) -> Neighborhoods<T> {
    let (points, _) = torus::samples(count);
    let mut neighborhoods = Neighborhoods::default();
    neighbors::forward(&points, Radius::Auto, &mut neighborhoods).expect("enough points");
    neighborhoods
}

criterion_group!(
    benches,
    axes::<f32>,
    axes::<f64>,
    areas::<f32>,
    areas::<f64>
);
