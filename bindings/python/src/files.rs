//! Readers and writers.

use std::io::Write;
use std::path::PathBuf;

use isograd::Field;
use isograd_io::{
    Attributes, Columns, Dtype as Stored, Limits, NotFinite, ReadOptions, parse_size,
};
use pyo3::prelude::*;

use crate::arrays::{self, Number, by_dtype};
use crate::errors::{file, value};
use crate::grid::grid;
use crate::plan::{AttributeArray, cloud};

/// Points, normals, attributes by name, and faces of a file.
type Geometry<'py> = (
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Vec<(String, Bound<'py, PyAny>)>,
    Bound<'py, PyAny>,
);

/// A size in bytes, or text such as `"4G"`.
#[derive(FromPyObject)]
pub enum Size {
    Bytes(u64),
    Text(String),
}

fn limits(max_memory: Option<Size>) -> PyResult<Limits> {
    let memory = match max_memory {
        None => None,
        Some(Size::Bytes(bytes)) => Some(bytes),
        Some(Size::Text(text)) => Some(parse_size(&text).map_err(value)?),
    };
    Ok(Limits { memory })
}

/// Reads points or a mesh, in the number type of the file. Points and normals that are not finite are refused; `"normals"`
/// keeps the normals, and `"drop"` leaves out the points.
#[pyfunction]
#[pyo3(signature = (path, columns=None, normal_columns=None, max_memory=None, attributes=true, not_finite="refuse"))]
pub fn read_geometry<'py>(
    py: Python<'py>,
    path: PathBuf,
    columns: Option<[String; 3]>,
    normal_columns: Option<[String; 3]>,
    max_memory: Option<Size>,
    attributes: bool,
    not_finite: &str,
) -> PyResult<Geometry<'py>> {
    let options = ReadOptions {
        limits: limits(max_memory)?,
        columns: Columns {
            points: columns,
            normals: normal_columns,
        },
        attributes: match attributes {
            true => Attributes::All,
            false => Attributes::Sensors,
        },
        not_finite: match not_finite {
            "normals" => NotFinite::KeepNormals,
            "drop" => NotFinite::Keep,
            _ => NotFinite::Refuse,
        },
    };
    let geometry = py.detach(|| options.read_geometry(&path));
    let mut geometry = geometry.map_err(file)?;
    if options.not_finite == NotFinite::Keep {
        geometry.drop_not_finite();
    }
    match geometry.dtype {
        Stored::F32 => geometry_arrays::<f32>(py, geometry),
        _ => geometry_arrays::<f64>(py, geometry),
    }
}

fn geometry_arrays<'py, T: Number>(
    py: Python<'py>,
    mut geometry: isograd_io::Geometry,
) -> PyResult<Geometry<'py>> {
    // A cloud has none that are not finite.
    let normals = geometry.normals.take();
    let cloud = geometry.cloud::<T>().map_err(value)?;
    let rounded = |normals: Vec<[f64; 3]>| -> Vec<[T; 3]> {
        normals.into_iter().map(|n| n.map(T::of)).collect()
    };
    Ok((
        arrays::from_vectors(py, cloud.points()),
        normals.map(|n| arrays::from_vectors(py, &rounded(n))),
        arrays::attributes(py, &cloud)?,
        arrays::from_vectors(py, &geometry.faces),
    ))
}

/// Lower corner, spacing, shape and values of a field.
type FieldParts<'py> = ([f64; 3], f64, [usize; 3], Bound<'py, PyAny>);

/// Reads a field, in the number type of the file.
#[pyfunction]
#[pyo3(signature = (path, max_memory=None))]
pub fn read_field(
    py: Python<'_>,
    path: PathBuf,
    max_memory: Option<Size>,
) -> PyResult<FieldParts<'_>> {
    let options = ReadOptions {
        limits: limits(max_memory)?,
        ..ReadOptions::default()
    };
    let read = py.detach(|| options.read_field(&path)).map_err(file)?;
    let (grid, values) = (*read.field.grid(), read.field.into_values());
    let array = match read.dtype {
        Stored::F32 => {
            let values: Vec<f32> = values.into_iter().map(|v| v as f32).collect();
            arrays::shaped(py, values, grid.shape())?
        }
        _ => arrays::shaped(py, values, grid.shape())?,
    };
    Ok((grid.lower(), grid.spacing(), grid.shape(), array))
}

/// Writes points, with normals and attributes `(name, components, values)`.
#[pyfunction]
pub fn write_points(
    path: PathBuf,
    points: &Bound<'_, PyAny>,
    normals: Option<&Bound<'_, PyAny>>,
    attributes: Vec<AttributeArray<'_>>,
) -> PyResult<()> {
    let py = points.py();
    let written = by_dtype!(points, "points", T => {
        let cloud = cloud::<T>(points, normals, attributes)?;
        py.detach(|| isograd_io::write_cloud(&path, &cloud))
    });
    written.map_err(file)
}

/// Writes a mesh.
#[pyfunction]
pub fn write_mesh(
    path: PathBuf,
    vertices: &Bound<'_, PyAny>,
    faces: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let py = vertices.py();
    let written = by_dtype!(vertices, "vertices", T => {
        let mesh = arrays::mesh::<T>(vertices, faces)?;
        py.detach(|| isograd_io::write_mesh(&path, &mesh))
    });
    written.map_err(file)
}

/// Writes a file of these bytes.
#[pyfunction]
pub fn write_bytes(py: Python<'_>, path: PathBuf, content: &[u8]) -> PyResult<()> {
    py.detach(|| isograd_io::atomic::write(&path, |out| out.write_all(content)))
        .map_err(file)
}

/// Writes a field.
#[pyfunction]
pub fn write_field(
    path: PathBuf,
    lower: [f64; 3],
    spacing: f64,
    shape: [usize; 3],
    values: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let py = values.py();
    let written = by_dtype!(values, "sdf", T => {
        let grid = grid::<T>((lower, spacing, shape))?;
        let field = Field::new(grid, arrays::values(values, "sdf")?).map_err(value)?;
        py.detach(|| isograd_io::write_field(&path, &field))
    });
    written.map_err(file)
}
