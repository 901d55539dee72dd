//! Readers, chosen by the format of the file.

use std::path::Path;

use crate::error::Error;
use crate::field::FieldFile;
use crate::format::{Format, detect};
use crate::geometry::Geometry;
use crate::options::ReadOptions;
use crate::source::{Input, Source};
use crate::{glb, las, numpy, obj, off, pcd, ply, stl, text, vtk};

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Points, or a mesh.
    Geometry(Geometry),
    /// A field on a grid.
    Field(FieldFile),
}

impl ReadOptions {
    fn open(&self, path: &Path) -> Result<(Source, Format), Error> {
        let source = Source::open_within(path, &self.limits)?;
        let format = detect(path, &source.name, &source.bytes)?;
        Ok((source, format))
    }

    /// Reads a file of points or of a mesh; `-` is standard input (PLY or text).
    pub fn read_geometry(&self, path: &Path) -> Result<Geometry, Error> {
        let (source, format) = self.open(path)?;
        self.parse_geometry(&source, format)
    }

    /// Reads a mesh: a file with faces.
    ///
    /// # Errors
    /// As [`Self::read_geometry`], and if the file has no face.
    pub fn read_mesh(&self, path: &Path) -> Result<Geometry, Error> {
        let geometry = self.read_geometry(path)?;
        if geometry.faces.is_empty() {
            return Err(Error::Format {
                file: path.display().to_string(),
                problem: "the file has points but no faces; a mesh is required".into(),
            });
        }
        Ok(geometry)
    }

    /// Reads a field from `.vti` or `.npz`.
    pub fn read_field(&self, path: &Path) -> Result<FieldFile, Error> {
        let (source, format) = self.open(path)?;
        self.parse_field(&source, format)
    }

    /// Reads a file of any kind: a field from `.vti`, or from `.npz` with an array `sdf` of three axes; otherwise
    /// points or a mesh.
    pub fn read(&self, path: &Path) -> Result<Content, Error> {
        let (source, format) = self.open(path)?;
        let is_field = match format {
            Format::Vti => true,
            Format::Npz => numpy::holds_field(&Input::new(&source, self))?,
            _ => false,
        };
        if is_field {
            self.parse_field(&source, format).map(Content::Field)
        } else {
            self.parse_geometry(&source, format).map(Content::Geometry)
        }
    }

    /// Reads points or a mesh from bytes in a known format.
    pub fn parse_geometry(&self, source: &Source, format: Format) -> Result<Geometry, Error> {
        self.check_columns(&source.name, format)?;
        let input = &Input::new(source, self);
        match format {
            Format::Ply => ply::read(input),
            Format::Text | Format::Pts | Format::Xyzn | Format::Xyzrgb => text::read(input, format),
            Format::Pcd => pcd::read(input),
            Format::Off => off::read(input),
            Format::Glb => glb::read(input),
            Format::Las => las::read(input),
            Format::Obj => obj::read(input),
            Format::Stl => stl::read(input),
            Format::Npy => numpy::read_npy(input),
            Format::Npz => numpy::read_npz(input),
            Format::Vtp => vtk::read_geometry(input),
            Format::Vti => Err(Error::Format {
                file: source.name.clone(),
                problem: "a VTI file has a field; points or a mesh are required".into(),
            }),
        }
    }

    /// Reads a field from bytes in a known format.
    pub fn parse_field(&self, source: &Source, format: Format) -> Result<FieldFile, Error> {
        self.check_columns(&source.name, format)?;
        let input = &Input::new(source, self);
        match format {
            Format::Npz => numpy::read_field(input),
            Format::Vti => vtk::read_field(input),
            other => Err(Error::Format {
                file: source.name.clone(),
                problem: format!(
                    "a field is required, in a .vti or .npz file; this is {}",
                    other.name()
                ),
            }),
        }
    }
}

/// [`ReadOptions::read_geometry`] with default options.
pub fn read_geometry(path: &Path) -> Result<Geometry, Error> {
    ReadOptions::default().read_geometry(path)
}

/// [`ReadOptions::read_mesh`] with default options.
///
/// # Errors
/// As [`read_geometry`], and if the file has no face.
pub fn read_mesh(path: &Path) -> Result<Geometry, Error> {
    ReadOptions::default().read_mesh(path)
}

/// [`ReadOptions::read_field`] with default options.
pub fn read_field(path: &Path) -> Result<FieldFile, Error> {
    ReadOptions::default().read_field(path)
}

/// [`ReadOptions::read`] with default options.
pub fn read(path: &Path) -> Result<Content, Error> {
    ReadOptions::default().read(path)
}

/// [`ReadOptions::parse_geometry`] with default options.
pub fn parse_geometry(source: &Source, format: Format) -> Result<Geometry, Error> {
    ReadOptions::default().parse_geometry(source, format)
}

/// [`ReadOptions::parse_field`] with default options.
pub fn parse_field(source: &Source, format: Format) -> Result<FieldFile, Error> {
    ReadOptions::default().parse_field(source, format)
}
