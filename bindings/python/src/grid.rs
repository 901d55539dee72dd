//! Grids: checks, and grids around clouds.

use isograd::{Grid, Outliers, PointCloud, Resolution};
use pyo3::prelude::*;

use crate::arrays::{self, Number};
use crate::background;
use crate::errors::value;

/// Lower corner, spacing and shape.
pub type Parts = ([f64; 3], f64, [usize; 3]);

/// A grid in the number type of the arrays.
///
/// # Errors
/// Cells that the number type does not resolve.
pub fn grid<T: Number>((lower, spacing, shape): Parts) -> PyResult<Grid<T>> {
    Grid::new(lower.map(T::of), T::of(spacing), shape).map_err(value)
}

/// Raises ValueError if the grid is invalid.
#[pyfunction]
pub fn check_grid(lower: [f64; 3], spacing: f64, shape: [i64; 3]) -> PyResult<()> {
    let shape = cells(shape)?;
    Grid::new(lower, spacing, shape).map_err(value)?;
    Ok(())
}

fn cells(shape: [i64; 3]) -> PyResult<[usize; 3]> {
    if let Some(n) = shape.iter().find(|n| **n < 1) {
        return Err(value(format!("{n} cells along an axis; give at least 1")));
    }
    Ok(shape.map(|n| n as usize))
}

/// Lower corner, spacing and shape of a grid around `(N, 3)` points.
#[pyfunction]
#[pyo3(signature = (points, resolution, spacing, padding, outliers))]
pub fn fit_grid(
    points: &Bound<'_, PyAny>,
    resolution: Option<i64>,
    spacing: Option<f64>,
    padding: f64,
    outliers: &str,
) -> PyResult<Parts> {
    let py = points.py();
    let points = arrays::widened(points, "points")?;
    let resolution = match (spacing, resolution) {
        (Some(h), _) => Resolution::Spacing(h),
        (None, Some(n)) if n > 0 => Resolution::Cells(n as usize),
        (None, n) => {
            let n = n.unwrap_or(0);
            return Err(value(format!("a resolution of {n} cells; give at least 2")));
        }
    };
    let cloud = PointCloud::new(points).map_err(value)?;
    let outliers: Outliers = outliers.parse().map_err(value)?;
    let fit = move |_: &_| Grid::fit_with(&cloud, resolution, padding, outliers);
    let grid = background::run(py, fit)?.map_err(value)?;
    Ok((grid.lower(), grid.spacing(), grid.shape()))
}
