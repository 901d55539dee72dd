//! The pullback of the whole stage.

mod properties;
mod transposes;

use super::super::{Cotangent, Inputs, pullback};
use super::*;
use crate::testing::product;

fn values<T: Real>(n: usize, seed: u64) -> Vec<T> {
    let mut random = Random::new(seed);
    (0..n)
        .map(|_| T::of(2.0 * random.uniform() - 1.0))
        .collect()
}

fn vectors<T: Real>(n: usize, seed: u64) -> Vec<[T; 3]> {
    let numbers = values::<T>(3 * n, seed);
    numbers
        .chunks_exact(3)
        .map(|v| [v[0], v[1], v[2]])
        .collect()
}

impl<T: Real> Scene<T> {
    /// Random samples, a surface of well shaped triangles, and a radius that no vertex has to grow.
    fn even(n: usize, cells: usize) -> Self {
        let mut scene = Self::random(n, cells);
        scene.mesh = distance::tests::torus(50, 20);
        scene.measure_distance();
        scene.gather_within(1.7 * scene.neighborhoods.common_radius.f64());
        for (area, r) in scene.areas.iter_mut().zip(values::<T>(n, 5)) {
            *area *= T::of(1.0) + T::of(0.5) * r;
        }
        scene
    }

    fn measure_distance(&mut self) {
        let (chi, scratch) = (self.phi.clone(), &mut Default::default());
        let (band, phi, closest) = (
            distance::Band::Within(4.0 * chi.grid().spacing().f64()),
            &mut self.phi,
            &mut self.closest,
        );
        distance::lattice::forward(&self.mesh, &chi, T::zero(), band, scratch, phi, closest)
            .expect("distance");
    }

    fn gather_within(&mut self, radius: f64) {
        neighbors::forward(&self.points, Radius::Fixed(radius), &mut self.neighborhoods)
            .expect("samples");
    }

    fn pull(&self, attribute: &Attribute<T>, at: &Bars<T>) -> Cotangent<T> {
        let (extension, residual) = self.extend(attribute);
        let mut out = Cotangent::default();
        let inputs = self.inputs(attribute, &residual, &extension);
        pullback(&at.on(inputs), &mut out).expect("pulls back");
        out
    }

    fn inputs<'a>(
        &'a self,
        attribute: &'a Attribute<T>,
        residual: &'a Residual<T>,
        extension: &'a Extension<T>,
    ) -> Inputs<'a, T> {
        Inputs {
            samples: self.samples(),
            attribute,
            surface: self.surface(),
            residual,
            extension,
            vertices_bar: None,
            values_bar: None,
        }
    }
}

/// Cotangents of an extension.
struct Bars<T> {
    vertices: Vec<T>,
    cells: Vec<T>,
}

impl<T: Real> Bars<T> {
    fn of(extension: &Extension<T>) -> Self {
        Self {
            vertices: values(extension.vertices.len(), 21),
            cells: values(extension.values.len(), 22),
        }
    }

    /// The inputs with these cotangents.
    fn on<'a>(&'a self, inputs: Inputs<'a, T>) -> Inputs<'a, T> {
        Inputs {
            vertices_bar: Some(&self.vertices),
            values_bar: Some(&self.cells),
            ..inputs
        }
    }
}

impl Bars<f64> {
    fn loss(&self, extension: &Extension<f64>) -> f64 {
        product(&self.vertices, &extension.vertices) + product(&self.cells, &extension.values)
    }
}

fn wavy([x, y, z]: [f64; 3]) -> [f64; 2] {
    [(3.0 * x).sin() + y * z, (4.0 * z - x).cos() * y]
}

/// All cotangents, one after the other.
fn numbers<T: Real>(bar: &Cotangent<T>) -> Vec<T> {
    let mut all = [&bar.attribute[..], &bar.areas[..], &[bar.grid.spacing]].concat();
    all.extend(bar.points.iter().chain(&bar.vertices).flatten());
    all.extend(bar.grid.lower);
    all
}
