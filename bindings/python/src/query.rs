//! Exact distances to a mesh, behind `isograd.signed_distance` and `isograd.query`.

use isograd::distance::{Error, Hit, Query};
use pyo3::prelude::*;

use crate::arrays::{self, by_dtype};
use crate::background;
use crate::errors::value;

/// Distance, gradient, closest point, face and barycentric coordinates of each query.
type Hits<'py> = [Bound<'py, PyAny>; 5];

/// Distances of `(M, 3)` queries, of the type of the vertices, to a mesh.
#[pyfunction]
pub fn query_mesh<'py>(
    vertices: &Bound<'py, PyAny>,
    faces: &Bound<'py, PyAny>,
    queries: &Bound<'py, PyAny>,
) -> PyResult<Hits<'py>> {
    let py = vertices.py();
    by_dtype!(vertices, "vertices", T => {
        let mesh = arrays::mesh::<T>(vertices, faces)?;
        let points = arrays::vectors::<T>(queries, "queries")?;
        let hits = background::run(py, move |_| {
            Query::new(mesh).map(|query| query.query(&points, None))
        })?;
        let hits: Vec<Hit<T>> = hits.map_err(value)?;
        let vectors = |of: fn(&Hit<T>) -> [T; 3]| {
            let all: Vec<[T; 3]> = hits.iter().map(of).collect();
            arrays::from_vectors(py, &all)
        };
        let distance: Vec<T> = hits.iter().map(|hit| hit.distance).collect();
        let face: Vec<u32> = hits.iter().map(|hit| hit.triangle).collect();
        Ok([
            arrays::shaped(py, distance, [hits.len()])?,
            vectors(|hit| hit.gradient),
            vectors(|hit| hit.point),
            arrays::shaped(py, face, [hits.len()])?,
            vectors(|hit| hit.barycentric),
        ])
    })
}

/// Cotangents of vertices and queries from those of the distances.
#[pyfunction]
pub fn query_mesh_pullback<'py>(
    vertices: &Bound<'py, PyAny>,
    faces: &Bound<'py, PyAny>,
    queries: &Bound<'py, PyAny>,
    distance_bar: &Bound<'py, PyAny>,
) -> PyResult<[Bound<'py, PyAny>; 2]> {
    let py = vertices.py();
    by_dtype!(vertices, "vertices", T => {
        let mesh = arrays::mesh::<T>(vertices, faces)?;
        let points = arrays::vectors::<T>(queries, "queries")?;
        let bar = arrays::values::<T>(distance_bar, "distance_bar")?;
        let result = background::run(py, move |_| {
            let query = Query::new(mesh)?;
            let hits = query.query(&points, None);
            let (mut points_bar, mut vertices_bar) = (Vec::new(), Vec::new());
            query.pullback(&points, &hits, &bar, None, &mut points_bar, &mut vertices_bar)?;
            Ok::<_, Error>([vertices_bar, points_bar])
        })?;
        let bars = result.map_err(value)?;
        Ok(bars.map(|bar| arrays::from_vectors(py, &bar)))
    })
}
