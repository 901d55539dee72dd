//! The data of a PLY file.

use isograd::data::Attribute;

use super::header::{Element, Encoding, Header, Kind};
use crate::error::{Error, Place};
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite, triangulate};
use crate::number::{Dtype, Endian, Number, as_index};
use crate::source::{Lines, Source, number, shown, words};

/// Where the reader stands in the data, in either encoding.
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
    /// Goes to the next element. `false` at the end of the file.
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
                number(word).ok_or_else(|| format!("{} is not a number", shown(word)))
            }
            Self::Binary { bytes, at, endian } => {
                let value = kind.read(bytes.get(*at..).unwrap_or_default(), *endian);
                *at += kind.size();
                value.ok_or_else(|| "the file ends here; it is cut short".into())
            }
        }
    }

    /// Ends the element: a line may hold nothing more.
    fn end_row(&self) -> Result<(), String> {
        match self {
            Self::Ascii { rest, .. } if !rest.trim_ascii().is_empty() => Err(format!(
                "the line has more numbers than the header lists: {}",
                shown(rest.trim_ascii())
            )),
            _ => Ok(()),
        }
    }

    /// The most items that a list of `item` can still have.
    fn room_for(&self, item: Number) -> usize {
        match self {
            Self::Ascii { rest, .. } => rest.len(),
            Self::Binary { bytes, at, .. } => bytes.len().saturating_sub(*at) / item.size(),
        }
    }

    fn place(&self, element: &Element, index: usize, began: usize) -> Place {
        match self {
            Self::Ascii { line, .. } => Place::Line(*line),
            Self::Binary { .. } => Place::Element {
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

/// Reads every element of the file, so that a damaged one is found wherever the damage is.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let header = Header::parse(source)?;
    let mut cursor = match header.encoding {
        Encoding::Ascii => Cursor::Ascii {
            lines: Lines::from(&source.bytes, header.body, header.lines),
            rest: &[],
            line: header.lines,
        },
        Encoding::Binary(endian) => Cursor::Binary {
            bytes: &source.bytes,
            at: header.body,
            endian,
        },
    };
    let vertex = header.elements.iter().find(|e| e.name == "vertex");
    let Some(vertex) = vertex else {
        return Err(source.error(Place::Whole, "the header has no element 'vertex'"));
    };
    let mut vertices = Vertices::new(source, vertex)?;
    let mut faces = Faces::new(vertex.count);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_rows(source, &mut cursor, element, |row, _| vertices.push(row))?,
            "face" => {
                faces.list = face_list(element);
                read_rows(source, &mut cursor, element, |_, list| faces.push(list))?;
            }
            _ => skip(source, &mut cursor, element)?,
        }
    }
    Ok(vertices.finish(faces.triangles, header.encoding))
}

/// Reads all rows of an element. `take` gets the numbers of a row (a list counts as a zero) and the
/// items of the list `vertex_indices`.
fn read_rows(
    source: &Source,
    cursor: &mut Cursor,
    element: &Element,
    mut take: impl FnMut(&[f64], &[f64]) -> Result<(), String>,
) -> Result<(), Error> {
    let wanted = face_list(element);
    let mut row = vec![0.0; element.properties.len()];
    let mut list = Vec::new();
    for index in 0..element.count {
        if !cursor.begin_row() {
            return Err(cut_short(source, cursor, element, index));
        }
        let began = cursor.byte();
        read_row(cursor, element, wanted, &mut row, &mut list)
            .and_then(|()| take(&row, &list))
            .map_err(|problem| source.error(cursor.place(element, index, began), problem))?;
    }
    Ok(())
}

fn read_row(
    cursor: &mut Cursor,
    element: &Element,
    wanted: Option<usize>,
    row: &mut [f64],
    list: &mut Vec<f64>,
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
                        "list '{}' is said to have {length} items, but there is room for at most {room}; the file is damaged",
                        property.name
                    )
                })?;
                for _ in 0..length {
                    let value = cursor.value(item)?;
                    if wanted == Some(p) {
                        list.push(value);
                    }
                }
            }
        }
    }
    cursor.end_row()
}

/// Passes over an element that nobody asked for.
fn skip(source: &Source, cursor: &mut Cursor, element: &Element) -> Result<(), Error> {
    if let (Cursor::Binary { at, .. }, Some(size)) = (&mut *cursor, element.fixed_bytes()) {
        // The product was checked against the file's size with the header.
        let end = at.saturating_add(size.saturating_mul(element.count));
        if end > source.bytes.len() {
            return Err(cut_short(source, cursor, element, 0));
        }
        *at = end;
        return Ok(());
    }
    read_rows(source, cursor, element, |_, _| Ok(()))
}

fn cut_short(source: &Source, cursor: &Cursor, element: &Element, index: usize) -> Error {
    let problem = format!(
        "the file ends after {index} of {} of element '{}'; it is cut short",
        element.count, element.name
    );
    source.error(cursor.place(element, index, cursor.byte()), problem)
}

fn face_list(element: &Element) -> Option<usize> {
    let named = |name: &str| name == "vertex_indices" || name == "vertex_index";
    element.properties.iter().position(|p| named(&p.name))
}

/// The columns of element `vertex` and what was read from them.
struct Vertices {
    xyz: [usize; 3],
    normal: Option<[usize; 3]>,
    extra: Vec<usize>,
    dtype: Dtype,
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    attributes: Vec<Attribute<f64>>,
}

impl Vertices {
    fn new(source: &Source, element: &Element) -> Result<Self, Error> {
        let scalar = |name: &str| {
            element
                .properties
                .iter()
                .position(|p| p.name == name && matches!(p.kind, Kind::Scalar(_)))
        };
        let three =
            |names: [&str; 3]| Some([scalar(names[0])?, scalar(names[1])?, scalar(names[2])?]);
        let Some(xyz) = three(["x", "y", "z"]) else {
            let problem = "element 'vertex' lacks one of the properties x, y, z";
            return Err(source.error(Place::Whole, problem));
        };
        let normal = three(["nx", "ny", "nz"]);
        let used = |p: &usize| xyz.contains(p) || normal.is_some_and(|n| n.contains(p));
        let is_scalar = |p: &usize| matches!(element.properties[*p].kind, Kind::Scalar(_));
        let extra: Vec<usize> = (0..element.properties.len())
            .filter(|p| is_scalar(p) && !used(p))
            .collect();
        let dtype = match element.properties[xyz[0]].kind {
            Kind::Scalar(number) => number.dtype(),
            Kind::List { .. } => Dtype::Integer,
        };
        let attributes = extra
            .iter()
            .map(|&p| Attribute {
                name: element.properties[p].name.clone(),
                components: 1,
                values: Vec::with_capacity(element.count),
            })
            .collect();
        Ok(Self {
            xyz,
            normal,
            extra,
            dtype,
            points: Vec::with_capacity(element.count),
            normals: Vec::with_capacity(if normal.is_some() { element.count } else { 0 }),
            attributes,
        })
    }

    fn push(&mut self, row: &[f64]) -> Result<(), String> {
        let point = self.xyz.map(|p| row[p]);
        refuse_not_finite("point", point)?;
        self.points.push(point);
        if let Some(columns) = self.normal {
            let normal = columns.map(|p| row[p]);
            refuse_not_finite("normal", normal)?;
            self.normals.push(normal);
        }
        for (attribute, &p) in self.attributes.iter_mut().zip(&self.extra) {
            attribute.values.push(row[p]);
        }
        Ok(())
    }

    fn finish(self, faces: Vec<[u32; 3]>, encoding: Encoding) -> Geometry {
        Geometry {
            points: self.points,
            normals: self.normal.map(|_| self.normals),
            attributes: self.attributes,
            faces,
            dtype: match encoding {
                Encoding::Ascii => Dtype::Text,
                Encoding::Binary(_) => self.dtype,
            },
            format: Format::Ply,
        }
    }
}

/// The polygons, cut into triangles.
struct Faces {
    list: Option<usize>,
    vertices: usize,
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Faces {
    fn new(vertices: usize) -> Self {
        Self {
            list: None,
            vertices,
            corners: Vec::new(),
            triangles: Vec::new(),
        }
    }

    fn push(&mut self, list: &[f64]) -> Result<(), String> {
        if self.list.is_none() {
            return Ok(());
        }
        if list.len() < 3 {
            return Err(format!("the face has {} corners; remove it", list.len()));
        }
        self.corners.clear();
        for &value in list {
            let vertex =
                as_index(value, self.vertices.min(u32::MAX as usize)).ok_or_else(|| {
                    format!(
                        "the face names vertex {value}, but the vertices are 0 to {}",
                        self.vertices as i64 - 1
                    )
                })?;
            self.corners.push(vertex as u32);
        }
        triangulate(&self.corners, &mut self.triangles);
        Ok(())
    }
}
