//! The Poisson solve against grid size, number type and threads.

use criterion::{Criterion, criterion_group};
use isograd::{Real, poisson};
use isograd_benches::{CELLS, torus};

use crate::common::{for_threads, group};

fn solve<T: Real>(criterion: &mut Criterion) {
    let mut group = group(criterion, "poisson");
    for cells in CELLS {
        let plan = poisson::Plan::new([cells; 3]);
        // Solved in place again and again: its time does not depend on the values.
        let (mut field, mut scratch) = (torus::field::<T>(cells), poisson::Scratch::default());
        for_threads::<T>(&mut group, cells.pow(3), "cells", || {
            let solved = plan.solve(field.values_mut(), 0.0, &mut scratch);
            solved.expect("a field of the plan's size");
        });
    }
}

criterion_group!(benches, solve::<f32>, solve::<f64>);
