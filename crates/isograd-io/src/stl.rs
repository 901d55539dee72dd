//! Stereolithography files, ascii and binary.
//!
//! STL has no vertices, only triangles: corners with equal coordinates are merged into one vertex, the
//! first one's place deciding the order. A binary file may begin with `solid`; it is told by its size.

use std::collections::HashMap;
use std::io::{self, Write};

use isograd::{Mesh, Real};
use isograd_element::vector;

use crate::error::{Error, Place};
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite};
use crate::number::{Dtype, Endian, Number};
use crate::source::{Lines, Source, number, shown, words};

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an STL file.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let bytes = &source.bytes;
    let count = bytes.get(80..HEADER).and_then(|b| b.first_chunk::<4>());
    let count = count.map(|b| u32::from_le_bytes(*b) as usize);
    let needed = count.and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER));
    let is_exact = needed == Some(bytes.len());
    let has_facets = memchr::memmem::find(&bytes[..bytes.len().min(4096)], b"facet").is_some();
    if !is_exact && bytes.trim_ascii_start().starts_with(b"solid") && has_facets {
        return read_ascii(source);
    }
    match (count, needed) {
        (Some(count), Some(needed)) if needed <= bytes.len() => read_binary(source, count),
        (Some(count), _) => Err(source.error(
            Place::Byte(80),
            format!(
                "the header promises {count} triangles of {TRIANGLE} bytes, but the file has {} bytes; it is cut short, or no STL file",
                bytes.len()
            ),
        )),
        (None, _) => Err(source.error(
            Place::Whole,
            "neither ascii STL (it would begin with 'solid' and have facets) nor binary STL (it is shorter than the header)",
        )),
    }
}

/// Vertices that are merged as they come.
#[derive(Default)]
struct Merged {
    points: Vec<[f64; 3]>,
    index: HashMap<[u64; 3], u32>,
    faces: Vec<[u32; 3]>,
}

impl Merged {
    fn vertex(&mut self, point: [f64; 3]) -> Result<u32, String> {
        refuse_not_finite("vertex", point)?;
        // Adding 0 turns −0 into 0, which is the same place.
        let key = point.map(|x| (x + 0.0).to_bits());
        let next = self.points.len() as u32;
        if next == u32::MAX {
            return Err("more vertices than 32-bit indices can name; simplify the mesh".into());
        }
        let index = *self.index.entry(key).or_insert(next);
        if index == next {
            self.points.push(point);
        }
        Ok(index)
    }

    fn finish(self, dtype: Dtype) -> Geometry {
        Geometry {
            points: self.points,
            normals: None,
            attributes: Vec::new(),
            faces: self.faces,
            dtype,
            format: Format::Stl,
        }
    }
}

fn read_binary(source: &Source, count: usize) -> Result<Geometry, Error> {
    let mut merged = Merged::default();
    let triangles = source.bytes[HEADER..].chunks_exact(TRIANGLE).take(count);
    for (index, triangle) in triangles.enumerate() {
        // Twelve numbers: the normal, which the corners give as well, and the corners.
        let numbers = Number::F32.read_all(&triangle[12..48], Endian::Little);
        let mut face = [0; 3];
        for (corner, xyz) in face.iter_mut().zip(numbers.chunks_exact(3)) {
            *corner = merged.vertex([xyz[0], xyz[1], xyz[2]]).map_err(|problem| {
                let place = Place::Element {
                    name: "triangle".into(),
                    index,
                    byte: HEADER + index * TRIANGLE,
                };
                source.error(place, problem)
            })?;
        }
        merged.faces.push(face);
    }
    Ok(merged.finish(Dtype::F32))
}

fn read_ascii(source: &Source) -> Result<Geometry, Error> {
    let mut merged = Merged::default();
    let mut corners: Vec<u32> = Vec::new();
    let mut open = false;
    let mut lines = Lines::new(&source.bytes);
    while let Some((line_number, line)) = lines.next_filled() {
        let bad = |problem: String| source.error(Place::Line(line_number), problem);
        let mut fields = words(line);
        match fields.next().map(<[u8]>::to_ascii_lowercase).as_deref() {
            Some(b"facet") => open = true,
            Some(b"vertex") => corners.push(vertex(&mut merged, fields).map_err(bad)?),
            Some(b"endfacet") => {
                let [a, b, c] = corners[..] else {
                    return Err(bad(format!(
                        "the facet has {} corners, not 3",
                        corners.len()
                    )));
                };
                merged.faces.push([a, b, c]);
                corners.clear();
                open = false;
            }
            Some(b"solid" | b"endsolid" | b"outer" | b"endloop") => {}
            _ => return Err(bad(format!("{} is no line of an ascii STL", shown(line)))),
        }
    }
    if open {
        let problem = "the file ends inside a facet; it is cut short";
        return Err(source.error(Place::Line(lines.number), problem));
    }
    Ok(merged.finish(Dtype::Text))
}

fn vertex<'a>(
    merged: &mut Merged,
    mut fields: impl Iterator<Item = &'a [u8]>,
) -> Result<u32, String> {
    let mut point = [0.0; 3];
    for value in &mut point {
        let word = fields.next().ok_or("the vertex has fewer than 3 numbers")?;
        *value = number(word).ok_or_else(|| format!("{} is not a number", shown(word)))?;
    }
    merged.vertex(point)
}

/// Writes a binary STL: single precision, whatever `T` is, and no shared vertices.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let count = u32::try_from(mesh.faces().len()).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "STL can't hold more than 2^32 - 1 triangles; write PLY",
        )
    })?;
    let mut header = [0; 80];
    let title = b"isograd, binary STL";
    header[..title.len()].copy_from_slice(title);
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    let mut row = Vec::with_capacity(TRIANGLE);
    for face in 0..mesh.faces().len() {
        row.clear();
        let corners = mesh.corners(face).map(vector::to_f64);
        let [a, b, c] = corners;
        let normal = vector::cross(vector::sub(b, a), vector::sub(c, a));
        let normal = vector::normalized(normal).unwrap_or_default();
        for value in [normal, a, b, c].into_iter().flatten() {
            row.extend((value as f32).to_le_bytes());
        }
        row.extend([0; 2]);
        out.write_all(&row)?;
    }
    Ok(())
}
