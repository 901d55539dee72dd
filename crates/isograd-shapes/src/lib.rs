//! Parametric bodies with exact points, normals, volumes and (where known) distances, sampled as point
//! clouds: test data with known truth for the pipeline of [`isograd`].
//!
//! ```
//! use isograd_shapes::{Sampling, by_name};
//!
//! let mut fish = by_name("fish")?;
//! fish.set_all([("amplitude", 0.125), ("time", 0.3)])?;
//! let samples = fish.sample::<f32>(2000, &Sampling::default(), 1)?;
//! assert_eq!(samples.cloud.len(), 2000);
//! assert_eq!(samples.cloud.attributes()[0].name, "velocity");
//!
//! // Derivative of the points in a parameter, at fixed surface coordinates.
//! let width_tangent = fish.tangent("width3", &samples.coordinates)?;
//! assert_eq!(width_tangent.len(), 2000);
//!
//! // Pullback: from cotangents of the points to cotangents of all parameters.
//! let along_x = vec![[1.0f64, 0.0, 0.0]; 2000];
//! let gradient = fish.pullback(&samples.coordinates, &along_x)?;
//! assert_eq!(gradient.len(), fish.values().len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A surface is a set of patches; a patch is a smooth map from the unit square, written once with
//! numbers that carry derivatives. Normals, area elements, velocities and the derivatives of points with
//! respect to parameters all come from that one map, exact to rounding. See [`Shape`].
//!
//! | shape | distance | inside test | volume | area |
//! |---|---|---|---|---|
//! | sphere, torus, box | exact | exact | closed form | closed form |
//! | ellipsoid | exact (bracketed root) | exact | closed form | quadrature |
//! | nacelle | exact to 1e-12 (2-D reduction) | exact | closed form | quadrature |
//! | vessels | exact outside; inside away from joints | exact | quadrature, 1e-5 | quadrature, 1e-5 |
//! | knot | none | none | quadrature | quadrature |
//! | fish, eel | none | exact when straight | quadrature | quadrature |
//! | airliner | none | exact | quadrature, 1e-5 | quadrature, 1e-5 |
//! | car | none | exact | closed form | quadrature |
#![warn(missing_docs)]

mod bodies;
mod jet;
mod kind;
mod material;
mod measure;
mod sampling;
mod shape;
mod surface;

pub use bodies::fish::EEL_HEIGHTS;
pub use kind::{Parameter, ShapeError};
pub use sampling::{Density, Layout, MAX_SAMPLES, SampleError, Samples, Sampling};
pub use shape::{Shape, SurfaceCoordinate, SurfacePoint, all, by_name};
