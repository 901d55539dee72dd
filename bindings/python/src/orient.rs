//! Outward normals alone, behind `isograd.orient`.

use isograd::{JsonReport, Options, Orienter};
use pyo3::prelude::*;

use crate::arrays::{self, by_dtype};
use crate::background;
use crate::errors::value;
use crate::plan::{cloud, with_sensors};

/// Normals, confidence, and the report as JSON.
type Oriented<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, String);

/// Outward normals of a cloud. `points`, `normals` and `sensors` are of one type; `options` is a JSON text, of which
/// `radius` and `orient` are used.
#[pyfunction]
#[pyo3(signature = (points, normals, sensors, options))]
pub fn orient<'py>(
    points: &Bound<'py, PyAny>,
    normals: Option<&Bound<'py, PyAny>>,
    sensors: Option<&Bound<'py, PyAny>>,
    options: &str,
) -> PyResult<Oriented<'py>> {
    let py = points.py();
    let options: Options = serde_json::from_str(options).map_err(value)?;
    by_dtype!(points, "points", T => {
        let cloud = with_sensors(cloud::<T>(points, normals, Vec::new())?, sensors)?;
        let mut plan = Orienter::<T>::new(options.radius, options.orient);
        let result = background::run(py, move |_| {
            plan.orient(&cloud).map_err(|e| e.to_string())?;
            Ok::<_, String>(plan.into_parts())
        })?;
        let (orientation, report) = result.map_err(value)?;
        let count = orientation.confidence.len();
        Ok((
            arrays::from_vectors(py, &orientation.normals),
            arrays::shaped(py, orientation.confidence, count)?,
            serde_json::to_string(&JsonReport::samples(&report)).map_err(value)?,
        ))
    })
}
