//! Tests of the shapes, and of the pipeline on them.

mod conformance;
mod parameters;
mod pipeline;
mod previous;
mod pullback;

use isograd_shapes::{Density, Layout, Sampling, Shape, by_name};

/// Independent random samples.
const RANDOM: Sampling = Sampling {
    layout: Layout::Random,
    density: Density::Uniform,
};

fn shape(name: &str) -> Shape {
    by_name(name).expect("a shape")
}

/// A shape with some parameters changed.
fn with(name: &str, values: &[(&str, f64)]) -> Shape {
    let mut shape = shape(name);
    shape.set_all(values.iter().copied()).expect("valid values");
    shape
}
