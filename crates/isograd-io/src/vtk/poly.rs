//! PolyData: points with their data, polygons and strips.

use std::collections::HashMap;

use isograd::data::Attribute;

use super::data::{DataArray, VtkFile};
use super::xml::Node;
use crate::error::Error;
use crate::format::Format;
use crate::geometry::Geometry;
use crate::number::{Dtype, as_index};
use crate::polygon::triangulate;
use crate::source::Input;

/// Reads all pieces as one. Point data are kept if every piece has them; normals are the active normals
/// of the point data, or the array `Normals`.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let file = VtkFile::open(input, "PolyData")?;
    let mut geometry = Geometry::from_points(Vec::new(), Dtype::Text, Format::Vtp);
    let pieces = file.data_set("PolyData")?.children_named("Piece");
    for (index, piece) in pieces.enumerate() {
        let offset = geometry.points.len();
        read_points(&file, piece, &mut geometry)?;
        read_point_data(&file, piece, index == 0, offset, &mut geometry)?;
        for (section, is_strip) in [("Polys", false), ("Strips", true)] {
            if let Some(node) = piece.child(section) {
                read_cells(&file, node, is_strip, offset, &mut geometry)?;
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
    let points = rows_of_three(file, node, &array, count)?;
    file.check_rows(node, "point", &points)?;
    geometry.dtype = array.dtype;
    append(file, piece, &mut geometry.points, points)
}

/// Appends the data of a further piece.
fn append<T>(file: &VtkFile, piece: &Node, all: &mut Vec<T>, new: Vec<T>) -> Result<(), Error> {
    if all.is_empty() {
        *all = new;
        return Ok(());
    }
    let room = file.input.memory.make_room(all, new.len());
    room.map_err(|problem| file.error(piece, problem))?;
    all.extend(new);
    Ok(())
}

fn rows_of_three(
    file: &VtkFile,
    node: &Node,
    array: &DataArray,
    count: usize,
) -> Result<Vec<[f64; 3]>, Error> {
    if array.components != 3 && count > 0 || Some(array.count) != count.checked_mul(3) {
        let problem = format!(
            "{} values for {count} points of 3 coordinates; the file is cut short or its counts are wrong",
            array.count
        );
        return Err(file.error(node, problem));
    }
    file.rows(node, array)
}

/// Normals and attributes of a piece.
#[derive(Default)]
struct PointData {
    normals: Option<Vec<[f64; 3]>>,
    attributes: Vec<Attribute<f64>>,
}

fn read_point_data(
    file: &VtkFile,
    piece: &Node,
    is_first: bool,
    offset: usize,
    geometry: &mut Geometry,
) -> Result<(), Error> {
    let count = geometry.points.len() - offset;
    let new = match piece.child("PointData") {
        Some(data) => point_data(file, data, count)?,
        None => PointData::default(),
    };
    if is_first {
        geometry.normals = new.normals;
        geometry.attributes = new.attributes;
        return Ok(());
    }
    if let Some((all, new)) = geometry.normals.as_mut().zip(new.normals) {
        append(file, piece, all, new)?;
    } else {
        geometry.normals = None;
    }
    let new = new.attributes.into_iter();
    let mut new: HashMap<(String, usize), Vec<f64>> =
        new.map(|a| ((a.name, a.components), a.values)).collect();
    for mut old in std::mem::take(&mut geometry.attributes) {
        let key = (old.name, old.components);
        if let Some(values) = new.remove(&key) {
            append(file, piece, &mut old.values, values)?;
            old.name = key.0;
            geometry.attributes.push(old);
        }
    }
    Ok(())
}

fn point_data(file: &VtkFile, data: &Node, count: usize) -> Result<PointData, Error> {
    let mut found = PointData::default();
    let active = data.attribute("Normals").unwrap_or("Normals");
    for node in data.children_named("DataArray") {
        let name = node.attribute("Name").unwrap_or_default();
        if name != active && !file.input.options.keeps(name) {
            continue;
        }
        let array = file.array(node)?;
        if Some(array.count) != count.checked_mul(array.components) {
            let problem = format!("{} values for {count} points", array.count);
            return Err(file.error(node, problem));
        }
        if array.name == active && array.components == 3 {
            let rows = rows_of_three(file, node, &array, count)?;
            file.check_rows(node, "normal", &rows)?;
            found.normals = Some(rows);
        } else {
            let attribute = Attribute {
                values: file.values(node, &array)?,
                name: array.name,
                components: array.components,
            };
            let room = file.input.memory.make_room(&mut found.attributes, 1);
            room.map_err(|problem| file.error(node, problem))?;
            found.attributes.push(attribute);
        }
    }
    Ok(found)
}

/// Reads polygons, or strips, in which every second triangle has the opposite winding.
fn read_cells(
    file: &VtkFile,
    section: &Node,
    is_strip: bool,
    first_point: usize,
    geometry: &mut Geometry,
) -> Result<(), Error> {
    let array = |name: &str| {
        let mut nodes = section.children_named("DataArray");
        nodes.find(|node| node.attribute("Name") == Some(name))
    };
    let (Some(connectivity), Some(offsets)) = (array("connectivity"), array("offsets")) else {
        return Ok(());
    };
    let faces = &mut geometry.faces;
    let points = geometry.points.len() - first_point;
    let values = |node| file.values(node, &file.array(node)?);
    let (indices, ends) = (values(connectivity)?, values(offsets)?);
    let memory = &file.input.memory;
    let mut begin = 0;
    let mut corners = Vec::new();
    for (cell, &end) in ends.iter().enumerate() {
        let cell_error =
            |problem: String| file.error(connectivity, format!("cell {cell}: {problem}"));
        let end = as_index(end, indices.len() + 1)
            .filter(|&end| end >= begin + 3)
            .ok_or_else(|| {
                cell_error(format!(
                    "its offset {end} is out of range, or it has fewer than 3 corners"
                ))
            })?;
        corners.clear();
        for &value in &indices[begin..end] {
            let index = as_index(value, points).and_then(|i| u32::try_from(first_point + i).ok());
            memory.make_room(&mut corners, 1).map_err(cell_error)?;
            corners.push(index.ok_or_else(|| {
                cell_error(format!("it names point {value}, but there are {points}"))
            })?);
        }
        if is_strip {
            memory.make_room(faces, corners.len()).map_err(cell_error)?;
            faces.extend(corners.windows(3).enumerate().map(|(i, t)| match i % 2 {
                0 => [t[0], t[1], t[2]],
                _ => [t[1], t[0], t[2]],
            }));
        } else {
            triangulate(memory, &geometry.points, &corners, faces).map_err(cell_error)?;
        }
        begin = end;
    }
    Ok(())
}
