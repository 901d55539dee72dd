//! What is changed: the parameters of a shape, or the positions of points.
//!
//! Either way the descent sees a vector `x` of numbers of order one; here it becomes points, and cotangents of
//! points become those of `x`.

mod points;
mod shape;
#[cfg(test)]
mod tests;

use isograd::{PointCloud, orient};

use crate::error::Error;

pub use points::Points;
pub use shape::{ShapeParameters, Start};

/// What is changed.
#[derive(Clone, Debug)]
pub enum Variables {
    /// Parameters of a shape.
    Shape(ShapeParameters),
    /// The coordinates of every point of a cloud.
    Points(Points),
}

/// What is added to the mismatch, at one `x`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Extra {
    /// Roughness of the displacement of the points.
    pub smoothness: f64,
    /// How far parameters are beyond their bounds.
    pub bounds: f64,
}

/// The variables, ready for one fit.
#[derive(Clone, Debug)]
pub(crate) enum Degrees {
    Shape(shape::Degrees),
    Points(points::Degrees),
}

impl Degrees {
    /// `spacing` is the cell size of the grid.
    pub fn new(variables: Variables, spacing: f64) -> Result<Self, Error> {
        Ok(match variables {
            Variables::Shape(shape) => Self::Shape(shape::Degrees::new(shape)?),
            Variables::Points(points) => Self::Points(points::Degrees::new(points, spacing)?),
        })
    }

    /// `x` at the start.
    pub fn start(&self) -> Vec<f64> {
        match self {
            Self::Shape(shape) => shape.start(),
            Self::Points(points) => points.start(),
        }
    }

    /// The cloud at `x`.
    pub fn cloud(&self, x: &[f64]) -> Result<PointCloud<f64>, Error> {
        match self {
            Self::Shape(shape) => shape.cloud(x),
            Self::Points(points) => Ok(PointCloud::new(points.points(x))?),
        }
    }

    /// How the normals get their signs, where `asked` is asked for. A shape knows its outside: its own normals
    /// decide instead of guesses, which change abruptly at sharp edges and make the loss jump.
    pub fn orientation(&self, asked: orient::Method) -> orient::Method {
        match (self, asked) {
            (Self::Shape(_), orient::Method::Auto) => orient::Method::Signs,
            _ => asked,
        }
    }

    /// The cotangent of `x` from that of the points.
    pub fn pullback(&self, x: &[f64], points_bar: &[[f64; 3]]) -> Result<Vec<f64>, Error> {
        match self {
            Self::Shape(shape) => shape.pullback(x, points_bar),
            Self::Points(points) => Ok(points.pullback(points_bar)),
        }
    }

    /// What is added to the mismatch at `x`; its gradient is added to `gradient`.
    pub fn extra(&self, x: &[f64], gradient: &mut [f64]) -> Extra {
        match self {
            Self::Shape(shape) => Extra {
                bounds: shape.overshoot(x, gradient),
                ..Extra::default()
            },
            Self::Points(points) => Extra {
                smoothness: points.roughness(x, gradient),
                ..Extra::default()
            },
        }
    }

    /// A hash of all that makes these variables what they are.
    pub fn fingerprint(&self) -> u64 {
        match self {
            Self::Shape(shape) => shape.fingerprint(),
            Self::Points(points) => points.fingerprint(),
        }
    }
}
