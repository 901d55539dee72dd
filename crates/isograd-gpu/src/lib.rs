//! The stages of isograd as GPU kernels: one source in Rust, run on NVIDIA devices through CUDA and on
//! others through Vulkan.
//!
//! A stage is one file, forward and pullback side by side, as in [`isograd`]; data stay in [`Buffer`]s on a
//! [`Device`] from the points to φ and back, and only [`Device::download`] copies to the host. Formulas
//! of single elements are those of [`isograd_element`], compiled a second time as parts of kernels.
//!
//! # Determinism
//! On one device, an input always gives the same bits: sums have a fixed order, and nothing
//! is added by atomic operations on floating-point numbers.

// The macro makes a public module of every kernel, documented or not.
#![allow(missing_docs)]

mod device;
pub mod distance;
mod grid;
pub mod host;
pub mod isosurface;
pub mod neighbors;
pub mod normals;
pub mod orient;
pub mod pipeline;
pub mod poisson;
pub mod primitives;
pub mod refine;
pub mod splat;
mod spread;
mod trilinear;
mod vector;

include!(concat!(env!("OUT_DIR"), "/element.rs"));

#[cfg(feature = "wgpu")]
pub use device::Vulkan;
pub use device::{Buffer, Device, Effort, Error, Memory, Scalar};
#[cfg(feature = "cuda")]
pub use device::{Cuda, DeviceArray};
