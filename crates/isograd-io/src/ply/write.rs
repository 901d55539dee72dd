//! Binary little-endian PLY.

use std::io::{self, Write};

use isograd::{Mesh, PointCloud, Real};

use crate::bytes::{scalar_name, write_reals};
use crate::columns::{NORMAL, column_names, row};

/// Writes a mesh: vertices of type `T`, faces as lists of `int`.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    write_header::<T>(out, mesh.vertices().len(), &["x", "y", "z"])?;
    writeln!(out, "element face {}", mesh.faces().len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    write_reals(out, mesh.vertices().iter().flatten().copied())?;
    for face in mesh.faces() {
        let mut row = [3; 13];
        for (corner, bytes) in face.iter().zip(row[1..].chunks_exact_mut(4)) {
            bytes.copy_from_slice(&corner.to_le_bytes());
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// Writes a cloud in its own order: points, normals and attributes of type `T`. An attribute of several
/// components becomes the properties `name_0`, `name_1` and so on.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    let names = column_names(cloud, char::is_ascii_graphic, &NORMAL, &[])?;
    write_header::<T>(out, cloud.len(), &names)?;
    writeln!(out, "end_header")?;
    write_reals(out, (0..cloud.len()).flat_map(|i| row(cloud, i)))
}

/// The header up to the properties of the vertices.
fn write_header<T: Real>(
    out: &mut impl Write,
    vertices: usize,
    properties: &[impl std::fmt::Display],
) -> io::Result<()> {
    let real = scalar_name::<T>(["float", "double"]);
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "element vertex {vertices}")?;
    for name in properties {
        writeln!(out, "property {real} {name}")?;
    }
    Ok(())
}
