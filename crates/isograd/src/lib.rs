//! Point cloud in, signed distance field out, gradients back.
//!
//! ```
//! use isograd::{Cotangent, Grid, Options, PointCloud, Reconstructor, Resolution};
//!
//! // 2,000 samples of the unit sphere.
//! let sphere = (0..2000).map(|i| {
//!     let (z, turn) = ((2 * i + 1) as f64 / 2000.0 - 1.0, i as f64 * 2.399963);
//!     let r = (1.0 - z * z).sqrt();
//!     [r * turn.cos(), r * turn.sin(), z]
//! });
//! let cloud = PointCloud::new(sphere.collect())?;
//!
//! // φ at every cell center, in the unit of the points, negative inside.
//! let grid = Grid::fit(&cloud, Resolution::Cells(32), 0.1)?;
//! let mut plan = Reconstructor::new(grid, Options::default().screening(0.0))?;
//! let result = plan.reconstruct(&cloud)?;
//! assert!((result.sdf().interpolate([0.9, 0.0, 0.0]) + 0.1).abs() < 0.01);
//!
//! // The gradient of the loss Σ φ with respect to the points, `(N, 3)`.
//! let ones = vec![1.0; grid.cells()];
//! let gradient = result.pullback(&Cotangent { sdf: Some(&ones), ..Cotangent::default() })?.points;
//! # assert_eq!(gradient.len(), cloud.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is guaranteed
//! - Distance: φ is the exact distance to the triangles of the mesh, to rounding, at every cell center within the
//!   [band](distance::Band). Its sign is that of the indicator, from which the mesh is made.
//! - Mesh: every edge belongs to exactly two triangles with opposite directions, unless the surface reaches a wall of the
//!   grid, which is a [`Warning`].
//! - Gradient: [`Reconstruction::pullback`] is the transpose of the derivative of the whole pipeline, and finite for every
//!   input. [`gradcheck`] compares it with finite differences.
//! - Determinism: the same input gives the same bits on any number of threads.
//! - Memory: a second call of a plan with as many points, up to a million, allocates nothing of the size of a field.
//!
//! # What is not
//! - Signs are estimated. Where samples are sparse, noisy or the surface is open they may be wrong: see
//!   [`Report::verdict`], its [reasons](Warning), [`Reconstruction::confidence`] and [`orient::doubt`].
//! - Neighborhoods, signs, the topology of the mesh and the closest triangle are discrete: a pullback holds them constant.
//!   Forward mode and second derivatives are not supported.
//!
//! # Modules
//! A stage is a folder with a forward map and, beside it, its pullback. A [`Reconstructor`] runs them in this order:
//!
//! | module | map |
//! |---|---|
//! | [`data`] | clouds, grids, fields and meshes |
//! | [`neighbors`] | points → neighborhoods |
//! | [`normals`] | neighborhoods → unoriented normals |
//! | [`orient`] | unoriented normals → outward normals |
//! | [`refine`] | outward normals → the same, fitted to the samples of their side |
//! | `thicken` | samples of parts thinner than a cell → the same moved apart, for [`isosurface::Level::Thin`] |
//! | [`splat`] | normals and areas → right-hand side of the Poisson equation |
//! | [`poisson`] | right-hand side → indicator χ |
//! | [`isosurface`] | χ → iso-value and mesh |
//! | [`distance`] | mesh → φ; queries at points; attributes on the surface |
//! | [`sheet`] | open surface → φ and closed shell of a membrane |
//! | [`differential`] | φ → gradient, normal and curvature |
//! | [`clean`] | points → indices of those to keep: without duplicates and outliers, thinned |
//! | [`gradcheck`] | comparison of the pullback with finite differences |
#![warn(missing_docs)]

mod backend;
pub mod clean;
mod concrete;
pub mod data;
pub mod differential;
pub mod distance;
pub(crate) mod gather;
pub mod gradcheck;
pub mod isosurface;
mod large;
pub mod neighbors;
pub mod normals;
pub mod orient;
pub(crate) mod parallel;
mod pipeline;
pub mod poisson;
#[cfg(test)]
mod pullback_tests;
mod real;
pub mod refine;
mod report;
pub mod sheet;
pub(crate) mod simd;
pub mod splat;
#[cfg(test)]
mod testing;
mod thicken;
pub(crate) mod trilinear;
mod union_find;

use isograd_element::{self as element, vector};

pub use backend::{Backend, UnknownBackend};
pub use data::{
    Attribute, Field, FieldError, Grid, GridCotangent, GridError, LatticeEdge, Mesh, MeshError,
    Outliers, PointCloud, PointCloudError, Resolution, Selection, Sensors,
};
pub use pipeline::{
    AvailableMemory, CloudCotangent, Cotangent, Error, ExtensionCotangent, MemoryError,
    MemoryLimit, MemoryUse, Options, Orienter, ParseOptionError, Pipeline, PullbackError,
    Reconstruction, Reconstructor, RestoreError, Saved, Solve, SurfaceResolution, available_memory,
    check_distance_memory, check_memory,
};
pub use real::Real;
pub use report::{JsonReport, Report, Seconds, Stage, Verdict, Warning};

/// The code of the README, compiled and run with the doc tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
