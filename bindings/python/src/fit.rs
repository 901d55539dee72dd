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

/// What `isograd._fit` writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FitSettings {
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

/// What is to be matched.
enum Wanted {
    Sdf(Vec<f64>),
    Mesh(Mesh<f64>),
    Cloud(Vec<[f64; 3]>),
}

/// Outcome, who computed, why the CPU where that was left to the package, history as JSON, names and values of the
/// shape, points, φ, vertices, faces.
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

/// Runs a fit to its end: of `shape`, or of `points` where there is none. `target` is φ, `(vertices, faces)` or
/// points, as `kind` says. `callback` gets each epoch as JSON, and stops the fit by returning `False`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one call from isograd._fit")]
pub fn run_fit<'py>(
    py: Python<'py>,
    settings: &str,
    how: &str,
    kind: &str,
    target: Vec<Bound<'py, PyAny>>,
    shape: Option<&Shape>,
    points: Option<&Bound<'py, PyAny>>,
    callback: Option<Py<PyAny>>,
) -> PyResult<Fitted<'py>> {
    let settings = Settings::parse(settings).map_err(value)?;
    let how: FitSettings =
        serde_json::from_str(how).map_err(|error| value(format!("fit: {error}")))?;
    let grid = settings.grid::<f64>().map_err(value)?;
    let wanted = match (kind, target.as_slice()) {
        ("sdf", [sdf]) => Wanted::Sdf(arrays::values(sdf, "the target")?),
        ("mesh", [vertices, faces]) => Wanted::Mesh(arrays::mesh(vertices, faces)?),
        ("cloud", [cloud]) => Wanted::Cloud(arrays::vectors(cloud, "the target")?),
        _ => return Err(value(format!("a target of the kind '{kind}'"))),
    };
    let variables = match (shape, points) {
        (Some(shape), _) => Variables::Shape(how.shape(&shape.0)),
        (None, Some(points)) => {
            let cloud = PointCloud::new(arrays::vectors(points, "points")?).map_err(value)?;
            let mut points = Points::new(cloud);
            points.smoothness = how.smoothness;
            Variables::Points(points)
        }
        (None, None) => return Err(value("give a shape or points to fit")),
    };
    let done = background::run(py, move |stop| {
        let target = wanted.target(grid, &settings.options)?;
        let options = Options {
            backend: settings.backend,
            ..how.options(settings.options.clone()).map_err(value)?
        };
        let mut fit = Fit::new(&target, variables, options).map_err(Failure::from)?;
        let outcome = descend(&mut fit, callback.as_ref(), stop)?;
        Ok::<_, PyErr>(Done::new(&mut fit, outcome).map_err(Failure::from)?)
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

    fn options(&self, reconstruction: isograd::Options) -> Result<Options, String> {
        let optimizer = match self.optimizer {
            Method::Lbfgs => Optimizer::lbfgs(self.rate),
            Method::Adam => Optimizer::adam(self.rate, Decay::Cosine { steps: self.epochs }),
        };
        Ok(Options {
            band: self.band.parse()?,
            optimizer,
            epochs: self.epochs,
            tolerance: self.tolerance,
            reconstruction,
            ..Options::default()
        })
    }
}

impl Wanted {
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

/// Epochs until the fit is done, the callback says so, or Ctrl-C is pressed.
fn descend(fit: &mut Fit, callback: Option<&Py<PyAny>>, stop: &Stop) -> PyResult<Outcome> {
    let mut raised = None;
    let outcome = fit.run(&mut |fit| {
        if stop.is_requested() {
            return ControlFlow::Break(());
        }
        let Some(callback) = callback else {
            return ControlFlow::Continue(());
        };
        match Python::attach(|py| goes_on(py, callback, fit)) {
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

fn goes_on(py: Python<'_>, callback: &Py<PyAny>, fit: &Fit) -> PyResult<bool> {
    let epoch = serde_json::to_string(&fit.history().last()).map_err(value)?;
    let answer = callback.call1(py, (epoch,))?;
    Ok(answer.extract::<Option<bool>>(py)? != Some(false))
}

/// All that is left of a fit.
struct Done {
    outcome: Outcome,
    backend: String,
    note: Option<String>,
    history: String,
    values: Vec<(&'static str, f64)>,
    points: Vec<[f64; 3]>,
    sdf: Field<f64>,
    mesh: Mesh<f64>,
}

impl Done {
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
            arrays::of_vectors(py, &self.points),
            arrays::shaped(py, self.sdf.into_values(), shape)?,
            arrays::of_vectors(py, self.mesh.vertices()),
            arrays::of_vectors(py, self.mesh.faces()),
        ))
    }
}
