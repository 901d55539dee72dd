//! A reconstruction, its arrays and its pullback.

use std::any::Any;
use std::path::PathBuf;
use std::sync::Arc;

use isograd::distance::extend::{self, Region};
use isograd::{CloudCotangent, Cotangent, ExtensionCotangent, JsonReport, PointCloud, Real};
use isograd_backend::Made;
use isograd_cli::SurfaceError;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Either, Number, each};
use crate::backend::Failure;
use crate::background;
use crate::errors::{file, value};
use crate::grid::Parts;
use crate::plan::AttributeArray;
use crate::threads::{self, Threads};

/// A cloud and its reconstruction.
pub struct Reconstruction<T: Number> {
    /// The cloud.
    pub cloud: PointCloud<T>,
    /// The reconstruction.
    pub result: Made<T>,
    /// Threads of all that is computed from it.
    pub threads: Threads,
}

/// A reconstruction in one of the two number types.
#[pyclass(frozen, name = "Result")]
pub struct ReconstructionArrays(pub Either<Arc<Reconstruction<f32>>, Arc<Reconstruction<f64>>>);

/// An attribute on the surface and around it.
#[pyclass(frozen)]
pub struct Extension(Either<Arc<Extended<f32>>, Arc<Extended<f64>>>);

/// An extended attribute and the residual of its pullback.
pub struct Extended<T> {
    attribute: isograd::Attribute<T>,
    extension: extend::Extension<T>,
    residual: extend::Residual<T>,
}

#[pymethods]
impl ReconstructionArrays {
    /// A new copy of one of the arrays, by name.
    fn array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        each!(&self.0, this => array(py, this, name))
    }

    /// Points, normals, sensors and attributes of the cloud, as `Plan.reconstruct` takes them.
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Inputs<'py>> {
        each!(&self.0, this => inputs(py, &this.cloud))
    }

    /// The iso-value of the surface.
    fn iso_value(&self) -> PyResult<f64> {
        Ok(each!(&self.0, this => Real::f64(failure(this.result.view().iso_value())?)))
    }

    /// Name of the backend: `cpu`, or a backend and its device.
    fn backend(&self) -> &str {
        each!(&self.0, this => this.result.view().backend())
    }

    /// Lower corner, spacing and shape of the surface's grid.
    fn surface_grid(&self) -> Parts {
        each!(&self.0, this => {
            let grid = this.result.view().surface_grid();
            (grid.lower().map(Real::f64), Real::f64(grid.spacing()), grid.shape())
        })
    }

    /// The report as JSON.
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        each!(&self.0, this => {
            let this = this.clone();
            let text = background::run(py, move |_| {
                let report = JsonReport::new(this.result.view().report()?);
                serde_json::to_string(&report).map_err(|e| Failure::Value(e.to_string()))
            })?;
            Ok(text?)
        })
    }

    /// Attributes of the cloud: name and `(N, components)` values.
    fn attributes<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        each!(&self.0, this => arrays::attributes(py, &this.cloud))
    }

    /// Writes slices of φ and the spread of `|∇φ|` as PNG, as the command line does.
    fn write_slices(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        each!(&self.0, this => {
            let this = this.clone();
            let written = background::run(py, move |_| {
                Ok::<_, Failure>(isograd_cli::write_slices(&path, this.result.view().sdf()?))
            })?;
            written?.map_err(file)
        })
    }

    /// Writes the mesh with the attributes of the cloud, as the command line does. Returns why attributes were left out.
    fn write_mesh(&self, py: Python<'_>, path: PathBuf) -> PyResult<Vec<String>> {
        each!(&self.0, this => {
            let this = this.clone();
            let written = background::run(py, move |_| {
                let view = this.result.view();
                isograd_cli::write_surface(&path, view, view.mesh()?, &this.cloud)
            })?;
            match written {
                Ok(omitted) => Ok(omitted.warnings),
                Err(SurfaceError::File(error)) => Err(file(error)),
                Err(SurfaceError::Result(error)) => Err(Failure::from(error).into()),
                Err(error) => Err(value(error)),
            }
        })
    }

    /// Cotangents of the inputs, by name, from those of the results, by name.
    #[pyo3(signature = (bars, iso_value, extensions))]
    fn pullback<'py>(
        &self,
        py: Python<'py>,
        bars: &Bound<'py, PyDict>,
        iso_value: f64,
        extensions: Vec<ExtensionBar<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        each!(&self.0, this => pullback(py, this, bars, iso_value, extensions))
    }

    /// The attribute `name` of the cloud up to the distance `band` from the surface, or, with `inside`, everywhere inside
    /// and up to that distance outside.
    fn extend(&self, py: Python<'_>, name: String, band: f64, inside: bool) -> PyResult<Extension> {
        let region = match inside {
            true => Region::Inside(band),
            false => Region::Band(band),
        };
        let extension = match &self.0 {
            Either::F32(this) => Either::F32(extended(py, this, name, region)?),
            Either::F64(this) => Either::F64(extended(py, this, name, region)?),
        };
        Ok(Extension(extension))
    }
}

#[pymethods]
impl Extension {
    /// `vertices`, `cells` or `values`.
    fn array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        each!(&self.0, of => of.array(py, name))
    }
}

impl<T: Number> Extended<T> {
    fn array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let of = &self.extension;
        let components = of.components.max(1);
        let rows = |values: &[T]| {
            let shape = [values.len() / components, components];
            arrays::shaped(py, values.to_vec(), shape)
        };
        match name {
            "vertices" => rows(&of.vertices),
            "values" => rows(&of.values),
            "cells" => arrays::shaped(py, of.cells.clone(), [of.cells.len()]),
            _ => Err(PyKeyError::new_err(name.to_owned())),
        }
    }
}

/// Points, normals, sensors and attributes: name, components, values.
type Inputs<'py> = (
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Option<Bound<'py, PyAny>>,
    Vec<AttributeArray<'py>>,
);

fn inputs<'py, T: Number>(py: Python<'py>, cloud: &PointCloud<T>) -> PyResult<Inputs<'py>> {
    let vectors = |values| arrays::from_vectors(py, values);
    let attributes = cloud.attributes().iter().map(|of| {
        let shape = [cloud.len(), of.components];
        let values = arrays::shaped(py, of.values.clone(), shape)?;
        Ok((of.name.clone(), of.components, values))
    });
    Ok((
        vectors(cloud.points()),
        cloud.normals().map(vectors),
        cloud.sensors().map(|sensors| vectors(sensors.positions())),
        attributes.collect::<PyResult<_>>()?,
    ))
}

/// Converts the error.
fn failure<V>(result: Result<V, isograd_backend::Error>) -> Result<V, Failure> {
    Ok(result?)
}

fn array<'py, T: Number>(
    py: Python<'py>,
    this: &Arc<Reconstruction<T>>,
    name: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let result = this.result.view();
    let (shape, count) = (result.grid().shape(), this.cloud.len());
    match name {
        "sdf" => arrays::shaped(py, failure(result.sdf())?.values().to_vec(), shape),
        "indicator" => {
            let indicator = failure(result.indicator())?;
            arrays::shaped(py, indicator.values().to_vec(), indicator.grid().shape())
        }
        "closest" => arrays::shaped(py, failure(result.closest())?.to_vec(), shape),
        "vertices" => Ok(arrays::from_vectors(py, failure(result.mesh())?.vertices())),
        "faces" => Ok(arrays::from_vectors(py, failure(result.mesh())?.faces())),
        "closest_vertices" => Ok(arrays::from_vectors(
            py,
            failure(result.closest_mesh())?.vertices(),
        )),
        "closest_faces" => Ok(arrays::from_vectors(
            py,
            failure(result.closest_mesh())?.faces(),
        )),
        "points" => Ok(arrays::from_vectors(py, this.cloud.points())),
        "normals" => Ok(arrays::from_vectors(py, failure(result.normals())?)),
        "confidence" => arrays::shaped(py, failure(result.confidence())?.to_vec(), [count]),
        "areas" => arrays::shaped(py, failure(result.areas())?.to_vec(), [count]),
        "outliers" => {
            let outliers = result.outliers().to_vec();
            arrays::shaped(py, outliers, [result.outliers().len()])
        }
        "neighbors" => arrays::shaped(py, failure(result.neighbor_counts())?.to_vec(), [count]),
        _ => Err(PyKeyError::new_err(name.to_owned())),
    }
}

/// An extension and the cotangents of its values at vertices and cells.
type ExtensionBar<'py> = (
    Bound<'py, Extension>,
    Option<Bound<'py, PyAny>>,
    Option<Bound<'py, PyAny>>,
);

/// An extension with the cotangents of its values at vertices and cells.
type ExtendedBar<T> = (Arc<Extended<T>>, Option<Vec<T>>, Option<Vec<T>>);

/// Copies of all cotangents, for the thread of the work.
struct Bars<T> {
    sdf: Option<Vec<T>>,
    indicator: Option<Vec<T>>,
    areas: Option<Vec<T>>,
    vertices: Option<Vec<[T; 3]>>,
    normals: Option<Vec<[T; 3]>>,
    iso_value: T,
    extensions: Vec<ExtendedBar<T>>,
}

fn pullback<'py, T: Number>(
    py: Python<'py>,
    this: &Arc<Reconstruction<T>>,
    bars: &Bound<'py, PyDict>,
    iso_value: f64,
    extensions: Vec<ExtensionBar<'py>>,
) -> PyResult<Bound<'py, PyDict>> {
    let values = |name: &str| {
        let given = bars.get_item(name)?;
        given.map(|a| arrays::values::<T>(&a, name)).transpose()
    };
    let vectors = |name: &str| {
        let given = bars.get_item(name)?;
        given.map(|a| arrays::vectors::<T>(&a, name)).transpose()
    };
    let mut extended_bars = Vec::with_capacity(extensions.len());
    for (extension, at_vertices, in_band) in extensions {
        let of = each!(&extension.get().0, of => (of as &dyn Any).downcast_ref());
        let of: &Arc<Extended<T>> = of.ok_or_else(|| {
            value("an extension is of another number type than the reconstruction")
        })?;
        let numbers = |a: Option<Bound<'py, PyAny>>| {
            a.map(|a| arrays::values::<T>(&a, "an extension's cotangent"))
                .transpose()
        };
        extended_bars.push((of.clone(), numbers(at_vertices)?, numbers(in_band)?));
    }
    let bars = Bars {
        sdf: values("sdf")?,
        indicator: values("indicator")?,
        areas: values("areas")?,
        vertices: vectors("vertices")?,
        normals: vectors("normals")?,
        iso_value: T::of(iso_value),
        extensions: extended_bars,
    };
    let this = this.clone();
    let out = background::run(py, move |_| {
        threads::install_on(this.threads.as_ref(), || bars.pullback(&this))
    })?;
    out_dict(py, &out?)
}

impl<T: Number> Bars<T> {
    fn pullback(&self, this: &Reconstruction<T>) -> Result<CloudCotangent<T>, Failure> {
        let extensions: Vec<ExtensionCotangent<'_, T>> = self
            .extensions
            .iter()
            .map(|(of, vertices, values)| ExtensionCotangent {
                attribute: &of.attribute,
                extension: &of.extension,
                residual: &of.residual,
                vertices: vertices.as_deref(),
                values: values.as_deref(),
            })
            .collect();
        let cotangent = Cotangent {
            sdf: self.sdf.as_deref(),
            indicator: self.indicator.as_deref(),
            iso_value: self.iso_value,
            vertices: self.vertices.as_deref(),
            normals: self.normals.as_deref(),
            areas: self.areas.as_deref(),
            extensions: &extensions,
        };
        Ok(this.result.view().pullback(&cotangent)?)
    }
}

fn out_dict<'py, T: Number>(
    py: Python<'py>,
    out: &CloudCotangent<T>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("points", arrays::from_vectors(py, &out.points))?;
    let normals = (!out.normals.is_empty()).then(|| arrays::from_vectors(py, &out.normals));
    dict.set_item("normals", normals)?;
    let mut attributes = Vec::new();
    for values in &out.attributes {
        let components = values.len() / out.points.len().max(1);
        let shape = [out.points.len(), components];
        attributes.push(arrays::shaped(py, values.clone(), shape)?);
    }
    dict.set_item("attributes", attributes)?;
    dict.set_item("lower", out.grid.lower.map(|x| x.f64()))?;
    dict.set_item("spacing", out.grid.spacing.f64())?;
    dict.set_item("guarded", out.guarded)?;
    Ok(dict)
}

fn extended<T: Number>(
    py: Python<'_>,
    this: &Arc<Reconstruction<T>>,
    name: String,
    region: Region,
) -> PyResult<Arc<Extended<T>>> {
    let this = this.clone();
    let out = background::run(py, move |_| {
        let attribute = extend::attribute(&this.cloud, &name).map_err(|e| e.to_string())?;
        let (extension, residual) = this.result.view().extend(attribute, region)?;
        Ok::<_, Failure>(Extended {
            attribute: attribute.clone(),
            extension,
            residual,
        })
    })?;
    Ok(Arc::new(out?))
}
