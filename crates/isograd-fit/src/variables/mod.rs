//! Variables of a fit: the parameters of a shape, or the positions of points.
//!
//! The optimizer works on a vector `x` of numbers of order one. It is mapped to points here, and cotangents of the
//! points are mapped to cotangents of `x`.

mod points;
mod shape;
#[cfg(test)]
mod tests;

use isograd::{PointCloud, orient};

use crate::error::Error;

pub use points::Points;
pub use shape::{ShapeParameters, Start};

/// Variables of a fit.
#[derive(Clone, Debug)]
pub enum Variables {
    /// Parameters of a shape.
    Shape(ShapeParameters),
    /// The coordinates of every point of a cloud.
    Points(Points),
}

/// Regularization terms of the loss.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Regularization {
    /// Roughness of the displacement of the points.
    pub smoothness: f64,
    /// Penalty of parameters beyond their bounds.
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

    /// Orientation method, given the one of the options. Instead of automatic orientation, which may change
    /// discontinuously at sharp edges, a shape gives the signs of its own normals.
    pub fn orientation(&self, requested: orient::Method) -> orient::Method {
        match (self, requested) {
            (Self::Shape(_), orient::Method::Auto) => orient::Method::Signs,
            _ => requested,
        }
    }

    /// The cotangent of `x` from that of the points.
    pub fn pullback(&self, x: &[f64], points_bar: &[[f64; 3]]) -> Result<Vec<f64>, Error> {
        match self {
            Self::Shape(shape) => shape.pullback(x, points_bar),
            Self::Points(points) => Ok(points.pullback(points_bar)),
        }
    }

    /// Regularization terms at `x`; their gradient is added to `gradient`.
    pub fn regularization(&self, x: &[f64], gradient: &mut [f64]) -> Regularization {
        match self {
            Self::Shape(shape) => Regularization {
                bounds: shape.overshoot(x, gradient),
                ..Regularization::default()
            },
            Self::Points(points) => Regularization {
                smoothness: points.roughness(x, gradient),
                ..Regularization::default()
            },
        }
    }

    /// Hash of the variables and their settings.
    pub fn fingerprint(&self) -> u64 {
        match self {
            Self::Shape(shape) => shape.fingerprint(),
            Self::Points(points) => points.fingerprint(),
        }
    }
}
