//! The splat against number of points, for each kind of weights, number type and threads, onto 128³ cells.

use criterion::{Criterion, criterion_group};
use isograd::splat::{self, Weights};
use isograd::{Field, Real};
use isograd_benches::{POINTS, torus};

use crate::common::{for_threads, group};

const CELLS: usize = 128;

fn spread<T: Real>(criterion: &mut Criterion) {
    for (name, weights) in [("splat", Weights::BSpline), ("splat-paper", Weights::Paper)] {
        let mut group = group(criterion, name);
        for count in POINTS {
            let (points, normals) = torus::samples::<T>(count);
            let areas = vec![T::one(); count];
            let mut b = Field::zeros(torus::grid(CELLS));
            let (mut scratch, mut residual) = Default::default();
            for_threads::<T>(&mut group, count, "points", || {
                let samples = splat::Samples {
                    points: &points,
                    normals: &normals,
                    areas: &areas,
                };
                splat::forward(samples, weights, &mut scratch, &mut residual, &mut b)
                    .expect("samples inside the grid");
            });
        }
    }
}

criterion_group!(benches, spread::<f32>, spread::<f64>);
