//! PolyData of a mesh, as raw appended arrays.

use std::io::{self, Write};

use isograd::{Mesh, PointCloud, Real};

use crate::bytes::{push_real, scalar_name, size, write_reals};
use crate::colors::{byte_colors, channels};
use crate::names::{UniqueNames, is_normal};

/// An array of the point data.
struct PointArray {
    name: String,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

/// Writes a mesh, vertices of type `T`.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    write(out, mesh.vertices(), mesh.faces(), None, &[])
}

/// Writes a mesh whose vertices are a cloud: normals as `Normals`, [colors](byte_colors) as an array `RGB` or `RGBA` of
/// bytes, and the other attributes under their names, of type `T`.
pub(crate) fn write_surface<T: Real>(
    out: &mut impl Write,
    vertices: &PointCloud<T>,
    faces: &[[u32; 3]],
) -> io::Result<()> {
    let normals = vertices.normals();
    let data = point_data(vertices);
    write(out, vertices.points(), faces, normals, &data)
}

/// The colors and the attributes.
fn point_data<T: Real>(cloud: &PointCloud<T>) -> Vec<PointArray> {
    let real = scalar_name::<T>(["Float32", "Float64"]);
    let attributes = cloud.attributes();
    let are_colors = byte_colors(attributes);
    let channels: Vec<usize> = channels(attributes).into_iter().flatten().collect();
    let has_colors = channels.first().is_some_and(|&red| are_colors[red]);
    let mut unique = UniqueNames::default();
    let mut arrays = Vec::new();
    if has_colors {
        let values = |i: usize| channels.iter().map(move |&k| attributes[k].values[i]);
        arrays.push(PointArray {
            name: unique.add(color_name(channels.len()), |_| true),
            kind: "UInt8",
            components: channels.len(),
            bytes: (0..cloud.len()).flat_map(values).map(byte).collect(),
        });
    }
    for (k, attribute) in attributes.iter().enumerate() {
        if has_colors && channels.contains(&k) {
            continue;
        }
        let values = attribute.values.iter().copied();
        let (kind, bytes) = match are_colors[k] {
            true => ("UInt8", values.map(byte).collect()),
            false => (real, reals(values)),
        };
        let special = |c: char| matches!(c, '&' | '<' | '>' | '"' | '\'') || c.is_control();
        let name = match (are_colors[k], attribute.name.as_str()) {
            (true, _) => color_name(attribute.components).into(),
            (_, "") => "attribute".into(),
            (_, name) => name.replace(special, "_"),
        };
        arrays.push(PointArray {
            name: unique.add(&name, |name| !is_normal(name) && name != NORMALS),
            kind,
            components: attribute.components,
            bytes,
        });
    }
    arrays
}

/// Name of the array of normals.
const NORMALS: &str = "Normals";

fn color_name(components: usize) -> &'static str {
    if components == 4 { "RGBA" } else { "RGB" }
}

fn byte<T: Real>(value: T) -> u8 {
    value.f64() as u8
}

fn reals<T: Real>(values: impl Iterator<Item = T>) -> Vec<u8> {
    let mut bytes = Vec::new();
    values.for_each(|value| push_real(&mut bytes, value));
    bytes
}

/// Writes vertices, faces, normals and further data of the vertices.
fn write<T: Real>(
    out: &mut impl Write,
    vertices: &[[T; 3]],
    faces: &[[u32; 3]],
    normals: Option<&[[T; 3]]>,
    data: &[PointArray],
) -> io::Result<()> {
    let real = scalar_name::<T>(["Float32", "Float64"]);
    let vectors = vertices.len() * 3 * size::<T>();
    let mut offset = 0;
    // Each array is preceded by its length in 8 bytes.
    let mut array = |kind: &str, name: &str, components: usize, length: usize| {
        let begin = offset;
        offset += length + 8;
        format!(
            r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{begin}"/>"#
        )
    };
    let points = array(real, "Points", 3, vectors);
    let connectivity = array("Int64", "connectivity", 1, faces.len() * 3 * 8);
    let offsets = array("Int64", "offsets", 1, faces.len() * 8);
    let normal_array = normals.map(|_| array(real, NORMALS, 3, vectors));
    let arrays = data
        .iter()
        .map(|a| array(a.kind, &a.name, a.components, a.bytes.len()));
    let arrays: Vec<String> = normal_array.into_iter().chain(arrays).collect();
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <PolyData>
    <Piece NumberOfPoints="{}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{}">
      <Points>
        {points}
      </Points>
      <Polys>
        {connectivity}
        {offsets}
      </Polys>
"#,
        vertices.len(),
        faces.len(),
    )?;
    if !arrays.is_empty() {
        let active = if normals.is_some() {
            " Normals=\"Normals\""
        } else {
            ""
        };
        writeln!(out, "      <PointData{active}>")?;
        arrays
            .iter()
            .try_for_each(|array| writeln!(out, "        {array}"))?;
        writeln!(out, "      </PointData>")?;
    }
    out.write_all(b"    </Piece>\n  </PolyData>\n  <AppendedData encoding=\"raw\">\n_")?;
    write_length(out, vectors)?;
    write_reals(out, vertices.iter().flatten().copied())?;
    write_faces(out, faces)?;
    if let Some(normals) = normals {
        write_length(out, vectors)?;
        write_reals(out, normals.iter().flatten().copied())?;
    }
    for array in data {
        write_length(out, array.bytes.len())?;
        out.write_all(&array.bytes)?;
    }
    out.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
}

fn write_length(out: &mut impl Write, bytes: usize) -> io::Result<()> {
    out.write_all(&(bytes as u64).to_le_bytes())
}

/// Writes the arrays `connectivity` and `offsets`.
fn write_faces(out: &mut impl Write, faces: &[[u32; 3]]) -> io::Result<()> {
    write_length(out, faces.len() * 3 * 8)?;
    for corner in faces.iter().flatten() {
        out.write_all(&i64::from(*corner).to_le_bytes())?;
    }
    write_length(out, faces.len() * 8)?;
    for face in 1..=faces.len() as i64 {
        out.write_all(&(3 * face).to_le_bytes())?;
    }
    Ok(())
}
