//! Marching cubes of a torus against grid size, number type and threads.

use criterion::{Criterion, criterion_group};
use isograd::{Mesh, Real, isosurface};
use isograd_benches::{CELLS, torus};

use crate::common::{for_threads, group};

fn extract<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "isosurface");
    for cells in CELLS {
        let chi = torus::field::<T>(cells);
        let (mut scratch, mut mesh) = (isosurface::Scratch::default(), Mesh::default());
        for_threads::<T>(&mut group, cells.pow(3), "cells", || {
            isosurface::forward(&chi, T::zero(), &mut scratch, &mut mesh).expect("a surface");
        });
    }
}

criterion_group!(benches, extract::<f32>, extract::<f64>);
