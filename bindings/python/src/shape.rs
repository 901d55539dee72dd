//! Parametric shapes, behind `isograd.Shape`.

use isograd_element::vector::of_f64;
use isograd_shapes::{Density, Layout, Sampling, SurfaceCoordinate, by_name};
use pyo3::prelude::*;

use crate::arrays::{self, Number};
use crate::background;
use crate::errors::value;

/// Names and summaries of all shapes.
#[pyfunction]
pub fn shapes() -> Vec<(&'static str, &'static str)> {
    let all = isograd_shapes::all();
    all.iter().map(|s| (s.name(), s.summary())).collect()
}

/// A shape with its parameters.
#[pyclass(frozen)]
pub struct Shape(pub isograd_shapes::Shape);

/// Name, meaning, unit, default, minimum, maximum, and whether it is a whole number: one parameter.
type Parameter = (
    &'static str,
    &'static str,
    &'static str,
    f64,
    f64,
    f64,
    bool,
);

/// Points, normals, velocity, patches, and coordinates `(N, 2)` on them.
type Samples<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
);

#[pymethods]
impl Shape {
    #[new]
    fn new(name: &str, values: Vec<(String, f64)>) -> PyResult<Self> {
        let mut shape = by_name(name).map_err(value)?;
        let values = values.iter().map(|(name, value)| (name.as_str(), *value));
        shape.set_all(values).map_err(value)?;
        Ok(Self(shape))
    }

    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn parameters(&self) -> Vec<Parameter> {
        let all = self.0.parameters();
        all.map(|(p, _)| (p.name, p.meaning, p.unit, p.default, p.min, p.max, p.whole))
            .collect()
    }

    fn values(&self) -> Vec<(&'static str, f64)> {
        self.0
            .parameters()
            .map(|(p, value)| (p.name, value))
            .collect()
    }

    fn area(&self) -> f64 {
        self.0.area()
    }

    fn volume(&self) -> f64 {
        self.0.volume()
    }

    fn sample<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        seed: u64,
        even: bool,
        density: Option<(usize, f64)>,
        single: bool,
    ) -> PyResult<Samples<'py>> {
        let sampling = Sampling {
            layout: if even { Layout::Even } else { Layout::Random },
            density: density.map_or(Density::Uniform, |(axis, ratio)| Density::Gradient {
                axis,
                ratio,
            }),
        };
        match single {
            true => sample::<f32>(py, &self.0, n, seed, sampling),
            false => sample::<f64>(py, &self.0, n, seed, sampling),
        }
    }

    /// Material points, and their normals, at coordinates.
    fn points_at<'py>(
        &self,
        py: Python<'py>,
        patch: &Bound<'py, PyAny>,
        uv: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let coordinates = coordinates(patch, uv)?;
        let points = self.0.points_at::<f64>(&coordinates).map_err(value)?;
        let normals = self.0.normals_at::<f64>(&coordinates).map_err(value)?;
        Ok((
            arrays::from_vectors(py, &points),
            arrays::from_vectors(py, &normals),
        ))
    }

    /// Cotangents of all parameters, in order.
    fn pullback(
        &self,
        patch: &Bound<'_, PyAny>,
        uv: &Bound<'_, PyAny>,
        points_bar: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<f64>> {
        let coordinates = coordinates(patch, uv)?;
        let bar = arrays::widened(points_bar, "points_bar")?;
        self.0.pullback(&coordinates, &bar).map_err(value)
    }
}

fn sample<'py, T: Number>(
    py: Python<'py>,
    shape: &isograd_shapes::Shape,
    n: usize,
    seed: u64,
    sampling: Sampling,
) -> PyResult<Samples<'py>> {
    let shape = shape.clone();
    let (samples, velocity) = background::run(py, move |_| {
        let samples = shape.sample::<T>(n, &sampling, seed)?;
        let velocity = shape.velocity(&samples.coordinates);
        Ok::<_, isograd_shapes::SampleError>((samples, velocity))
    })?
    .map_err(value)?;
    let velocity = velocity.map(|velocity| {
        let velocity: Vec<[T; 3]> = velocity.into_iter().map(of_f64).collect();
        arrays::from_vectors(py, &velocity)
    });
    let coordinates = &samples.coordinates;
    let patch: Vec<u32> = coordinates.iter().map(|c| c.patch).collect();
    let uv: Vec<f64> = coordinates.iter().flat_map(|c| [c.u, c.v]).collect();
    let count = patch.len();
    Ok((
        arrays::from_vectors(py, samples.cloud.points()),
        arrays::from_vectors(py, samples.cloud.normals().unwrap_or_default()),
        velocity,
        arrays::shaped(py, patch, [count])?,
        arrays::shaped(py, uv, [count, 2])?,
    ))
}

fn coordinates(
    patch: &Bound<'_, PyAny>,
    uv: &Bound<'_, PyAny>,
) -> PyResult<Vec<SurfaceCoordinate>> {
    let patch = arrays::indices(patch, "patch")?;
    let uv = arrays::values::<f64>(uv, "uv")?;
    if uv.len() != 2 * patch.len() {
        return Err(value(
            "patch and uv differ in length; give those of one set of samples",
        ));
    }
    let pairs = uv.as_chunks::<2>().0.iter().zip(&patch);
    Ok(pairs
        .map(|(&[u, v], &patch)| SurfaceCoordinate { patch, u, v })
        .collect())
}
