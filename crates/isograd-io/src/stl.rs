//! Stereolithography files, ascii and binary.
//!
//! STL has no vertices, only triangles: corners with equal coordinates are merged into one vertex, in the
//! order of first occurrence. A binary file may begin with `solid`; it is recognized by its size.

use std::collections::HashMap;
use std::io::{self, Write};

use isograd::{Mesh, Real};
use isograd_element::vector;

use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::{Geometry, check_finite};
use crate::number::{Dtype, Endian, Number};
use crate::source::{Lines, Source, quoted, three_numbers, words};

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
            Location::Byte(80),
            format!(
                "the header declares {count} triangles of {TRIANGLE} bytes, but the file has {} bytes; it is cut short or not an STL file",
                bytes.len()
            ),
        )),
        (None, _) => Err(source.error(
            Location::Whole,
            "neither ascii STL (it would begin with 'solid' and have facets) nor binary STL (it is shorter than the header)",
        )),
    }
}

/// Triangles whose equal corners are merger.
#[derive(Default)]
struct Merger {
    points: Vec<[f64; 3]>,
    index: HashMap<[u64; 3], u32>,
    faces: Vec<[u32; 3]>,
}

impl Merger {
    fn vertex(&mut self, point: [f64; 3]) -> Result<u32, String> {
        check_finite("vertex", point)?;
        // Adding 0 turns −0 into 0, so that the two are equal.
        let key = point.map(|x| (x + 0.0).to_bits());
        let next = self.points.len() as u32;
        if next == u32::MAX {
            return Err("more vertices than 32-bit indices can address; simplify the mesh".into());
        }
        let index = *self.index.entry(key).or_insert(next);
        if index == next {
            self.points.push(point);
        }
        Ok(index)
    }

    fn finish(self, dtype: Dtype) -> Geometry {
        Geometry {
            faces: self.faces,
            ..Geometry::from_points(self.points, dtype, Format::Stl)
        }
    }
}

fn read_binary(source: &Source, count: usize) -> Result<Geometry, Error> {
    let mut merger = Merger::default();
    let triangles = source.bytes[HEADER..].chunks_exact(TRIANGLE).take(count);
    for (index, triangle) in triangles.enumerate() {
        // The normal comes first and is skipped: it follows from the corners.
        let numbers = Number::F32.read_all(&triangle[12..48], Endian::Little);
        let mut face = [0; 3];
        for (corner, xyz) in face.iter_mut().zip(numbers.chunks_exact(3)) {
            *corner = merger.vertex([xyz[0], xyz[1], xyz[2]]).map_err(|problem| {
                let location = Location::Element {
                    name: "triangle".into(),
                    index,
                    byte: HEADER + index * TRIANGLE,
                };
                source.error(location, problem)
            })?;
        }
        merger.faces.push(face);
    }
    Ok(merger.finish(Dtype::F32))
}

fn read_ascii(source: &Source) -> Result<Geometry, Error> {
    let mut merger = Merger::default();
    let mut corners: Vec<u32> = Vec::new();
    let mut open = false;
    let mut lines = Lines::new(&source.bytes);
    while let Some((line_number, line)) = lines.next_filled() {
        let bad = |problem: String| source.error(Location::Line(line_number), problem);
        let mut fields = words(line);
        match fields.next().map(<[u8]>::to_ascii_lowercase).as_deref() {
            Some(b"facet") => open = true,
            Some(b"vertex") => {
                let vertex = three_numbers(fields).and_then(|point| merger.vertex(point));
                corners.push(vertex.map_err(bad)?);
            }
            Some(b"endfacet") => {
                let face = <[u32; 3]>::try_from(corners.as_slice());
                merger.faces.push(
                    face.map_err(|_| {
                        bad(format!("the facet has {} corners, not 3", corners.len()))
                    })?,
                );
                corners.clear();
                open = false;
            }
            Some(b"solid" | b"endsolid" | b"outer" | b"endloop") => {}
            _ => {
                return Err(bad(format!(
                    "{} is not a line of an ascii STL file",
                    quoted(line)
                )));
            }
        }
    }
    if open {
        let problem = "the file ends inside a facet; it is cut short";
        return Err(source.error(Location::Line(lines.number), problem));
    }
    Ok(merger.finish(Dtype::Text))
}

/// Writes a binary STL: single precision for any `T`, and no shared vertices.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let count = u32::try_from(mesh.faces().len()).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "STL cannot hold more than 2^32 - 1 triangles; write PLY",
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
