//! Stanford polygon files: ascii, and binary in both byte orders.
//!
//! Existing crates were tried first: `ply-rs-bw` keeps each element as a map of names to values (some
//! hundred bytes a vertex) and can't name the line of an error, so the reader is our own.

mod header;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::{write_cloud, write_mesh};
