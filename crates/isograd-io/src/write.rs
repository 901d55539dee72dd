//! Writing a file by its name.

use std::io::{self, Write};
use std::path::Path;

use isograd::{Field, Mesh, PointCloud, Real};

use crate::error::Error;
use crate::format::Format;
use crate::{atomic, numpy, obj, ply, stl, vtk};

/// What a mesh file may be called.
pub const MESH_ENDINGS: &[&str] = &["ply", "obj", "stl", "vtp"];
/// What a file of a field may be called.
pub const FIELD_ENDINGS: &[&str] = &["vti", "npz"];
/// What a file of points may be called.
pub const CLOUD_ENDINGS: &[&str] = &["ply", "npz", "xyz", "csv", "txt"];

/// Writes a mesh in the format that the name ends in ([`MESH_ENDINGS`]), in type `T` (STL: `f32`).
///
/// # Errors
/// A name with another ending, or what the operating system said; then the file at `path` is as before.
pub fn write_mesh<T: Real>(path: &Path, mesh: &Mesh<T>) -> Result<(), Error> {
    match Format::of_name(path) {
        Some(Format::Ply) => atomic::write(path, |out| ply::write_mesh(out, mesh)),
        Some(Format::Obj) => atomic::write(path, |out| obj::write_mesh(out, mesh)),
        Some(Format::Stl) => atomic::write(path, |out| stl::write_mesh(out, mesh)),
        Some(Format::Vtp) => atomic::write(path, |out| vtk::write_mesh(out, mesh)),
        _ => Err(wrong_ending(path, MESH_ENDINGS)),
    }
}

/// Writes a field in the format that the name ends in ([`FIELD_ENDINGS`]), in type `T`.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_field<T: Real>(path: &Path, field: &Field<T>) -> Result<(), Error> {
    match Format::of_name(path) {
        Some(Format::Vti) => atomic::write(path, |out| vtk::write_field(out, field)),
        Some(Format::Npz) => atomic::write(path, |out| numpy::write_field(out, field)),
        _ => Err(wrong_ending(path, FIELD_ENDINGS)),
    }
}

/// Writes a cloud in the format that the name ends in ([`CLOUD_ENDINGS`]), in its own order and in type
/// `T`, with its normals and attributes.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_cloud<T: Real>(path: &Path, cloud: &PointCloud<T>) -> Result<(), Error> {
    match Format::of_name(path) {
        Some(Format::Ply) => atomic::write(path, |out| ply::write_cloud(out, cloud)),
        Some(Format::Npz) => atomic::write(path, |out| numpy::write_cloud(out, cloud)),
        Some(Format::Text) => {
            let is_csv = path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("csv"));
            atomic::write(path, |out| {
                write_text(out, cloud, if is_csv { ',' } else { ' ' })
            })
        }
        _ => Err(wrong_ending(path, CLOUD_ENDINGS)),
    }
}

/// Columns of text under a line of names, with the fewest digits that give back the same numbers.
fn write_text<T: Real>(
    out: &mut impl Write,
    cloud: &PointCloud<T>,
    delimiter: char,
) -> io::Result<()> {
    let mut names: Vec<String> = ["x", "y", "z"].map(String::from).to_vec();
    if cloud.normals().is_some() {
        names.extend(["nx", "ny", "nz"].map(String::from));
    }
    for attribute in cloud.attributes() {
        let plain = attribute
            .name
            .replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        for component in 0..attribute.components {
            names.push(match attribute.components {
                1 => plain.clone(),
                _ => format!("{plain}_{component}"),
            });
        }
    }
    let separator = delimiter.to_string();
    let comment = if delimiter == ',' { "" } else { "# " };
    writeln!(out, "{comment}{}", names.join(&separator))?;
    for (i, point) in cloud.points().iter().enumerate() {
        let mut row = point.to_vec();
        row.extend(cloud.normals().into_iter().flat_map(|normals| normals[i]));
        for attribute in cloud.attributes() {
            let n = attribute.components;
            row.extend(&attribute.values[i * n..(i + 1) * n]);
        }
        let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
        writeln!(out, "{}", row.join(&separator))?;
    }
    Ok(())
}

/// Refuses an output that could not be written at the end of a long computation: an ending that is not
/// among `endings`, a folder that is not there, a folder in the file's place.
///
/// # Errors
/// What is wrong with the path.
pub fn check_output(path: &Path, endings: &[&str]) -> Result<(), Error> {
    let known = |e: &str| endings.iter().any(|ending| e.eq_ignore_ascii_case(ending));
    if !path.extension().and_then(|e| e.to_str()).is_some_and(known) {
        return Err(wrong_ending(path, endings));
    }
    let file = path.display().to_string();
    if path.is_dir() {
        return Err(Error::Folder { file });
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    match folder.metadata() {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(Error::Write {
            file,
            source: io::ErrorKind::NotADirectory.into(),
        }),
        Err(source) => Err(Error::Write { file, source }),
    }
}

fn wrong_ending(path: &Path, endings: &[&str]) -> Error {
    Error::Format {
        file: path.display().to_string(),
        problem: format!("the name must end in .{}", endings.join(" or .")),
    }
}
