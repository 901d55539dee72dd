//! Grid and options as one JSON text: the only form that every caller can pass, XLA's attributes included.
//! Two plans are the same where their texts are.

use isograd::distance::Band;
use isograd::neighbors::Radius;
use isograd::poisson::Smoothing;
use isograd::{Backend, Grid, GridError, Options, Real, UnknownBackend, isosurface, orient, splat};
use isograd_element::vector;
use serde::Deserialize;

use crate::backend::Failure;

/// What `isograd._settings.encode` writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    lower: [f64; 3],
    spacing: f64,
    shape: [usize; 3],
    radius: Option<f64>,
    orient: Orient,
    splat: Splat,
    area: bool,
    smoothing: Option<f64>,
    screening: f64,
    level: Level,
    band: Option<f64>,
    checks: bool,
    /// The CPU where there is none.
    backend: Option<String>,
}

/// `isograd.Orient`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orient {
    /// From the points.
    Auto,
    /// The paper's.
    Parity,
    /// The normals that are given.
    Given,
    /// Their sides.
    Signs,
    /// The sides of the sensors.
    Sensors,
    /// The sides of the call before.
    Previous,
}

impl Orient {
    /// Reads the text of the enum.
    ///
    /// # Errors
    /// A text that stands for none.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = serde_json::Value::from(text);
        serde_json::from_value(text).map_err(|error| format!("orient: {error}"))
    }

    /// What it stands for.
    pub fn method(self) -> orient::Method {
        match self {
            Self::Auto => orient::Method::Auto,
            Self::Parity => orient::Method::Parity(orient::ParityOptions::default()),
            Self::Given => orient::Method::Given,
            Self::Signs => orient::Method::Signs,
            Self::Sensors => orient::Method::Sensors,
            Self::Previous => orient::Method::Previous,
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Level {
    Local,
    Thin,
    Mean,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Splat {
    Bspline,
    Paper,
}

impl Settings {
    /// Reads the text.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn parse(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| format!("settings: {error}"))
    }

    /// The grid.
    ///
    /// # Errors
    /// See [`GridError`].
    pub fn grid<T: Real>(&self) -> Result<Grid<T>, GridError> {
        Grid::new(vector::of_f64(self.lower), T::of(self.spacing), self.shape)
    }

    /// Where to compute.
    ///
    /// # Errors
    /// A text that names no backend.
    pub fn backend(&self) -> Result<Backend, Failure> {
        let text = self.backend.as_deref().unwrap_or("cpu");
        text.parse()
            .map_err(|error: UnknownBackend| Failure::Value(error.to_string()))
    }

    /// The options.
    pub fn options(&self) -> Options {
        let band = self.band.map(|cells| Band::Within(cells * self.spacing));
        let smoothing = self.smoothing.map_or(Smoothing::Auto, Smoothing::Cells);
        Options::default()
            .radius(self.radius.map_or(Radius::Auto, Radius::Fixed))
            .orient(self.orient.method())
            .splat(match self.splat {
                Splat::Bspline => splat::Weights::BSpline,
                Splat::Paper => splat::Weights::Paper,
            })
            .area(self.area)
            .smoothing(smoothing)
            .screening(self.screening)
            .level(match self.level {
                Level::Local => isosurface::Level::Local,
                Level::Thin => isosurface::Level::Thin,
                Level::Mean => isosurface::Level::Mean,
            })
            .band(band.unwrap_or(Band::Full))
            .checks(self.checks)
    }
}
