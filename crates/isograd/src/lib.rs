//! Point cloud in, signed distance field out, made to be differentiated.
//!
//! One stage is one folder: a forward map and, beside it, its pullback. A pipeline is the stages in
//! order.
#![warn(missing_docs)]

pub mod data;
pub mod distance;
pub mod isosurface;
pub mod neighbors;
pub mod normals;
pub mod orient;
pub(crate) mod parallel;
pub mod poisson;
mod real;
pub mod splat;
pub mod vector;

pub use data::{Field, Grid, GridError, LatticeEdge, Mesh, MeshError, PointCloud, PointCloudError};
pub use real::Real;
