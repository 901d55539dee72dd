//! Signed distance of a mesh at every cell of a grid, behind `isograd.sdf_grid`.

use isograd::distance::lattice::{PullbackScratch, Scratch, forward_of_mesh, pullback};
use isograd::distance::{Band, Error, NO_TRIANGLE};
use isograd::{Field, check_distance_memory};
use pyo3::prelude::*;

use crate::arrays::{self, by_dtype};
use crate::background;
use crate::errors::value;
use crate::grid::{self, Parts};

/// φ, the closest face of each cell, and how the sign was found.
type Distances<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, &'static str);

/// Cotangents of the vertices, and of the corner and the spacing of the grid.
type Cotangents<'py> = (Bound<'py, PyAny>, [f64; 3], f64);

/// Distances in the type of the vertices, up to `band` or everywhere.
#[pyfunction]
#[pyo3(signature = (vertices, faces, grid, band))]
pub fn sdf_of_mesh<'py>(
    vertices: &Bound<'py, PyAny>,
    faces: &Bound<'py, PyAny>,
    grid: Parts,
    band: Option<f64>,
) -> PyResult<Distances<'py>> {
    let py = vertices.py();
    by_dtype!(vertices, "vertices", T => {
        let mesh = arrays::mesh::<T>(vertices, faces)?;
        let grid = grid::grid::<T>(grid)?;
        let band = band.map_or(Band::Full, Band::Within);
        check_distance_memory(&grid).map_err(value)?;
        let result = background::run(py, move |_| {
            let (mut phi, mut closest) = (Field::zeros(grid), Vec::new());
            let scratch = &mut Scratch::default();
            let sign = forward_of_mesh(&mesh, band, scratch, &mut phi, &mut closest)?;
            Ok::<_, Error>((phi.into_values(), closest, sign))
        })?;
        let (phi, closest, sign) = result.map_err(value)?;
        Ok((
            arrays::shaped(py, phi, grid.shape())?,
            arrays::shaped(py, closest, grid.shape())?,
            sign.name(),
        ))
    })
}

/// Cotangents of the vertices and the grid from those of φ.
#[pyfunction]
pub fn sdf_of_mesh_pullback<'py>(
    vertices: &Bound<'py, PyAny>,
    faces: &Bound<'py, PyAny>,
    grid: Parts,
    sdf: &Bound<'py, PyAny>,
    closest: &Bound<'py, PyAny>,
    sdf_bar: &Bound<'py, PyAny>,
) -> PyResult<Cotangents<'py>> {
    let py = vertices.py();
    by_dtype!(vertices, "vertices", T => {
        let mesh = arrays::mesh::<T>(vertices, faces)?;
        let phi = Field::new(grid::grid::<T>(grid)?, arrays::values(sdf, "sdf")?).map_err(value)?;
        let closest = arrays::indices(closest, "closest")?;
        let bar = arrays::values::<T>(sdf_bar, "sdf_bar")?;
        let is_known = |face: &u32| *face == NO_TRIANGLE || (*face as usize) < mesh.faces().len();
        if closest.len() != phi.values().len() || bar.len() != closest.len() {
            return Err(value("sdf, closest and sdf_bar differ in their shapes"));
        }
        if !closest.iter().all(is_known) {
            return Err(value("closest names a face that the mesh does not have"));
        }
        let (vertices_bar, grid_bar) = background::run(py, move |_| {
            let mut vertices_bar = vec![[0.0; 3]; mesh.vertices().len()];
            let scratch = &mut PullbackScratch::default();
            let grid_bar = pullback(&mesh, &phi, &closest, &bar, scratch, &mut vertices_bar);
            (vertices_bar, grid_bar)
        })?;
        let vertices_bar = arrays::from_vectors(py, &vertices_bar);
        Ok((vertices_bar, grid_bar.lower, grid_bar.spacing))
    })
}
