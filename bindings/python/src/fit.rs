//! Fits of shapes and points, behind `isograd.fit`.

use std::ops::ControlFlow;

use isograd::{Field, Grid, Mesh, PointCloud};
use isograd_fit::{
    Decay, Error, Fit, Optimizer, Options, Outcome, Points, ShapeParameters, Start, Target,
    Variables,
};
use pyo3::prelude::*;
use serde::Deserialize;

use crate::arrays;
use crate::backend::Failure;
use crate::background::{self, Stop};
use crate::errors::value;
use crate::settings::Settings;
use crate::shape::Shape;

/// The options that `isograd._fit` writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FitSettings {
    /// Grid, options and backend of the reconstructions.
    settings: Settings,
    kind: Kind,
    optimizer: Method,
    rate: Option<f64>,
    epochs: usize,
    tolerance: f64,
    /// Text of a [`Band`](isograd_fit::Band).
    band: String,
    only: Option<Vec<String>>,
    samples: usize,
    seed: u64,
    resample: Option<usize>,
    random_start: Option<f64>,
    smoothness: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Method {
    Lbfgs,
    Adam,
}

/// Kind of the target.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Sdf,
    Mesh,
    Cloud,
}

/// Arrays of the target.
enum TargetArrays {
    Sdf(Vec<f64>),
    Mesh(Mesh<f64>),
    Cloud(Vec<[f64; 3]>),
}

/// Outcome, name of the backend, why `auto` selected the CPU, history as JSON, names and values of the shape, points, φ,
/// vertices, faces.
type Fitted<'py> = (
    &'static str,
    String,
    Option<String>,
    String,
    Vec<(&'static str, f64)>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
);

/// Fits `shape`, or `points` without one, to `target`: φ, `(vertices, faces)` or points, according to the kind in
/// `options`. `callback` is called with each epoch as JSON, and stops the fit by returning `False`.
#[pyfunction]
pub fn run_fit<'py>(
    py: Python<'py>,
    options: &str,
    target: Vec<Bound<'py, PyAny>>,
    shape: Option<&Shape>,
    points: Option<&Bound<'py, PyAny>>,
    callback: Option<Py<PyAny>>,
) -> PyResult<Fitted<'py>> {
    let fit: FitSettings =
        serde_json::from_str(options).map_err(|error| value(format!("fit: {error}")))?;
    let grid = fit.settings.grid::<f64>().map_err(value)?;
    let arrays = match (fit.kind, target.as_slice()) {
        (Kind::Sdf, [sdf]) => TargetArrays::Sdf(arrays::values(sdf, "the target")?),
        (Kind::Mesh, [vertices, faces]) => TargetArrays::Mesh(arrays::mesh(vertices, faces)?),
        (Kind::Cloud, [cloud]) => TargetArrays::Cloud(arrays::vectors(cloud, "the target")?),
        _ => {
            return Err(value(
                "the target has another number of arrays than its kind",
            ));
        }
    };
    let variables = match (shape, points) {
        (Some(shape), _) => Variables::Shape(fit.shape(&shape.0)),
        (None, Some(points)) => {
            let cloud = PointCloud::new(arrays::vectors(points, "points")?).map_err(value)?;
            let mut points = Points::new(cloud);
            points.smoothness = fit.smoothness;
            Variables::Points(points)
        }
        (None, None) => return Err(value("give a shape or points to fit")),
    };
    let done = background::run(py, move |stop| {
        let target = arrays.target(grid, &fit.settings.options)?;
        let options = fit.options().map_err(value)?;
        let mut fit = Fit::new(&target, variables, options).map_err(Failure::from)?;
        let outcome = descend(&mut fit, callback.as_ref(), stop)?;
        Ok::<_, PyErr>(FitResult::new(&mut fit, outcome).map_err(Failure::from)?)
    })??;
    done.arrays(py)
}

impl FitSettings {
    fn shape(&self, shape: &isograd_shapes::Shape) -> ShapeParameters {
        ShapeParameters {
            only: self.only.clone(),
            samples: self.samples,
            seed: self.seed,
            resample: self.resample,
            start: self
                .random_start
                .map_or(Start::Given, |spread| Start::Random {
                    seed: self.seed,
                    spread,
                }),
            ..ShapeParameters::new(shape.clone())
        }
    }

    fn options(&self) -> Result<Options, String> {
        let optimizer = match self.optimizer {
            Method::Lbfgs => Optimizer::lbfgs(self.rate),
            Method::Adam => Optimizer::adam(self.rate, Decay::Cosine { steps: self.epochs }),
        };
        Ok(Options {
            band: self.band.parse()?,
            optimizer,
            epochs: self.epochs,
            tolerance: self.tolerance,
            reconstruction: self.settings.options.clone(),
            backend: self.settings.backend,
            ..Options::default()
        })
    }
}

impl TargetArrays {
    fn target(self, grid: Grid<f64>, options: &isograd::Options) -> PyResult<Target> {
        match self {
            Self::Sdf(values) => {
                let field = Field::new(grid, values).map_err(value)?;
                Target::from_sdf(field).map_err(value)
            }
            Self::Mesh(mesh) => Target::from_mesh(mesh, grid).map_err(value),
            Self::Cloud(points) => {
                let cloud = PointCloud::new(points).map_err(value)?;
                Target::from_cloud(&cloud, grid, options).map_err(value)
            }
        }
    }
}

/// Runs epochs until the fit ends, the callback stops it, or Ctrl-C is pressed.
fn descend(fit: &mut Fit, callback: Option<&Py<PyAny>>, stop: &Stop) -> PyResult<Outcome> {
    let mut raised = None;
    let outcome = fit.run(&mut |fit| {
        if stop.is_requested() {
            return ControlFlow::Break(());
        }
        let Some(callback) = callback else {
            return ControlFlow::Continue(());
        };
        match Python::attach(|py| call_back(py, callback, fit)) {
            Ok(true) => ControlFlow::Continue(()),
            Ok(false) => ControlFlow::Break(()),
            Err(error) => {
                raised = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    match raised {
        Some(error) => Err(error),
        None => Ok(outcome.map_err(Failure::from)?),
    }
}

fn call_back(py: Python<'_>, callback: &Py<PyAny>, fit: &Fit) -> PyResult<bool> {
    let epoch = serde_json::to_string(&fit.history().last()).map_err(value)?;
    let answer = callback.call1(py, (epoch,))?;
    Ok(answer.extract::<Option<bool>>(py)? != Some(false))
}

/// Result of a fit.
struct FitResult {
    outcome: Outcome,
    backend: String,
    note: Option<String>,
    history: String,
    values: Vec<(&'static str, f64)>,
    points: Vec<[f64; 3]>,
    sdf: Field<f64>,
    mesh: Mesh<f64>,
}

impl FitResult {
    fn new(fit: &mut Fit, outcome: Outcome) -> Result<Self, Error> {
        let shape = fit.shape();
        let values = shape
            .iter()
            .flat_map(|shape| shape.parameters().map(|(p, v)| (p.name, v)));
        let values = values.collect();
        let points = fit.cloud()?.points().to_vec();
        let history = serde_json::to_string(fit.history()).unwrap_or_default();
        let backend = fit.backend().to_string();
        let note = fit.backend_note().map(String::from);
        let result = fit.reconstruction()?;
        Ok(Self {
            outcome,
            backend,
            note,
            history,
            values,
            points,
            sdf: result.sdf()?.clone(),
            mesh: result.mesh()?.clone(),
        })
    }

    fn arrays<'py>(self, py: Python<'py>) -> PyResult<Fitted<'py>> {
        let shape = self.sdf.grid().shape();
        let outcome = match self.outcome {
            Outcome::Met => "met",
            Outcome::Minimum => "minimum",
            Outcome::Epochs => "epochs",
            Outcome::Stopped => "stopped",
        };
        Ok((
            outcome,
            self.backend,
            self.note,
            self.history,
            self.values,
            arrays::from_vectors(py, &self.points),
            arrays::shaped(py, self.sdf.into_values(), shape)?,
            arrays::from_vectors(py, self.mesh.vertices()),
            arrays::from_vectors(py, self.mesh.faces()),
        ))
    }
}
