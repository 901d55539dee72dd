//! The data of a PLY file.

use super::header::{Element, Encoding, Header, Kind, Property};
use crate::columns::{NORMAL, PointTable, find_columns};
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::limits::Memory;
use crate::lines::{Lines, number, quoted, words};
use crate::names::{self, Quantity};
use crate::number::{Dtype, Endian, Number, as_index};
use crate::polygon::Triangles;
use crate::source::Input;

/// Position of the reader in the data.
enum Cursor<'a> {
    Ascii {
        lines: Lines<'a>,
        rest: &'a [u8],
        line: usize,
    },
    Binary {
        bytes: &'a [u8],
        at: usize,
        endian: Endian,
    },
}

impl Cursor<'_> {
    /// Advances to the next element; `false` at the end of the file.
    fn begin_row(&mut self) -> bool {
        match self {
            Self::Ascii { lines, rest, line } => match lines.next_filled() {
                Some((number, text)) => {
                    (*line, *rest) = (number, text);
                    true
                }
                None => false,
            },
            Self::Binary { .. } => true,
        }
    }

    /// The next number of the element.
    #[inline]
    fn value(&mut self, kind: Number) -> Result<f64, String> {
        match self {
            Self::Ascii { rest, .. } => {
                let Some(word) = words(rest).next() else {
                    return Err("the line has too few numbers".into());
                };
                // The word is a slice of the rest: its end is where the next search begins.
                let end = word.as_ptr() as usize - rest.as_ptr() as usize + word.len();
                *rest = &rest[end..];
                number(word)
            }
            Self::Binary { bytes, at, endian } => {
                let value = kind.read(bytes.get(*at..).unwrap_or_default(), *endian);
                *at += kind.size();
                value.ok_or_else(|| "the file ends here; it is cut short".into())
            }
        }
    }

    /// Ends the element: nothing may follow it on its line.
    fn end_row(&self) -> Result<(), String> {
        match self {
            Self::Ascii { rest, .. } if !rest.trim_ascii().is_empty() => Err(format!(
                "the line has more numbers than the header lists: {}",
                quoted(rest.trim_ascii())
            )),
            _ => Ok(()),
        }
    }

    /// Upper bound for the length of a list of `item` in the rest of the file.
    fn room_for(&self, item: Number) -> usize {
        match self {
            Self::Ascii { rest, .. } => rest.len(),
            Self::Binary { bytes, at, .. } => bytes.len().saturating_sub(*at) / item.size(),
        }
    }

    fn location(&self, element: &Element, index: usize, began: usize) -> Location {
        match self {
            Self::Ascii { line, .. } => Location::Line(*line),
            Self::Binary { .. } => Location::Element {
                name: element.name.clone(),
                index,
                byte: began,
            },
        }
    }

    fn byte(&self) -> usize {
        match self {
            Self::Ascii { .. } => 0,
            Self::Binary { at, .. } => *at,
        }
    }
}

/// Reads a PLY file. Elements other than `vertex` and `face` are read as well, to detect damage.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let header = Header::parse(input)?;
    let mut cursor = match header.encoding {
        Encoding::Ascii => Cursor::Ascii {
            lines: Lines::from(input.bytes, header.body, header.lines),
            rest: &[],
            line: header.lines,
        },
        Encoding::Binary(endian) => Cursor::Binary {
            bytes: input.bytes,
            at: header.body,
            endian,
        },
    };
    let vertex = header.elements.iter().find(|e| e.name == "vertex");
    let Some(vertex) = vertex else {
        return Err(input.error(Location::Whole, "the header has no element 'vertex'"));
    };
    let memory = &input.memory;
    let (mut vertices, mut dtype) = point_table(input, vertex)?;
    if header.encoding == Encoding::Ascii {
        dtype = Dtype::Text;
    }
    let mut faces = Faces::new(vertex.count);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_rows(input, &mut cursor, element, |row, _| {
                vertices.push(memory, row)
            })?,
            "face" | "tristrips" => {
                (faces.list, faces.are_strips) = (face_list(element), element.name != "face");
                read_rows(input, &mut cursor, element, |_, list| {
                    faces.push(memory, vertices.points(), list)
                })?;
            }
            _ => skip(input, &mut cursor, element)?,
        }
    }
    let triangles = faces.triangles.finish(memory, vertices.points());
    Ok(Geometry {
        faces: triangles.map_err(|problem| input.error(Location::Whole, problem))?,
        ..vertices.into_geometry(dtype, Format::Ply)
    })
}

/// Reads all rows of an element. `take` receives the numbers of a row (0 in place of a list) and the
/// items of the list `vertex_indices`.
fn read_rows(
    input: &Input,
    cursor: &mut Cursor,
    element: &Element,
    mut take: impl FnMut(&[f64], &[f64]) -> Result<(), String>,
) -> Result<(), Error> {
    let wanted = face_list(element);
    let mut row = vec![0.0; element.properties.len()];
    let mut list = Vec::new();
    for index in 0..element.count {
        if !cursor.begin_row() {
            return Err(cut_short(input, cursor, element, index));
        }
        let began = cursor.byte();
        read_row(
            &input.memory,
            cursor,
            element,
            wanted,
            (&mut row, &mut list),
        )
        .and_then(|()| take(&row, &list))
        .map_err(|problem| input.error(cursor.location(element, index, began), problem))?;
    }
    Ok(())
}

/// Reads the numbers of an element into the row, and the items of the list `wanted`.
fn read_row(
    memory: &Memory,
    cursor: &mut Cursor,
    element: &Element,
    wanted: Option<usize>,
    (row, list): (&mut [f64], &mut Vec<f64>),
) -> Result<(), String> {
    list.clear();
    for (p, property) in element.properties.iter().enumerate() {
        match property.kind {
            Kind::Scalar(number) => row[p] = cursor.value(number)?,
            Kind::List { count, item } => {
                let length = cursor.value(count)?;
                let room = cursor.room_for(item);
                let length = as_index(length, room.saturating_add(1)).ok_or_else(|| {
                    format!(
                        "list '{}' declares {length} items, but the file has room for at most {room}; it is damaged",
                        property.name
                    )
                })?;
                for _ in 0..length {
                    let value = cursor.value(item)?;
                    if wanted == Some(p) {
                        memory.make_room(list, 1)?;
                        list.push(value);
                    }
                }
            }
        }
    }
    cursor.end_row()
}

/// Skips an element.
fn skip(input: &Input, cursor: &mut Cursor, element: &Element) -> Result<(), Error> {
    if let (Cursor::Binary { at, .. }, Some(size)) = (&mut *cursor, element.fixed_bytes()) {
        // The header's counts were checked against the size of the file.
        let end = at.saturating_add(size.saturating_mul(element.count));
        if end > input.bytes.len() {
            return Err(cut_short(input, cursor, element, 0));
        }
        *at = end;
        return Ok(());
    }
    read_rows(input, cursor, element, |_, _| Ok(()))
}

fn cut_short(input: &Input, cursor: &Cursor, element: &Element, index: usize) -> Error {
    let problem = format!(
        "the file ends after {index} of {} of element '{}'; it is cut short",
        element.count, element.name
    );
    input.error(cursor.location(element, index, cursor.byte()), problem)
}

fn face_list(element: &Element) -> Option<usize> {
    let named = |name: &str| name == "vertex_indices" || name == "vertex_index";
    element.properties.iter().position(|p| named(&p.name))
}

/// The table for element `vertex`, and the number type of `x`.
fn point_table(input: &Input, element: &Element) -> Result<(PointTable, Dtype), Error> {
    let scalar = |p: &Property| match p.kind {
        Kind::Scalar(number) => Some(number),
        Kind::List { .. } => None,
    };
    let properties = element.properties.iter();
    let names: Vec<Option<&str>> = properties
        .map(|p| scalar(p).map(|_| p.name.as_str()))
        .collect();
    let find = |exact: [&str; 3], quantity| {
        let all = names.iter().map(|name| name.unwrap_or_default().into());
        let all: Vec<String> = all.collect();
        find_columns(&names, exact).or_else(|| names::find(&all, quantity))
    };
    let Some(xyz) = find(["x", "y", "z"], Quantity::Points) else {
        let problem = "element 'vertex' lacks one of the properties x, y, z";
        return Err(input.error(Location::Whole, problem));
    };
    let normal = find(NORMAL, Quantity::Normals);
    let dtype = scalar(&element.properties[xyz[0]]).map_or(Dtype::Integer, Number::dtype);
    let table = PointTable::new(input, &names, xyz, normal, element.count);
    let table = table.map_err(|problem| input.error(Location::Whole, problem))?;
    Ok((table, dtype))
}

/// Polygons, cut into triangles.
struct Faces {
    list: Option<usize>,
    /// Whether the lists are strips of triangles rather than polygons.
    are_strips: bool,
    vertices: usize,
    corners: Vec<u32>,
    triangles: Triangles,
}

impl Faces {
    fn new(vertices: usize) -> Self {
        Self {
            list: None,
            are_strips: false,
            vertices,
            corners: Vec::new(),
            triangles: Triangles::default(),
        }
    }

    /// Appends the face of this list; `points` are those read so far.
    fn push(&mut self, memory: &Memory, points: &[[f64; 3]], list: &[f64]) -> Result<(), String> {
        if self.list.is_none() {
            return Ok(());
        }
        if self.are_strips {
            // −1 ends a strip.
            let mut strips = list.split(|&value| value == -1.0);
            return strips.try_for_each(|strip| self.push_strip(memory, points, strip));
        }
        if list.len() < 3 {
            return Err(format!("the face has {} corners; remove it", list.len()));
        }
        self.read_corners(memory, list)?;
        self.triangles.push(memory, points, &self.corners)
    }

    /// Appends the triangles of a strip, of which every second one has the opposite winding. Those with two equal corners only
    /// lead from one part to the next.
    fn push_strip(
        &mut self,
        memory: &Memory,
        points: &[[f64; 3]],
        strip: &[f64],
    ) -> Result<(), String> {
        self.read_corners(memory, strip)?;
        for (index, triangle) in self.corners.windows(3).enumerate() {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            if a != b && b != c && c != a {
                let triangle = if index % 2 == 0 { [a, b, c] } else { [b, a, c] };
                self.triangles.push(memory, points, &triangle)?;
            }
        }
        Ok(())
    }

    /// Checks the corners of a list.
    fn read_corners(&mut self, memory: &Memory, list: &[f64]) -> Result<(), String> {
        self.corners.clear();
        for &value in list {
            let vertex =
                as_index(value, self.vertices.min(u32::MAX as usize)).ok_or_else(|| {
                    format!(
                        "the face names vertex {value}, but the vertices are 0 to {}",
                        self.vertices as i64 - 1
                    )
                })?;
            memory.make_room(&mut self.corners, 1)?;
            self.corners.push(vertex as u32);
        }
        Ok(())
    }
}
