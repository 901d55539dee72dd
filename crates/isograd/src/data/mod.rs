//! Plain data with checked constructors: what goes into the stages and what comes out.

pub(crate) mod blocks;
pub(crate) mod cells;
mod cloud;
mod field;
mod grid;
mod grid_fit;
mod mesh;
mod outliers;
#[cfg(test)]
mod outliers_tests;

pub(crate) use cloud::bounds;
pub(crate) use grid_fit::fast_length;

pub use cloud::{Attribute, PointCloud, PointCloudError, Sensors};
pub use field::{Field, FieldError};
pub use grid::{Grid, GridCotangent, GridError, Resolution};
pub use mesh::{LatticeEdge, Mesh, MeshError};
pub use outliers::{Outliers, Selection};
