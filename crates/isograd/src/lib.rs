//! Point cloud in, signed distance field out, made to be differentiated.
//!
//! One stage is one folder: a forward map and, beside it, its pullback. A pipeline is the stages in
//! order.
#![warn(missing_docs)]

mod checks;
mod concrete;
pub mod data;
pub mod differential;
pub mod distance;
pub mod isosurface;
pub mod neighbors;
pub mod normals;
pub mod orient;
pub(crate) mod parallel;
mod pipeline;
pub mod poisson;
mod real;
mod report;
pub(crate) mod simd;
pub mod splat;
pub(crate) mod trilinear;
pub mod vector;

pub use data::{
    Attribute, Field, FieldError, Grid, GridError, LatticeEdge, Mesh, MeshError, PointCloud,
    PointCloudError, Resolution,
};
pub use pipeline::{Error, Options, Reconstruction, Reconstructor};
pub use real::Real;
pub use report::{Report, Seconds, Stage, Warning};

/// The README's code, compiled and run with the doc tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
