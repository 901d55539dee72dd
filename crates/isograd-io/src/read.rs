//! Reading a file by its name.

use std::path::Path;

use crate::error::Error;
use crate::field::FieldFile;
use crate::format::{Format, choose};
use crate::geometry::Geometry;
use crate::source::Source;
use crate::{numpy, obj, ply, stl, text, vtk};

/// What a file turned out to hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Points, or a mesh.
    Geometry(Geometry),
    /// A field on a grid.
    Field(FieldFile),
}

/// Reads a file of points or of a mesh; `-` is standard input (PLY or text).
///
/// # Errors
/// See [`Error`].
pub fn read_geometry(path: &Path) -> Result<Geometry, Error> {
    let source = Source::open(path)?;
    let format = choose(path, &source.name, &source.bytes)?;
    parse_geometry(&source, format)
}

/// Reads a mesh: a file with faces.
///
/// # Errors
/// As [`read_geometry`], and where the file has no face.
pub fn read_mesh(path: &Path) -> Result<Geometry, Error> {
    let geometry = read_geometry(path)?;
    if geometry.faces.is_empty() {
        return Err(Error::Format {
            file: path.display().to_string(),
            problem: "it has points but no faces; a mesh is needed here".into(),
        });
    }
    Ok(geometry)
}

/// Reads a field from `.vti` or `.npz`.
///
/// # Errors
/// See [`Error`].
pub fn read_field(path: &Path) -> Result<FieldFile, Error> {
    let source = Source::open(path)?;
    let format = choose(path, &source.name, &source.bytes)?;
    parse_field(&source, format)
}

/// Reads whatever a file holds: a field from `.vti`, and from `.npz` with an array `sdf`; else points or
/// a mesh.
///
/// # Errors
/// See [`Error`].
pub fn read(path: &Path) -> Result<Content, Error> {
    let source = Source::open(path)?;
    let format = choose(path, &source.name, &source.bytes)?;
    let is_field = match format {
        Format::Vti => true,
        // Member names stand in the archive as they are.
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
            problem: "VTI holds a field; points or a mesh are needed here".into(),
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
            problem: format!("{} holds no field; give a .vti or .npz", other.name()),
        }),
    }
}
