//! Stanford polygon files: ascii, and binary in both byte orders.
//!
//! The reader is our own: crates such as `ply-rs-bw` keep each element as a map of names to values
//! (some hundred bytes per vertex) and cannot give the line of an error.

mod header;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::{write_cloud, write_mesh, write_surface};
