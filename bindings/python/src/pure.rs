//! The pair of pure functions of [`saved`](crate::saved), for NumPy arrays: what PyTorch and callbacks call.

use isograd::Saved;
use pyo3::prelude::*;

use crate::arrays::{self, Dtype, Number};
use crate::backend::Failure;
use crate::background;
use crate::errors::value;
use crate::pool;
use crate::saved::{self, Inputs, Outputs};
use crate::settings::Settings;

/// Makes the plan of these settings, which then waits for its first call: a device that can't be had is said now.
/// Returns why the CPU computes, where that was left to the package.
#[pyfunction]
pub fn open_backend(py: Python<'_>, settings: String, double: bool) -> PyResult<Option<String>> {
    fn open<T: Number>(settings: &str) -> Result<Option<String>, Failure> {
        pool::with_plan::<T, _>(settings, |plan| plan.plan.take_note())
    }
    let opened = background::run(py, move |_| match double {
        true => open::<f64>(&settings),
        false => open::<f32>(&settings),
    })?;
    Ok(opened?)
}

type Arrays<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// φ, closest faces and normals of a cloud.
#[pyfunction]
#[pyo3(signature = (settings, points, normals=None))]
pub fn forward_saved<'py>(
    settings: String,
    points: &Bound<'py, PyAny>,
    normals: Option<&Bound<'py, PyAny>>,
) -> PyResult<Arrays<'py>> {
    match arrays::dtype(points, "points")? {
        Dtype::F32 => forward::<f32>(settings, points, normals),
        Dtype::F64 => forward::<f64>(settings, points, normals),
    }
}

fn forward<'py, T: Number>(
    settings: String,
    points: &Bound<'py, PyAny>,
    normals: Option<&Bound<'py, PyAny>>,
) -> PyResult<Arrays<'py>> {
    let py = points.py();
    let points = arrays::vectors::<T>(points, "points")?;
    let given = normals.map(|n| arrays::vectors::<T>(n, "normals"));
    let given = given.transpose()?;
    let grid = Settings::parse(&settings).map_err(value)?;
    let grid = grid.grid::<T>().map_err(value)?;
    let result = background::run(py, move |_| {
        let cells = grid.cells();
        let (mut sdf, mut closest) = (vec![T::zero(); cells], vec![0; cells]);
        let mut normals = vec![[T::zero(); 3]; points.len()];
        let out = Outputs {
            sdf: &mut sdf,
            closest: &mut closest,
            normals: &mut normals,
        };
        saved::forward(&settings, &points, given.as_deref(), out)?;
        Ok::<_, Failure>((sdf, closest, normals))
    })?;
    let (sdf, closest, normals) = result?;
    let shape = grid.shape();
    Ok((
        arrays::shaped(py, sdf, shape)?,
        arrays::shaped(py, closest, shape)?,
        arrays::of_vectors(py, &normals),
    ))
}

/// Cotangents of the points, and of the given normals where there are any, from that of φ.
#[pyfunction]
#[pyo3(signature = (settings, points, given, sdf, closest, normals, sdf_bar))]
pub fn pullback_saved<'py>(
    settings: String,
    points: &Bound<'py, PyAny>,
    given: Option<&Bound<'py, PyAny>>,
    sdf: &Bound<'py, PyAny>,
    closest: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
    sdf_bar: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyAny>>)> {
    let fields = [sdf, sdf_bar];
    match arrays::dtype(points, "points")? {
        Dtype::F32 => pullback::<f32>(settings, points, given, fields, closest, normals),
        Dtype::F64 => pullback::<f64>(settings, points, given, fields, closest, normals),
    }
}

fn pullback<'py, T: Number>(
    settings: String,
    points: &Bound<'py, PyAny>,
    given: Option<&Bound<'py, PyAny>>,
    [sdf, sdf_bar]: [&Bound<'py, PyAny>; 2],
    closest: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyAny>>)> {
    let py = points.py();
    let points = arrays::vectors::<T>(points, "points")?;
    let given = given.map(|n| arrays::vectors::<T>(n, "normals"));
    let given = given.transpose()?;
    let sdf = arrays::values::<T>(sdf, "sdf")?;
    let sdf_bar = arrays::values::<T>(sdf_bar, "the cotangent of sdf")?;
    let closest = arrays::indices(closest, "closest")?;
    let normals = arrays::vectors::<T>(normals, "normals")?;
    let result = background::run(py, move |_| {
        let mut points_bar = vec![[T::zero(); 3]; points.len()];
        let mut given_bar = given
            .as_ref()
            .map(|given| vec![[T::zero(); 3]; given.len()]);
        let inputs = Inputs {
            points: &points,
            given: given.as_deref(),
            saved: Saved {
                sdf: &sdf,
                closest: &closest,
                normals: &normals,
            },
            sdf_bar: &sdf_bar,
        };
        saved::pullback(
            &settings,
            &inputs,
            &mut points_bar,
            given_bar.as_deref_mut(),
        )?;
        Ok::<_, Failure>((points_bar, given_bar))
    })?;
    let (points_bar, given_bar) = result?;
    let given_bar = given_bar.map(|bar| arrays::of_vectors(py, &bar));
    Ok((arrays::of_vectors(py, &points_bar), given_bar))
}
