//! Point cloud in, signed distance field out, gradients back.
//!
//! One stage is one folder: a forward map and, beside it, its pullback. A [`Reconstructor`] runs the stages
//! in order, and [`Reconstruction::pullback`] their pullbacks in reverse. [`gradcheck`] compares it with
//! finite differences.
#![warn(missing_docs)]

mod backend;
mod checks;
mod concrete;
pub mod data;
pub mod differential;
pub mod distance;
pub(crate) mod gather;
pub mod gradcheck;
pub mod isosurface;
pub mod neighbors;
pub mod normals;
pub mod orient;
pub(crate) mod parallel;
mod pipeline;
pub mod poisson;
#[cfg(test)]
mod pullback_tests;
mod real;
mod report;
pub(crate) mod simd;
pub mod splat;
pub(crate) mod trilinear;

use isograd_element::{self as element, vector};

pub use backend::{Backend, UnknownBackend};
pub use data::{
    Attribute, Field, FieldError, Grid, GridCotangent, GridError, LatticeEdge, Mesh, MeshError,
    PointCloud, PointCloudError, Resolution, Sensors,
};
pub use pipeline::{
    CloudCotangent, Cotangent, Error, ExtensionCotangent, Options, Orienter, ParseOptionError,
    PullbackError, PullbackScratch, Reconstruction, Reconstructor, RestoreError, Saved,
    available_memory, check_memory,
};
pub use real::Real;
pub use report::{JsonReport, Report, Seconds, Stage, Warning};

/// The README's code, compiled and run with the doc tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
