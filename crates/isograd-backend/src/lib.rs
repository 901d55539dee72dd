//! Reconstructions on the CPU or on a GPU, chosen when the program runs: what the command line, Python and fits do when
//! they are told a [`Backend`].
//!
//! ```
//! use isograd::{Backend, Cotangent, Grid, Options, PointCloud, Resolution};
//! use isograd_backend::Plan;
//!
//! # let points = (0..500).map(|i| {
//! #     let (z, turn) = ((2 * i + 1) as f64 / 500.0 - 1.0, i as f64 * 2.399963);
//! #     let r = (1.0 - z * z).sqrt();
//! #     [r * turn.cos(), r * turn.sin(), z]
//! # });
//! # let cloud = PointCloud::new(points.collect())?;
//! let grid = Grid::fit(&cloud, Resolution::Cells(20), 0.1)?;
//! let mut plan = Plan::new(Backend::Auto, grid, Options::default())?;
//! let result = plan.reconstruct(&cloud)?;
//! let cotangent = Cotangent { sdf: Some(result.sdf()?.values()), ..Cotangent::default() };
//! let gradient = result.pullback(&cotangent)?.points;
//! # assert_eq!(gradient.len(), cloud.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Without the features `cuda` and `vulkan` there is the CPU alone: every other backend is an error, but
//! [`Backend::Auto`], which goes to the CPU and [says why](Plan::note).
#![warn(missing_docs)]

mod error;
mod plan;
mod view;

pub use error::{Error, names};
pub use isograd::Backend;
pub use plan::Plan;
pub use view::{Made, View};

/// An array on a CUDA device that another program owns.
#[cfg(feature = "cuda")]
pub use isograd_gpu::DeviceArray;

/// `f32` or `f64`, wherever there are plans for it.
#[cfg(feature = "gpu")]
pub use isograd_gpu::host::Number;

/// `f32` or `f64`, wherever there are plans for it.
#[cfg(not(feature = "gpu"))]
pub use isograd::Pipeline as Number;
