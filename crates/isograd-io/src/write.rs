//! Writers, chosen by the extension of the file.

use std::io;
use std::path::Path;

use isograd::{Field, Mesh, PointCloud, Real};

use crate::error::Error;
use crate::format::Format;
use crate::{atomic, glb, numpy, obj, off, pcd, ply, stl, text, vtk};

/// Extensions of mesh files.
pub const MESH_EXTENSIONS: &[&str] = &["ply", "obj", "stl", "off", "glb", "vtp"];
/// Extensions of files with a field.
pub const FIELD_EXTENSIONS: &[&str] = &["vti", "npz"];
/// Extensions of point cloud files.
pub const CLOUD_EXTENSIONS: &[&str] = &["ply", "npz", "xyz", "csv", "txt", "pcd"];

/// The format of a file to write; standard output, `-`, gets `streamed`.
fn format_of(path: &Path, streamed: Format) -> Option<Format> {
    match atomic::is_standard_output(path) {
        true => Some(streamed),
        false => Format::from_path(path),
    }
}

/// Writes a mesh in the format of the extension ([`MESH_EXTENSIONS`]) and in type `T` (STL and GLB: `f32`); `-` is standard output
/// (PLY).
///
/// # Errors
/// Another extension, or a failed write, which leaves the file at `path` unchanged.
pub fn write_mesh<T: Real>(path: &Path, mesh: &Mesh<T>) -> Result<(), Error> {
    match format_of(path, Format::Ply) {
        Some(Format::Ply) => atomic::write(path, |out| ply::write_mesh(out, mesh)),
        Some(Format::Obj) => atomic::write(path, |out| obj::write_mesh(out, mesh)),
        Some(Format::Stl) => atomic::write(path, |out| stl::write_mesh(out, mesh)),
        Some(Format::Off) => atomic::write(path, |out| off::write_mesh(out, mesh)),
        Some(Format::Glb) => atomic::write(path, |out| glb::write_mesh(out, mesh)),
        Some(Format::Vtp) => atomic::write(path, |out| vtk::write_mesh(out, mesh)),
        _ => Err(wrong_extension(path, MESH_EXTENSIONS)),
    }
}

/// Extensions of mesh files that hold data of the vertices.
pub const SURFACE_EXTENSIONS: &[&str] = &["ply", "vtp"];

/// Writes a mesh whose vertices are a cloud, with its normals and attributes, in the format of the extension
/// ([`SURFACE_EXTENSIONS`]) and in type `T`; `-` is standard output (PLY). [Colors](crate::byte_colors) are bytes: in PLY
/// `red`, `green` and `blue`, in VTP the array `RGB`.
///
/// # Errors
/// Another extension, or a failed write, which leaves the file at `path` unchanged; a face with a vertex that does not exist.
pub fn write_surface<T: Real>(
    path: &Path,
    vertices: &PointCloud<T>,
    faces: &[[u32; 3]],
) -> Result<(), Error> {
    let is_missing = |face: &[u32; 3]| face.iter().any(|&v| v as usize >= vertices.len());
    if let Some(face) = faces.iter().position(is_missing) {
        return Err(Error::Format {
            file: path.display().to_string(),
            problem: format!(
                "face {face} has a vertex that is not among the {}; correct the face",
                vertices.len()
            ),
        });
    }
    match format_of(path, Format::Ply) {
        Some(Format::Ply) => atomic::write(path, |out| ply::write_surface(out, vertices, faces)),
        Some(Format::Vtp) => atomic::write(path, |out| vtk::write_surface(out, vertices, faces)),
        _ => Err(wrong_extension(path, SURFACE_EXTENSIONS)),
    }
}

/// Writes a field in the format of the extension ([`FIELD_EXTENSIONS`]) and in type `T`; `-` is standard output (VTI).
pub fn write_field<T: Real>(path: &Path, field: &Field<T>) -> Result<(), Error> {
    match format_of(path, Format::Vti) {
        Some(Format::Vti) => atomic::write(path, |out| vtk::write_field(out, field)),
        Some(Format::Npz) => atomic::write(path, |out| numpy::write_field(out, field)),
        _ => Err(wrong_extension(path, FIELD_EXTENSIONS)),
    }
}

/// Writes a cloud with its normals and attributes in the format of the extension ([`CLOUD_EXTENSIONS`]),
/// in its own order and in type `T`; `-` is standard output (PLY).
pub fn write_cloud<T: Real>(path: &Path, cloud: &PointCloud<T>) -> Result<(), Error> {
    match format_of(path, Format::Ply) {
        Some(Format::Ply) => atomic::write(path, |out| ply::write_cloud(out, cloud)),
        Some(Format::Npz) => atomic::write(path, |out| numpy::write_cloud(out, cloud)),
        Some(Format::Pcd) => atomic::write(path, |out| pcd::write_cloud(out, cloud)),
        Some(Format::Text) => {
            let extension = path.extension().unwrap_or_default();
            let is_csv = extension.eq_ignore_ascii_case("csv");
            let delimiter = if is_csv { "," } else { " " };
            atomic::write(path, |out| text::write_cloud(out, cloud, delimiter))
        }
        _ => Err(wrong_extension(path, CLOUD_EXTENSIONS)),
    }
}

/// Whether the extension of a name is among `extensions`, in upper or lower case.
pub fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let known = |e: &str| extensions.iter().any(|known| e.eq_ignore_ascii_case(known));
    path.extension().and_then(|e| e.to_str()).is_some_and(known)
}

/// Checks before a long computation that its output can be written.
///
/// # Errors
/// An extension that is not among `extensions`, a missing folder, or a folder with the file's name. `-`, standard output, has
/// no error.
pub fn check_output(path: &Path, extensions: &[&str]) -> Result<(), Error> {
    if atomic::is_standard_output(path) {
        return Ok(());
    }
    if !has_extension(path, extensions) {
        return Err(wrong_extension(path, extensions));
    }
    let file = path.display().to_string();
    if path.is_dir() {
        return Err(Error::Folder { file });
    }
    // A device or a pipe has no folder of its own.
    if path.exists() {
        return Ok(());
    }
    let target = atomic::resolve(path).and_then(|target| atomic::folder_of(&target).metadata());
    match target {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(Error::Write {
            file,
            source: io::ErrorKind::NotADirectory.into(),
        }),
        Err(source) => Err(Error::Write { file, source }),
    }
}

fn wrong_extension(path: &Path, extensions: &[&str]) -> Error {
    Error::Format {
        file: path.display().to_string(),
        problem: format!("the name must end in .{}", extensions.join(" or .")),
    }
}
