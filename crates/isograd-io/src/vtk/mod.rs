//! VTK's XML files: PolyData (`.vtp`) and ImageData (`.vti`).
//!
//! The layout of the arrays is read here, XML, base64 and zlib by crates: `vtkio` is no longer maintained
//! and allocates as much as a header declares.

mod data;
mod image;
mod poly;
mod stream;
mod write_poly;
mod xml;

pub(crate) use image::{read as read_field, write as write_field};
pub(crate) use poly::read as read_geometry;
pub(crate) use write_poly::{write_mesh, write_surface};
