//! VTK's XML files: PolyData (`.vtp`) and ImageData (`.vti`).
//!
//! `vtkio` was tried first: its last release dates from years ago and it allocates what a header asks
//! for. XML, base64 and zlib come from crates; the layout of the arrays is read here.

mod data;
mod image;
mod poly;
mod xml;

pub(crate) use image::{read as read_field, write as write_field};
pub(crate) use poly::{read as read_geometry, write as write_mesh};
