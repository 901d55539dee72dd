//! The distance at every cell center against grid size, number type and threads: full, and in a band.

use criterion::{Criterion, criterion_group};
use isograd::distance::{Band, Scratch, lattice};
use isograd::{Mesh, Real, isosurface};
use isograd_benches::{CELLS, torus};

use crate::common::{for_threads, group};

fn measure<T: Real>(criterion: &mut Criterion) {
    for (name, band) in [
        ("distance", Band::Full),
        ("distance-band", Band::Within(3.0)),
    ] {
        let mut group = group(criterion, name);
        for cells in CELLS {
            let chi = torus::field::<T>(cells);
            let band = match band {
                Band::Within(cells) => Band::Within(cells * chi.grid().spacing().f64()),
                Band::Full => band,
            };
            let mut mesh = Mesh::default();
            isosurface::forward(&chi, T::zero(), &mut Default::default(), &mut mesh)
                .expect("a surface");
            let (mut phi, mut closest) = (chi.clone(), Vec::new());
            let mut scratch = Scratch::default();
            for_threads::<T>(&mut group, cells.pow(3), "cells", || {
                lattice::forward(
                    &mesh,
                    &chi,
                    T::zero(),
                    band,
                    &mut scratch,
                    &mut phi,
                    &mut closest,
                )
                .expect("a mesh with triangles");
            });
        }
    }
}

criterion_group!(benches, measure::<f32>, measure::<f64>);
