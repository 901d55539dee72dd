//! The front for hosts (the command line, Python): a backend by its name, a cloud in the host's memory, and what is
//! asked for back in it.
//!
//! [`Plan`] is [`isograd::Reconstructor`] on a [`Device`](crate::Device), and [`Reconstruction`] what it makes: data
//! stay there, and what is asked for is copied once. Which runtime works is chosen by value; everything below is
//! compiled here, once for each number type.
//!
//! # What differs from the CPU
//! - Radii and sides of normals are found on the CPU, as [`Held`](crate::pipeline::Held) says, at every call.
//! - With [`Method::Previous`](isograd::orient::Method::Previous) they are found by the first call, and by one with
//!   another number of points. Every other call keeps its radii, and takes sides from the normals of the call before,
//!   all on the device; what its report says of the samples is what the first found.

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
