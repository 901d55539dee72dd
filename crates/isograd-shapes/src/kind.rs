//! The kinds of body: their names, their parameters, and how they are built.

use crate::jet::Jet;
use crate::surface::Surface;

/// Lengths are in whatever unit the user means.
pub(crate) const UNIT_OF_LENGTH: &str = "unit length";

/// One parameter of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name, as `--param NAME=VALUE` takes it.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// Its value unless set.
    pub default: f64,
    /// The least value allowed.
    pub min: f64,
    /// The greatest value allowed.
    pub max: f64,
    /// Whether only whole numbers are allowed. Nothing is differentiable in such a parameter.
    pub whole: bool,
}

/// A positive length.
pub(crate) const fn length(name: &'static str, meaning: &'static str, default: f64) -> Parameter {
    Parameter {
        name,
        meaning,
        unit: UNIT_OF_LENGTH,
        default,
        min: 1e-6,
        max: 1e6,
        whole: false,
    }
}

/// A plain number, or one with a unit of its own, in `[range.0, range.1]`.
pub(crate) const fn number(
    name: &'static str,
    meaning: &'static str,
    unit: &'static str,
    default: f64,
    range: (f64, f64),
) -> Parameter {
    Parameter {
        name,
        meaning,
        unit,
        default,
        min: range.0,
        max: range.1,
        whole: false,
    }
}

/// Why a shape was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// There is no shape of that name.
    #[error("there is no shape '{name}'; the shapes are: {known}")]
    UnknownShape {
        /// What was asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// The shape has no parameter of that name.
    #[error("{shape} has no parameter '{name}'; its parameters are: {known}")]
    UnknownParameter {
        /// The shape.
        shape: &'static str,
        /// What was asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// A value out of its range, or NaN.
    #[error("{shape}: {name} is {value}; it must be from {min} to {max}")]
    OutOfRange {
        /// The shape.
        shape: &'static str,
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The least value allowed.
        min: f64,
        /// The greatest value allowed.
        max: f64,
    },
    /// A fraction where only whole numbers are allowed.
    #[error("{shape}: {name} is {value}; it must be a whole number")]
    NotWhole {
        /// The shape.
        shape: &'static str,
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A coordinate of a patch that the shape does not have (now).
    #[error(
        "coordinate {index} is on patch {patch}, and {shape} has {patches}; sample the shape again"
    )]
    Coordinate {
        /// The shape.
        shape: &'static str,
        /// The first such coordinate.
        index: usize,
        /// Its patch.
        patch: u32,
        /// How many there are.
        patches: usize,
    },
    /// Not one cotangent for each coordinate.
    #[error("{cotangents} cotangents for {coordinates} surface coordinates; give one for each")]
    Cotangents {
        /// Number of cotangents.
        cotangents: usize,
        /// Number of coordinates.
        coordinates: usize,
    },
    /// Values that are good each alone, but make no body together.
    #[error("{0}")]
    Combination(String),
}

/// How a body is made of its parameters, given as jets.
pub(crate) type Build = fn(&[Jet]) -> Result<Box<dyn Surface>, ShapeError>;

/// A family of bodies.
pub(crate) struct Kind {
    pub name: &'static str,
    pub summary: &'static str,
    pub parameters: &'static [Parameter],
    /// Index of the parameter that is time, for bodies that move.
    pub time: Option<usize>,
    pub build: Build,
}

impl Kind {
    /// Place of a parameter.
    pub fn index(&self, name: &str) -> Result<usize, ShapeError> {
        let found = self.parameters.iter().position(|p| p.name == name);
        found.ok_or_else(|| ShapeError::UnknownParameter {
            shape: self.name,
            name: name.into(),
            known: names(self.parameters.iter().map(|p| p.name)),
        })
    }

    /// Whether `value` is allowed for parameter `index` by itself.
    pub fn check(&self, index: usize, value: f64) -> Result<(), ShapeError> {
        let Parameter {
            name,
            min,
            max,
            whole,
            ..
        } = self.parameters[index];
        let shape = self.name;
        if !(min <= value && value <= max) {
            return Err(ShapeError::OutOfRange {
                shape,
                name,
                value,
                min,
                max,
            });
        }
        if whole && value.fract() != 0.0 {
            return Err(ShapeError::NotWhole { shape, name, value });
        }
        Ok(())
    }
}

/// Names in one line, for messages.
pub(crate) fn names(all: impl Iterator<Item = &'static str>) -> String {
    all.collect::<Vec<_>>().join(", ")
}
