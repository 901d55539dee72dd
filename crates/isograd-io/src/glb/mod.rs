//! glTF 2.0 in one binary file (GLB): a part in JSON and a part with the numbers.
//!
//! The reader is our own, on `serde_json`: the crate `gltf` had its last release (1.4.1) in May 2024, validates more than meshes
//! need, and its errors do not name the accessor.

mod accessor;
mod buffers;
mod document;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::write_mesh;

/// First bytes of a file.
const MAGIC: &[u8] = b"glTF";
/// Types of the two parts.
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";
