//! Binary little-endian PLY.

use std::io::{self, Write};

use isograd::{Mesh, PointCloud, Real};

use crate::bytes::{push_real, push_vector, scalar_name};

/// A mesh: vertices of type `T`, faces as lists of `int`.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let real = scalar_name::<T>(["float", "double"]);
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "element vertex {}", mesh.vertices().len())?;
    for name in ["x", "y", "z"] {
        writeln!(out, "property {real} {name}")?;
    }
    writeln!(out, "element face {}", mesh.faces().len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    let mut row = Vec::new();
    for &vertex in mesh.vertices() {
        row.clear();
        push_vector(&mut row, vertex);
        out.write_all(&row)?;
    }
    for face in mesh.faces() {
        row.clear();
        row.push(3);
        for corner in face {
            row.extend(corner.to_le_bytes());
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// A cloud in its own order: points, normals and attributes of type `T`. An attribute of several
/// components becomes the properties `name_0`, `name_1` and so on.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    let real = scalar_name::<T>(["float", "double"]);
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "element vertex {}", cloud.len())?;
    for name in property_names(cloud) {
        writeln!(out, "property {real} {name}")?;
    }
    writeln!(out, "end_header")?;
    let mut row = Vec::new();
    for (i, &point) in cloud.points().iter().enumerate() {
        row.clear();
        push_vector(&mut row, point);
        if let Some(normals) = cloud.normals() {
            push_vector(&mut row, normals[i]);
        }
        for attribute in cloud.attributes() {
            let n = attribute.components;
            for &value in &attribute.values[i * n..(i + 1) * n] {
                push_real(&mut row, value);
            }
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// Names without white space, none of them twice.
fn property_names<T: Real>(cloud: &PointCloud<T>) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z"].map(String::from).to_vec();
    if cloud.normals().is_some() {
        names.extend(["nx", "ny", "nz"].map(String::from));
    }
    for attribute in cloud.attributes() {
        let plain: String = attribute
            .name
            .chars()
            .map(|c| if c.is_ascii_graphic() { c } else { '_' })
            .collect();
        for component in 0..attribute.components {
            let mut name = match (plain.as_str(), attribute.components) {
                ("", _) => format!("attribute_{component}"),
                (plain, 1) => plain.to_string(),
                (plain, _) => format!("{plain}_{component}"),
            };
            while names.contains(&name) {
                name.push('_');
            }
            names.push(name);
        }
    }
    names
}
