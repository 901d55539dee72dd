//! Surface of a field, behind `isograd.isosurface`.

use std::sync::Arc;

use isograd::isosurface::{Error, LevelCotangent, Scratch, forward, pullback};
use isograd::{Field, Mesh};
use pyo3::prelude::*;

use crate::arrays::{self, Dtype, Either, Number, each};
use crate::background;
use crate::errors::value;
use crate::grid::{Parts, grid};

/// A field and its surface in one of the two number types.
#[pyclass(frozen)]
pub struct Isosurface(Either<Arc<Extracted<f32>>, Arc<Extracted<f64>>>);

/// A field, its level, and the surface.
pub struct Extracted<T> {
    field: Field<T>,
    level: T,
    mesh: Mesh<T>,
    walls: [[bool; 2]; 3],
}

/// Cotangents of the field, the level, and the corner and the spacing of the grid; number of bounded derivatives.
type Cotangents<'py> = (Bound<'py, PyAny>, f64, [f64; 3], f64, usize);

/// Extracts the surface of a field at a level.
#[pyfunction]
pub fn extract_surface(field: &Bound<'_, PyAny>, grid: Parts, level: f64) -> PyResult<Isosurface> {
    Ok(Isosurface(match arrays::dtype(field, "field")? {
        Dtype::F32 => Either::F32(extract(field, grid, level)?),
        Dtype::F64 => Either::F64(extract(field, grid, level)?),
    }))
}

fn extract<T: Number>(
    values: &Bound<'_, PyAny>,
    parts: Parts,
    level: f64,
) -> PyResult<Arc<Extracted<T>>> {
    let py = values.py();
    let field = Field::new(grid::<T>(parts)?, arrays::values(values, "field")?).map_err(value)?;
    let extracted = background::run(py, move |_| {
        let (level, mut mesh) = (T::of(level), Mesh::default());
        let report = forward(&field, level, &mut Scratch::default(), &mut mesh)?;
        Ok::<_, Error>(Extracted {
            field,
            level,
            mesh,
            walls: report.walls,
        })
    })?;
    extracted.map(Arc::new).map_err(value)
}

#[pymethods]
impl Isosurface {
    /// Vertices and faces.
    fn mesh<'py>(&self, py: Python<'py>) -> [Bound<'py, PyAny>; 2] {
        each!(&self.0, of => [
            arrays::from_vectors(py, of.mesh.vertices()),
            arrays::from_vectors(py, of.mesh.faces()),
        ])
    }

    /// Whether the surface reaches the low and the high wall of each axis.
    fn walls(&self) -> [[bool; 2]; 3] {
        each!(&self.0, of => of.walls)
    }

    /// Cotangents of the inputs from those of the vertices `(V, 3)`.
    fn pullback<'py>(&self, vertices_bar: &Bound<'py, PyAny>) -> PyResult<Cotangents<'py>> {
        each!(&self.0, of => pull_back(of, vertices_bar))
    }
}

fn pull_back<'py, T: Number>(
    of: &Arc<Extracted<T>>,
    vertices_bar: &Bound<'py, PyAny>,
) -> PyResult<Cotangents<'py>> {
    let (py, of) = (vertices_bar.py(), of.clone());
    let (shape, count) = (of.field.grid().shape(), of.mesh.vertices().len());
    let bar = arrays::vectors::<T>(vertices_bar, "vertices")?;
    if bar.len() != count {
        let text = format!(
            "{} cotangents for {count} vertices; give one a vertex",
            bar.len()
        );
        return Err(value(text));
    }
    let (field_bar, others) = background::run(py, move |_| {
        let mut field_bar = vec![T::zero(); of.field.values().len()];
        let others = pullback(&of.field, of.level, &of.mesh, &bar, &mut field_bar);
        (field_bar, others)
    })?;
    let LevelCotangent {
        level,
        grid,
        guarded,
    } = others;
    let field_bar = arrays::shaped(py, field_bar, shape)?;
    Ok((field_bar, level, grid.lower, grid.spacing, guarded))
}
