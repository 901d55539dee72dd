//! PolyData: points with their data, polygons and strips.

use std::io::{self, Write};

use isograd::data::Attribute;
use isograd::{Mesh, Real};

use super::data::{DataArray, VtkFile};
use super::xml::Node;
use crate::bytes::{push_vector, scalar_name, size};
use crate::error::Error;
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite, triangulate};
use crate::number::{Dtype, as_index};
use crate::source::Source;

/// Reads all pieces as one. Point data are kept where every piece has them; normals are the point
/// data's active normals, or the array called `Normals`.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let file = VtkFile::open(source, "PolyData")?;
    let mut geometry = Geometry {
        points: Vec::new(),
        normals: None,
        attributes: Vec::new(),
        faces: Vec::new(),
        dtype: Dtype::Text,
        format: Format::Vtp,
    };
    for (index, piece) in file
        .data_set("PolyData")?
        .children_named("Piece")
        .enumerate()
    {
        let offset = geometry.points.len();
        read_points(&file, piece, &mut geometry)?;
        read_point_data(&file, piece, index == 0, offset, &mut geometry)?;
        let count = geometry.points.len() - offset;
        for (section, is_strip) in [("Polys", false), ("Strips", true)] {
            if let Some(node) = piece.child(section) {
                read_cells(&file, node, is_strip, offset, count, &mut geometry.faces)?;
            }
        }
    }
    Ok(geometry)
}

fn read_points(file: &VtkFile, piece: &Node, geometry: &mut Geometry) -> Result<(), Error> {
    let count = file.count(piece, "NumberOfPoints")?;
    let node = piece
        .child("Points")
        .and_then(|points| points.child("DataArray"));
    let Some(node) = node else {
        return match count {
            0 => Ok(()),
            _ => Err(file.error(piece, "the piece has no array of points")),
        };
    };
    let array = file.array(node)?;
    let rows = rows_of_three(file, node, &array, count)?;
    for (index, &point) in rows.iter().enumerate() {
        refuse_not_finite("point", point)
            .map_err(|problem| file.error(node, format!("row {index}: {problem}")))?;
    }
    geometry.points.extend(rows);
    geometry.dtype = array.dtype;
    Ok(())
}

fn rows_of_three(
    file: &VtkFile,
    node: &Node,
    array: &DataArray,
    count: usize,
) -> Result<Vec<[f64; 3]>, Error> {
    if array.components != 3 && count > 0 || Some(array.values.len()) != count.checked_mul(3) {
        let problem = format!(
            "{} values for {count} points of 3 coordinates; the file is cut short or its counts are wrong",
            array.values.len()
        );
        return Err(file.error(node, problem));
    }
    let rows = array.values.chunks_exact(3);
    Ok(rows.map(|row| [row[0], row[1], row[2]]).collect())
}

fn read_point_data(
    file: &VtkFile,
    piece: &Node,
    is_first: bool,
    offset: usize,
    geometry: &mut Geometry,
) -> Result<(), Error> {
    let count = geometry.points.len() - offset;
    let mut normals = None;
    let mut attributes: Vec<Attribute<f64>> = Vec::new();
    if let Some(data) = piece.child("PointData") {
        let active = data.attribute("Normals").unwrap_or("Normals");
        for node in data.children_named("DataArray") {
            let array = file.array(node)?;
            if Some(array.values.len()) != count.checked_mul(array.components) {
                let problem = format!("{} values for {count} points", array.values.len());
                return Err(file.error(node, problem));
            }
            if array.name == active && array.components == 3 {
                normals = Some(checked_normals(file, node, &array, count)?);
            } else {
                attributes.push(Attribute {
                    name: array.name,
                    components: array.components,
                    values: array.values,
                });
            }
        }
    }
    if is_first {
        geometry.normals = normals;
        geometry.attributes = attributes;
        return Ok(());
    }
    geometry.normals = geometry.normals.take().zip(normals).map(|(mut all, new)| {
        all.extend(new);
        all
    });
    geometry.attributes.retain_mut(|kept| {
        let same = |a: &&Attribute<f64>| a.name == kept.name && a.components == kept.components;
        let Some(new) = attributes.iter().find(same) else {
            return false;
        };
        kept.values.extend(&new.values);
        true
    });
    Ok(())
}

fn checked_normals(
    file: &VtkFile,
    node: &Node,
    array: &DataArray,
    count: usize,
) -> Result<Vec<[f64; 3]>, Error> {
    let rows = rows_of_three(file, node, array, count)?;
    for (index, &normal) in rows.iter().enumerate() {
        refuse_not_finite("normal", normal)
            .map_err(|problem| file.error(node, format!("row {index}: {problem}")))?;
    }
    Ok(rows)
}

/// Reads polygons, or strips, of which every second triangle is wound the other way.
fn read_cells(
    file: &VtkFile,
    section: &Node,
    is_strip: bool,
    first_point: usize,
    points: usize,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), Error> {
    let array = |name: &str| {
        let mut nodes = section.children_named("DataArray");
        nodes.find(|node| node.attribute("Name") == Some(name))
    };
    let (Some(connectivity), Some(offsets)) = (array("connectivity"), array("offsets")) else {
        return Ok(());
    };
    let (indices, ends) = (file.array(connectivity)?, file.array(offsets)?);
    let mut begin = 0;
    let mut corners = Vec::new();
    for (cell, &end) in ends.values.iter().enumerate() {
        let cell_error =
            |problem: String| file.error(connectivity, format!("cell {cell}: {problem}"));
        let end = as_index(end, indices.values.len() + 1)
            .filter(|&end| end >= begin + 3)
            .ok_or_else(|| {
                cell_error(format!(
                    "its end {end} is out of range, or it has fewer than 3 corners"
                ))
            })?;
        corners.clear();
        for &value in &indices.values[begin..end] {
            let index = as_index(value, points).and_then(|i| u32::try_from(first_point + i).ok());
            corners.push(index.ok_or_else(|| {
                cell_error(format!("it names point {value}, but there are {points}"))
            })?);
        }
        if is_strip {
            faces.extend(corners.windows(3).enumerate().map(|(i, t)| match i % 2 {
                0 => [t[0], t[1], t[2]],
                _ => [t[1], t[0], t[2]],
            }));
        } else {
            triangulate(&corners, faces);
        }
        begin = end;
    }
    Ok(())
}

/// Writes a mesh: raw appended arrays, vertices of type `T`.
pub(crate) fn write<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let (vertices, faces) = (mesh.vertices().len(), mesh.faces().len());
    let lengths = [vertices * 3 * size::<T>(), faces * 3 * 8, faces * 8];
    // Each array is led by its length in 8 bytes.
    let offsets = [0, lengths[0] + 8, lengths[0] + lengths[1] + 16];
    let real = scalar_name::<T>(["Float32", "Float64"]);
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <PolyData>
    <Piece NumberOfPoints="{vertices}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{faces}">
      <Points>
        <DataArray type="{real}" Name="Points" NumberOfComponents="3" format="appended" offset="{}"/>
      </Points>
      <Polys>
        <DataArray type="Int64" Name="connectivity" format="appended" offset="{}"/>
        <DataArray type="Int64" Name="offsets" format="appended" offset="{}"/>
      </Polys>
    </Piece>
  </PolyData>
  <AppendedData encoding="raw">
_"#,
        offsets[0], offsets[1], offsets[2]
    )?;
    let mut row = Vec::new();
    out.write_all(&(lengths[0] as u64).to_le_bytes())?;
    for &vertex in mesh.vertices() {
        row.clear();
        push_vector(&mut row, vertex);
        out.write_all(&row)?;
    }
    out.write_all(&(lengths[1] as u64).to_le_bytes())?;
    for corner in mesh.faces().iter().flatten() {
        out.write_all(&i64::from(*corner).to_le_bytes())?;
    }
    out.write_all(&(lengths[2] as u64).to_le_bytes())?;
    for face in 1..=faces as i64 {
        out.write_all(&(3 * face).to_le_bytes())?;
    }
    out.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
}
