//! Kinds of bodies: names, parameters, and how a body is built from them.

use crate::jet::Jet;
use crate::surface::Surface;

/// Unit of lengths, chosen by the user.
pub(crate) const UNIT_OF_LENGTH: &str = "unit length";

/// One parameter of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as in `--param NAME=VALUE`.
    pub name: &'static str,
    /// Description.
    pub meaning: &'static str,
    /// Unit; empty for a plain number.
    pub unit: &'static str,
    /// Default value.
    pub default: f64,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// Whether the value must be an integer. Points are not differentiable in such a parameter.
    pub whole: bool,
}

/// A table of parameters, one per line: `"name" = default in (min, max), unit, "meaning";`.
macro_rules! parameters {
    ($($name:literal = $default:literal in $range:expr, $unit:expr, $meaning:expr;)*) => {
        [$(crate::kind::Parameter {
            name: $name,
            meaning: $meaning,
            unit: $unit,
            default: $default,
            min: $range.0,
            max: $range.1,
            whole: false,
        }),*]
    };
}
pub(crate) use parameters;

/// Joins tables of `N` parameters in all.
pub(crate) const fn concat<const N: usize>(tables: &[&[Parameter]]) -> [Parameter; N] {
    let mut joined = [tables[0][0]; N];
    let (mut table, mut row, mut i) = (0, 0, 0);
    while i < N {
        if row == tables[table].len() {
            (table, row) = (table + 1, 0);
        }
        joined[i] = tables[table][row];
        (row, i) = (row + 1, i + 1);
    }
    joined
}

/// Range of positive lengths.
pub(crate) const POSITIVE: (f64, f64) = (1e-6, 1e6);

/// Refuses values that do not form a body together.
pub(crate) fn require(condition: bool, problem: &str) -> Result<(), ShapeError> {
    match condition {
        true => Ok(()),
        false => Err(ShapeError::Combination(problem.into())),
    }
}

/// Errors of a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// Unknown name of a shape.
    #[error("unknown shape '{name}'; the shapes are: {known}")]
    UnknownShape {
        /// The unknown name.
        name: String,
        /// All known names.
        known: String,
    },
    /// Unknown name of a parameter.
    #[error("{shape} has no parameter '{name}'; its parameters are: {known}")]
    UnknownParameter {
        /// The shape.
        shape: &'static str,
        /// The unknown name.
        name: String,
        /// All known names.
        known: String,
    },
    /// A value out of its range, or NaN.
    #[error("{shape}: {name} is {value}; it must be from {min} to {max}")]
    OutOfRange {
        /// The shape.
        shape: &'static str,
        /// The parameter.
        name: &'static str,
        /// The refused value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A fraction for a parameter that must be an integer.
    #[error("{shape}: {name} is {value}; it must be a whole number")]
    NotWhole {
        /// The shape.
        shape: &'static str,
        /// The parameter.
        name: &'static str,
        /// The refused value.
        value: f64,
    },
    /// A surface coordinate on a patch that the shape does not have.
    #[error(
        "coordinate {index} is on patch {patch}, and {shape} has {patches}; sample the shape again"
    )]
    Coordinate {
        /// The shape.
        shape: &'static str,
        /// Index of the first such coordinate.
        index: usize,
        /// Its patch.
        patch: u32,
        /// Number of patches.
        patches: usize,
    },
    /// The numbers of cotangents and coordinates differ.
    #[error("{cotangents} cotangents for {coordinates} surface coordinates; give one for each")]
    Cotangents {
        /// Number of cotangents.
        cotangents: usize,
        /// Number of coordinates.
        coordinates: usize,
    },
    /// Values that are in range but do not form a body together.
    #[error("{0}")]
    Combination(String),
}

/// Builds a body from its parameters, given as jets.
pub(crate) type Build = fn(&[Jet]) -> Result<Box<dyn Surface>, ShapeError>;

/// A family of bodies.
pub(crate) struct Kind {
    pub name: &'static str,
    pub summary: &'static str,
    pub parameters: &'static [Parameter],
    /// Index of the time parameter of a moving body.
    pub time: Option<usize>,
    pub build: Build,
}

impl Kind {
    /// Index of a parameter.
    pub fn index(&self, name: &str) -> Result<usize, ShapeError> {
        let index = self.parameters.iter().position(|p| p.name == name);
        index.ok_or_else(|| ShapeError::UnknownParameter {
            shape: self.name,
            name: name.into(),
            known: names(self.parameters.iter().map(|p| p.name)),
        })
    }

    /// Checks the range of parameter `index`.
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

/// Joins names for messages.
pub(crate) fn names(all: impl Iterator<Item = &'static str>) -> String {
    all.collect::<Vec<_>>().join(", ")
}
