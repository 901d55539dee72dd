//! Inverse shape optimization: a parametric shape, or the points of a cloud, are changed until their signed
//! distance field matches a target.
//!
//! ```
//! use isograd::{Grid, Resolution};
//! use isograd_fit::{Fit, Options, Outcome, ShapeParameters, Target, Variables};
//! use isograd_shapes::{Sampling, by_name};
//!
//! // The target: a sphere of radius 0.5, known by samples alone.
//! let mut sphere = by_name("sphere")?;
//! let cloud = sphere.sample::<f64>(2000, &Sampling::default(), 7)?.cloud;
//! let grid = Grid::fit(&cloud, Resolution::Cells(24), 0.2)?;
//! let target = Target::from_cloud(&cloud, grid, &isograd::Options::default())?;
//!
//! // The start: a smaller one.
//! sphere.set("radius", 0.4)?;
//! let variables = Variables::Shape(ShapeParameters {
//!     samples: 2000,
//!     ..ShapeParameters::new(sphere)
//! });
//! let mut fit = Fit::new(&target, variables, Options::default())?;
//! let outcome = fit.run(&mut |_| std::ops::ControlFlow::Continue(()))?;
//! assert_ne!(outcome, Outcome::Stopped);
//! let radius = fit.shape().map_or(0.0, |shape| shape.values()[0]);
//! assert!((radius / 0.5 - 1.0).abs() < 0.005, "{radius}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The chain is parameters → points → φ → loss, and its gradient comes back through
//! [`isograd::Reconstruction::pullback`] and [`isograd_shapes::Shape::pullback`], in about the time of one
//! more reconstruction, however many parameters there are.
//!
//! - [`Target`]: a field, a closed mesh, or a cloud.
//! - [`Variables`]: the parameters of a shape ([`ShapeParameters`]), or raw points ([`Points`]).
//! - [`Options`]: where the fields are compared ([`Band`]), the method ([`Optimizer`]), when to end, and the
//!   backend (a device needs the features of [`isograd_backend`]).
//! - [`Fit`]: a step, a run with an observer, the state for resuming ([`Checkpoint`]).
//!
//! Guaranteed: the same bits for any number of threads; a run that was stopped and resumed ends in the same bits as an
//! uninterrupted one; invalid parameters, or a failing reconstruction, shorten the step and do not end the run.
//!
//! Not guaranteed: that the minimum is the target. Parameters that do not change the field (the wavelength of a fish
//! that does not swim) keep their values, and details that the grid does not resolve are not found.
#![warn(missing_docs)]

mod error;
mod fingerprint;
mod fit;
mod loss;
pub mod optimize;
mod problem;
mod target;
mod variables;

pub use error::Error;
pub use fit::{Checkpoint, Epoch, Fit, Options, Outcome};
pub use loss::{Band, Matching, Mismatch};
pub use optimize::{Adam, Decay, Lbfgs, Optimizer};
pub use problem::LossTerms;
pub use target::{Target, TargetError};
pub use variables::{Points, ShapeParameters, Start, Variables};
