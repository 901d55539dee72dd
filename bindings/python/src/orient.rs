//! Outward normals alone, behind `isograd.orient`.

use isograd::Orienter;
use isograd::neighbors::Radius;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Dtype, Number};
use crate::background;
use crate::errors::value;
use crate::plan::{cloud, seen};
use crate::report;
use crate::settings::Orient;

/// Normals, confidence and report.
type Oriented<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyDict>);

/// Outward normals of a cloud; `points`, `normals` and `sensors` are of one type.
#[pyfunction]
#[pyo3(signature = (points, normals, sensors, radius, method))]
pub fn orient<'py>(
    points: &Bound<'py, PyAny>,
    normals: Option<&Bound<'py, PyAny>>,
    sensors: Option<&Bound<'py, PyAny>>,
    radius: Option<f64>,
    method: &str,
) -> PyResult<Oriented<'py>> {
    let method = Orient::parse(method).map_err(value)?.method();
    let radius = radius.map_or(Radius::Auto, Radius::Fixed);
    match arrays::dtype(points, "points")? {
        Dtype::F32 => run(
            Orienter::<f32>::new(radius, method),
            points,
            normals,
            sensors,
        ),
        Dtype::F64 => run(
            Orienter::<f64>::new(radius, method),
            points,
            normals,
            sensors,
        ),
    }
}

fn run<'py, T: Number>(
    mut plan: Orienter<T>,
    points: &Bound<'py, PyAny>,
    normals: Option<&Bound<'py, PyAny>>,
    sensors: Option<&Bound<'py, PyAny>>,
) -> PyResult<Oriented<'py>> {
    let py = points.py();
    let cloud = seen(cloud::<T>(points, normals, Vec::new())?, sensors)?;
    let result = background::run(py, move |_| {
        plan.orient(&cloud).map_err(|e| e.to_string())?;
        Ok::<_, String>(plan.into_parts())
    })?;
    let (found, report) = result.map_err(value)?;
    let count = found.confidence.len();
    Ok((
        arrays::of_vectors(py, &found.normals),
        arrays::shaped(py, found.confidence, count)?,
        report::of_samples(py, &report)?,
    ))
}
