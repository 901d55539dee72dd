//! Files of the Point Cloud Library: ascii, binary, and binary compressed.
//!
//! The reader is our own: crates such as `pcd-rs` trust the counts of the header and do not read packed colors.

mod header;
mod lzf;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::write_cloud;

/// Names of the components of a normal.
const NORMAL: [&str; 3] = ["normal_x", "normal_y", "normal_z"];
/// Field of bytes without a meaning.
const PADDING: &str = "_";
/// Fields of colors, the channels of which are bytes of one number.
const PACKED: [&str; 2] = ["rgb", "rgba"];
