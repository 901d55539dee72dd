//! Cleaning and thinning of clouds, behind `isograd.clean`.

use isograd::clean::{Options, Sparse, Statistical, clean};
use pyo3::prelude::*;

use crate::arrays::{self, by_dtype};
use crate::background;
use crate::errors::value;

/// The steps, by name; `statistical` is neighbors and ratio, `radius` is radius and neighbors.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Steps {
    drop_not_finite: bool,
    duplicates: Option<f64>,
    statistical: Option<(usize, f64)>,
    radius: Option<(f64, usize)>,
    voxel: Option<f64>,
    poisson_disk: Option<f64>,
}

/// Indices of the samples kept; names of the steps, and the numbers of samples that they removed.
type Cleaned<'py> = (Bound<'py, PyAny>, Vec<(&'static str, usize)>);

/// Cleans `(N, 3)` points.
#[pyfunction]
pub fn clean_points<'py>(points: &Bound<'py, PyAny>, steps: Steps) -> PyResult<Cleaned<'py>> {
    let options = Options {
        drop_not_finite: steps.drop_not_finite,
        duplicates: steps.duplicates,
        statistical: steps
            .statistical
            .map(|(neighbors, ratio)| Statistical { neighbors, ratio }),
        radius: steps
            .radius
            .map(|(radius, neighbors)| Sparse { radius, neighbors }),
        voxel: steps.voxel,
        poisson_disk: steps.poisson_disk,
    };
    let py = points.py();
    let cleaned = by_dtype!(points, "points", T => {
        let points = arrays::vectors::<T>(points, "points")?;
        background::run(py, move |_| clean(&points, &options))?
    });
    let cleaned = cleaned.map_err(value)?;
    let count = cleaned.kept.len();
    Ok((arrays::shaped(py, cleaned.kept, [count])?, cleaned.removed))
}
