//! NumPy's `.npy` and `.npz`.
//!
//! The array reader is our own: `npyz` hands out iterators whose errors name no byte. Archives are
//! read by the crate `zip` and written here.

mod archive;
mod array;
mod npz;

pub(crate) use npz::{read_field, read_npy, read_npz, write_cloud, write_field};
