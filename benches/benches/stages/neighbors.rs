//! The tree and the radii against number of points, number type and threads.

use criterion::{Criterion, criterion_group};
use isograd::Real;
use isograd::neighbors::{self, Neighborhoods, Radius};
use isograd_benches::{POINTS, torus};

use crate::common::{for_threads, group};

fn find<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "neighbors");
    for count in POINTS {
        let (points, _) = torus::samples::<T>(count);
        let mut neighborhoods = Neighborhoods::default();
        for_threads::<T>(&mut group, count, "points", || {
            neighbors::forward(&points, Radius::Auto, &mut neighborhoods).expect("enough points");
        });
    }
}

criterion_group!(benches, find::<f32>, find::<f64>);
