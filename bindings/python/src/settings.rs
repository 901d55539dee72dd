//! Grid, options and backend as one JSON text: the only form that every caller can pass, XLA's attributes included.
//! Plans are equal where their texts are.

use isograd::{Backend, Grid, GridError, Options, Real};
use serde::Deserialize;

/// The text that `isograd._settings.encode` writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    grid: GridSettings,
    /// Options of the reconstruction.
    #[serde(default)]
    pub options: Options,
    /// Backend.
    #[serde(default)]
    pub backend: Backend,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GridSettings {
    lower: [f64; 3],
    spacing: f64,
    shape: [usize; 3],
}

impl Settings {
    /// Reads the text.
    ///
    /// # Errors
    /// Invalid JSON or values, with their place.
    pub fn parse(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| format!("settings: {error}"))
    }

    /// The grid.
    pub fn grid<T: Real>(&self) -> Result<Grid<T>, GridError> {
        let GridSettings {
            lower,
            spacing,
            shape,
        } = self.grid;
        Grid::new(lower.map(T::of), T::of(spacing), shape)
    }
}
