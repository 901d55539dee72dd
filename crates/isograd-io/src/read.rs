//! Readers, chosen by the format of the file.

use std::path::Path;

use crate::error::Error;
use crate::field::FieldFile;
use crate::format::{Format, detect};
use crate::geometry::Geometry;
use crate::source::Source;
use crate::{numpy, obj, ply, stl, text, vtk};

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Points, or a mesh.
    Geometry(Geometry),
    /// A field on a grid.
    Field(FieldFile),
}

fn open(path: &Path) -> Result<(Source, Format), Error> {
    let source = Source::open(path)?;
    let format = detect(path, &source.name, &source.bytes)?;
    Ok((source, format))
}

/// Reads a file of points or of a mesh; `-` is standard input (PLY or text).
///
/// # Errors
/// See [`Error`].
pub fn read_geometry(path: &Path) -> Result<Geometry, Error> {
    let (source, format) = open(path)?;
    parse_geometry(&source, format)
}

/// Reads a mesh: a file with faces.
///
/// # Errors
/// As [`read_geometry`], and if the file has no face.
pub fn read_mesh(path: &Path) -> Result<Geometry, Error> {
    let geometry = read_geometry(path)?;
    if geometry.faces.is_empty() {
        return Err(Error::Format {
            file: path.display().to_string(),
            problem: "the file has points but no faces; a mesh is required".into(),
        });
    }
    Ok(geometry)
}

/// Reads a field from `.vti` or `.npz`.
///
/// # Errors
/// See [`Error`].
pub fn read_field(path: &Path) -> Result<FieldFile, Error> {
    let (source, format) = open(path)?;
    parse_field(&source, format)
}

/// Reads a file of any kind: a field from `.vti`, or from `.npz` with an array `sdf`; otherwise points or
/// a mesh.
///
/// # Errors
/// See [`Error`].
pub fn read(path: &Path) -> Result<Content, Error> {
    let (source, format) = open(path)?;
    let is_field = match format {
        Format::Vti => true,
        // Names of members are not compressed.
        Format::Npz => memchr::memmem::find(&source.bytes, b"sdf.npy").is_some(),
        _ => false,
    };
    if is_field {
        parse_field(&source, format).map(Content::Field)
    } else {
        parse_geometry(&source, format).map(Content::Geometry)
    }
}

/// Reads points or a mesh from bytes in a known format.
///
/// # Errors
/// See [`Error`].
pub fn parse_geometry(source: &Source, format: Format) -> Result<Geometry, Error> {
    match format {
        Format::Ply => ply::read(source),
        Format::Text => text::read(source),
        Format::Obj => obj::read(source),
        Format::Stl => stl::read(source),
        Format::Npy => numpy::read_npy(source),
        Format::Npz => numpy::read_npz(source),
        Format::Vtp => vtk::read_geometry(source),
        Format::Vti => Err(Error::Format {
            file: source.name.clone(),
            problem: "a VTI file has a field; points or a mesh are required".into(),
        }),
    }
}

/// Reads a field from bytes in a known format.
///
/// # Errors
/// See [`Error`].
pub fn parse_field(source: &Source, format: Format) -> Result<FieldFile, Error> {
    match format {
        Format::Npz => numpy::read_field(source),
        Format::Vti => vtk::read_field(source),
        other => Err(Error::Format {
            file: source.name.clone(),
            problem: format!(
                "a field is required, in a .vti or .npz file; this is {}",
                other.name()
            ),
        }),
    }
}
