//! The front for hosts (the command line, Python): a backend by its name, a cloud in the host's memory, and what is
//! asked for back in it.
//!
//! [`Plan`] is [`isograd::Reconstructor`] on a [`Device`](crate::Device), and [`Reconstruction`] what it makes: data
//! stay there, and what is asked for is copied once. Which runtime works is chosen by value; everything below is
//! compiled here, once for each number type.
//!
//! # What differs from the CPU
//! - The surface is found on the grid of φ, also with [`Auto`](isograd::SurfaceResolution::Auto); a spacing or a factor
//!   other than 1 is an error. The solve is dense; [`Sparse`](isograd::Solve::Sparse) is an error.
//! - [`trim`](isograd::isosurface::trim) and [`sheet`](isograd::sheet) are errors.
//! - Walls are free, also with [`Auto`](isograd::poisson::Walls::Auto); closed ones are an error.
//! - The signs of [`Method::Auto`](isograd::orient::Method::Auto) and
//!   [`Method::Sensors`](isograd::orient::Method::Sensors), and the radii with them, are found on the CPU.
//! - Radii that are found on the device, with given normals, their signs or parity, hold 24 samples also where samples lie
//!   along lines, and do not grow up to the next ones. A [fixed](isograd::neighbors::Radius::Fixed) radius is the same.
//! - With [`Method::Previous`](isograd::orient::Method::Previous) radii are found by the first call, by one with another
//!   number of points, and where more than 3 % of the axes have turned far. Every other call keeps them.

mod backend;
mod error;
mod extend;
mod plan;
mod result;
mod work;

pub use backend::{Choice, choose};
pub use error::Error;
pub use plan::Plan;
pub use result::Reconstruction;
pub use work::Number;
