//! Readers and writers of point clouds, meshes and signed distance fields.
//!
//! ```no_run
//! use std::path::Path;
//!
//! let file = isograd_io::read_geometry(Path::new("cloud.ply"))?;
//! let cloud = file.cloud::<f32>()?;
//! isograd_io::write_cloud(Path::new("copy.npz"), &cloud)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | format | read as | written as |
//! |---|---|---|
//! | PLY (ascii, binary of both byte orders) | points, mesh | points, mesh |
//! | XYZ, CSV, TXT | points | points |
//! | PTS, XYZN, XYZRGB | points | |
//! | PCD (ascii, binary, compressed) | points | points |
//! | LAS (not LAZ) | points | |
//! | OBJ, STL, OFF, GLB | points, mesh | mesh |
//! | NPY | points | |
//! | NPZ | points, field | points, field |
//! | VTP | points, mesh | mesh |
//! | VTI | field | field |
//!
//! PLY and VTP meshes may have normals and attributes at their vertices ([`write_surface`]). `-` is standard input in readers, and
//! standard output in writers.
//!
//! The columns of a text file are found by the names in its header: `x`, `X`, `x [m]`, `Points:0`, `Points_0`,
//! `easting`, `nx`, `Normals:0` and the like. A header without coordinates is an error, and [`Columns`] choose.
//! Colors are the attributes `red`, `green` and `blue`, with the numbers of the file: 0 to 255, in LAS 0 to 65535, in
//! GLB 0 to 1. Points of a PCD whose coordinates are all NaN are missing ones, and are skipped. A GLB is read in the frame of its
//! scene.
//!
//! Not supported: LAZ (convert it to LAS with `laszip` or `pdal translate`), glTF in several files (save it as GLB) and with
//! compressed meshes, binary OFF, E57, and fields in OpenVDB files.
//!
//! Columns or properties `sensor_x`, `sensor_y` and `sensor_z`, or an array `sensor` of three components, hold the
//! sensor position of each point.
//!
//! Guarantees:
//! - No input causes a panic. Memory is bounded by the size of the file, not by the counts in its header or by the size
//!   to which it unpacks ([`Limits`]), and so is the number of steps.
//! - Every error names the file, the location (line, byte, element or row), the problem, and the remedy.
//! - Writing is atomic: a file is complete, and on the disk, or absent ([`atomic`]).
//! - Numbers are read in double precision, exactly, and written in their own type; numbers that are
//!   written and read back have the same bits (except STL and GLB, which are single precision).
#![warn(missing_docs)]

pub mod atomic;
mod bytes;
mod colors;
mod columns;
mod error;
mod field;
mod fields;
mod format;
mod geometry;
mod glb;
mod las;
mod limits;
mod lines;
mod message;
mod names;
mod number;
mod numpy;
mod obj;
mod off;
mod options;
mod pcd;
mod ply;
mod polygon;
mod read;
mod source;
mod stl;
mod text;
mod vtk;
mod write;

pub use colors::byte_colors;
pub use error::{Error, Location};
pub use field::FieldFile;
pub use format::Format;
pub use geometry::{Geometry, is_sensor};
pub use limits::{Limits, parse_size};
pub use message::{LONGEST_LINE, printable};
pub use number::Dtype;
pub use options::{Attributes, Columns, NotFinite, ReadOptions};
pub use read::{Content, parse_field, parse_geometry, read, read_field, read_geometry, read_mesh};
pub use source::Source;
pub use write::{
    CLOUD_EXTENSIONS, FIELD_EXTENSIONS, MESH_EXTENSIONS, SURFACE_EXTENSIONS, check_output,
    has_extension, write_cloud, write_field, write_mesh, write_surface,
};
