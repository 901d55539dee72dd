//! Binary little-endian PLY.

use std::io::{self, Write};

use isograd::{Mesh, PointCloud, Real};

use crate::bytes::{push_real, scalar_name, write_reals};
use crate::colors::byte_columns;
use crate::columns::{NORMAL, column_names, row};

/// Writes a mesh: vertices of type `T`, faces as lists of `int`.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let columns = ["x", "y", "z"].map(|name| (name, false));
    write_header::<T>(out, mesh.vertices().len(), &columns)?;
    write_face_header(out, mesh.faces().len())?;
    write_reals(out, mesh.vertices().iter().flatten().copied())?;
    write_faces(out, mesh.faces())
}

/// Writes a cloud in its own order: points, normals and attributes of type `T`, colors as bytes. An attribute of several
/// components becomes the properties `name_0`, `name_1` and so on.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    let columns = columns(cloud)?;
    write_header::<T>(out, cloud.len(), &columns)?;
    writeln!(out, "end_header")?;
    write_rows(out, cloud, &columns)
}

/// Writes a mesh whose vertices are a cloud, with its normals and attributes as [`write_cloud`] does.
pub(crate) fn write_surface<T: Real>(
    out: &mut impl Write,
    vertices: &PointCloud<T>,
    faces: &[[u32; 3]],
) -> io::Result<()> {
    let columns = columns(vertices)?;
    write_header::<T>(out, vertices.len(), &columns)?;
    write_face_header(out, faces.len())?;
    write_rows(out, vertices, &columns)?;
    write_faces(out, faces)
}

/// Name of each column, and whether it holds bytes.
fn columns<T: Real>(cloud: &PointCloud<T>) -> io::Result<Vec<(String, bool)>> {
    let names = column_names(cloud, char::is_ascii_graphic, &NORMAL, &[])?;
    Ok(names.into_iter().zip(byte_columns(cloud)).collect())
}

/// The header up to the properties of the vertices.
fn write_header<T: Real>(
    out: &mut impl Write,
    vertices: usize,
    properties: &[(impl std::fmt::Display, bool)],
) -> io::Result<()> {
    let real = scalar_name::<T>(["float", "double"]);
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "element vertex {vertices}")?;
    for (name, is_byte) in properties {
        let kind = if *is_byte { "uchar" } else { real };
        writeln!(out, "property {kind} {name}")?;
    }
    Ok(())
}

fn write_face_header(out: &mut impl Write, faces: usize) -> io::Result<()> {
    writeln!(out, "element face {faces}")?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")
}

fn write_rows<T: Real>(
    out: &mut impl Write,
    cloud: &PointCloud<T>,
    columns: &[(String, bool)],
) -> io::Result<()> {
    let mut bytes = Vec::new();
    for i in 0..cloud.len() {
        bytes.clear();
        for (value, (_, is_byte)) in row(cloud, i).zip(columns) {
            match is_byte {
                true => bytes.push(value.f64() as u8),
                false => push_real(&mut bytes, value),
            }
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn write_faces(out: &mut impl Write, faces: &[[u32; 3]]) -> io::Result<()> {
    for face in faces {
        let mut row = [3; 13];
        for (corner, bytes) in face.iter().zip(row[1..].chunks_exact_mut(4)) {
            bytes.copy_from_slice(&corner.to_le_bytes());
        }
        out.write_all(&row)?;
    }
    Ok(())
}
