//! NumPy's `.npy` and `.npz`.
//!
//! The array reader is our own: the errors of `npyz` give no byte offset, and it would add a parser
//! generator and three crates of number types to replace the eighty lines that read a header. Archives
//! are read and written by the crate `zip`.

mod array;
mod npz;

pub(crate) use npz::{holds_field, read_field, read_npy, read_npz, write_cloud, write_field};
