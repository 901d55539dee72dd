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
use crate::geometry::Geometry;
use crate::limits::Memory;
use crate::lines::{Lines, coordinates, quoted, words};
use crate::number::{Dtype, Endian, Number};
use crate::options::NotFinite;
use crate::source::Input;

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an STL file.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let bytes = input.bytes;
    let count = bytes.get(80..HEADER).and_then(|b| b.first_chunk::<4>());
    let count = count.map(|b| u32::from_le_bytes(*b) as usize);
    let needed = count.and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER));
    let is_exact = needed == Some(bytes.len());
    let head = bytes[..bytes.len().min(4096)].to_ascii_lowercase();
    let has_facets = memchr::memmem::find(&head, b"facet").is_some();
    if !is_exact && head.trim_ascii_start().starts_with(b"solid") && has_facets {
        return read_ascii(input);
    }
    match (count, needed) {
        (Some(count), Some(needed)) if needed <= bytes.len() => read_binary(input, count),
        (Some(count), _) => Err(input.error(
            Location::Byte(80),
            format!(
                "the header declares {count} triangles of {TRIANGLE} bytes, but the file has {} bytes; it is cut short or not an STL file",
                bytes.len()
            ),
        )),
        (None, _) => Err(input.error(
            Location::Whole,
            "neither ascii STL (it would begin with 'solid' and have facets) nor binary STL (it is shorter than the header)",
        )),
    }
}

/// Triangles whose equal corners are merged.
struct Merger<'a> {
    memory: &'a Memory,
    not_finite: NotFinite,
    points: Vec<[f64; 3]>,
    index: HashMap<[u64; 3], u32>,
    faces: Vec<[u32; 3]>,
}

impl<'a> Merger<'a> {
    fn new(input: &'a Input) -> Self {
        Self {
            memory: &input.memory,
            not_finite: input.options.not_finite,
            points: Vec::new(),
            index: HashMap::new(),
            faces: Vec::new(),
        }
    }

    fn vertex(&mut self, point: [f64; 3]) -> Result<u32, String> {
        self.not_finite.check("vertex", point)?;
        // Adding 0 turns −0 into 0, so that the two are equal.
        let key = point.map(|x| (x + 0.0).to_bits());
        let next = self.points.len() as u32;
        if next == u32::MAX {
            return Err("more vertices than 32-bit indices can address; simplify the mesh".into());
        }
        self.grow_index()?;
        let index = *self.index.entry(key).or_insert(next);
        if index == next {
            self.memory.make_room(&mut self.points, 1)?;
            self.points.push(point);
        }
        Ok(index)
    }

    /// Ensures that the index has room for one more vertex.
    fn grow_index(&mut self) -> Result<(), String> {
        // An entry, a byte of metadata, and an eighth of the places free, in a power of two of places.
        let bytes = |entries: usize| {
            let places = (entries + entries / 7).next_power_of_two();
            places * (size_of::<([u64; 3], u32)>() + 1)
        };
        let old = self.index.capacity();
        if self.index.len() < old {
            return Ok(());
        }
        let new = (2 * old).max(56);
        self.memory.reserve(bytes(new))?;
        self.index
            .try_reserve(new - old)
            .map_err(|e| format!("{e}; free some memory or reduce the file"))?;
        self.memory.release(bytes(old));
        Ok(())
    }

    fn face(&mut self, face: [u32; 3]) -> Result<(), String> {
        self.memory.make_room(&mut self.faces, 1)?;
        self.faces.push(face);
        Ok(())
    }

    fn finish(self, dtype: Dtype) -> Geometry {
        Geometry {
            faces: self.faces,
            ..Geometry::from_points(self.points, dtype, Format::Stl)
        }
    }
}

fn read_binary(input: &Input, count: usize) -> Result<Geometry, Error> {
    let mut merger = Merger::new(input);
    let triangles = input.bytes[HEADER..].chunks_exact(TRIANGLE).take(count);
    for (index, triangle) in triangles.enumerate() {
        add_triangle(&mut merger, triangle).map_err(|problem| {
            let location = Location::Element {
                name: "triangle".into(),
                index,
                byte: HEADER + index * TRIANGLE,
            };
            input.error(location, problem)
        })?;
    }
    Ok(merger.finish(Dtype::F32))
}

fn add_triangle(merger: &mut Merger, triangle: &[u8]) -> Result<(), String> {
    let mut corners = [[0.0; 3]; 3];
    // The normal comes first and is skipped: it follows from the corners.
    let numbers = Number::F32.read_all(&triangle[12..48], Endian::Little);
    for (corner, number) in corners.as_flattened_mut().iter_mut().zip(numbers) {
        *corner = number;
    }
    let mut face = [0; 3];
    for (index, corner) in face.iter_mut().zip(corners) {
        *index = merger.vertex(corner)?;
    }
    merger.face(face)
}

fn read_ascii(input: &Input) -> Result<Geometry, Error> {
    let mut merger = Merger::new(input);
    let mut corners: Vec<u32> = Vec::new();
    let mut open = false;
    let mut lines = Lines::new(input.bytes);
    while let Some((line_number, line)) = lines.next_filled() {
        let bad = |problem: String| input.error(Location::Line(line_number), problem);
        let mut fields = words(line);
        match fields.next().map(<[u8]>::to_ascii_lowercase).as_deref() {
            Some(b"facet") => open = true,
            Some(b"vertex") => {
                let vertex = coordinates(fields).and_then(|point| merger.vertex(point));
                input.memory.make_room(&mut corners, 1).map_err(bad)?;
                corners.push(vertex.map_err(bad)?);
            }
            Some(b"endfacet") => {
                let face = <[u32; 3]>::try_from(corners.as_slice())
                    .map_err(|_| format!("the facet has {} corners, not 3", corners.len()));
                face.and_then(|face| merger.face(face)).map_err(bad)?;
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
        return Err(input.error(Location::Line(lines.number), problem));
    }
    Ok(merger.finish(Dtype::Text))
}

/// Writes a binary STL: single precision for any `T`, and no shared vertices.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let count = u32::try_from(mesh.faces().len()).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "STL cannot hold more than 2^32 - 1 triangles",
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
