//! The tree and the radii over number of points, number type and threads.

mod common;

use common::{for_threads, group};
use criterion::{Criterion, criterion_group, criterion_main};
use isograd::Real;
use isograd::neighbors::{self, Neighborhoods, Radius};
use isograd_benches::{POINTS, torus};

fn find<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "neighbors");
    for count in POINTS {
        let (points, _) = torus::samples::<T>(count);
        let mut found = Neighborhoods::default();
        for_threads::<T>(&mut group, count, "points", || {
            neighbors::forward(&points, Radius::Auto, &mut found).expect("enough points");
        });
    }
}

criterion_group!(benches, find::<f32>, find::<f64>);
criterion_main!(benches);
