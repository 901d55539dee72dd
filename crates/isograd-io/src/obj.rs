//! Wavefront OBJ: vertices, per-vertex normals and polygons; everything else is ignored.
//!
//! The reader is our own: the crate `tobj` gives no line in its errors and drops vertices without faces.

use std::io::{self, Write};

use isograd::{Mesh, Real};

use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::limits::Memory;
use crate::lines::{Lines, coordinates, quoted, words};
use crate::number::Dtype;
use crate::options::NotFinite;
use crate::polygon::Triangles;
use crate::source::Input;

/// Reads an OBJ file. Normals are kept if there is one per vertex and every face pairs them by index.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let memory = &input.memory;
    let mut reader = Reader {
        not_finite: input.options.not_finite,
        ..Reader::default()
    };
    let mut lines = Lines::new(input.bytes);
    let mut joined = Vec::new();
    while let Some((line_number, line)) = lines.next() {
        let bad = |problem: String| input.error(Location::Line(line_number), problem);
        let mut line = line;
        // A backslash at the end continues the line on the next one.
        if line.ends_with(b"\\") {
            joined.clear();
            while let Some(part) = line.strip_suffix(b"\\") {
                append(memory, &mut joined, part).map_err(bad)?;
                append(memory, &mut joined, b" ").map_err(bad)?;
                line = lines.next().map_or(b"", |(_, next)| next);
            }
            append(memory, &mut joined, line).map_err(bad)?;
            line = &joined;
        }
        reader.line(memory, line, line_number).map_err(bad)?;
    }
    reader.finish(input)
}

fn append(memory: &Memory, text: &mut Vec<u8>, part: &[u8]) -> Result<(), String> {
    memory.make_room(text, part.len())?;
    text.extend_from_slice(part);
    Ok(())
}

#[derive(Default)]
struct Reader {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    faces: Triangles,
    corners: Vec<u32>,
    not_finite: NotFinite,
    /// Whether a corner has a normal of another index than its vertex.
    normals_differ: bool,
    /// Highest vertex index of a face, and the line of the face.
    highest: Option<(u32, usize)>,
}

impl Reader {
    fn line(&mut self, memory: &Memory, line: &[u8], line_number: usize) -> Result<(), String> {
        let mut fields = words(line);
        match fields.next() {
            Some(b"v") => {
                memory.make_room(&mut self.points, 1)?;
                let point = coordinates(fields)?;
                self.not_finite.check("vertex", point)?;
                self.points.push(point);
            }
            Some(b"vn") => {
                memory.make_room(&mut self.normals, 1)?;
                let normal = coordinates(fields)?;
                self.not_finite.check("normal", normal)?;
                self.normals.push(normal);
            }
            Some(b"f") => self.face(memory, fields, line_number)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(
        &mut self,
        memory: &Memory,
        fields: impl Iterator<Item = &'a [u8]>,
        line_number: usize,
    ) -> Result<(), String> {
        self.corners.clear();
        for field in fields.take_while(|field| !field.starts_with(b"#")) {
            let mut parts = field.split(|&b| b == b'/');
            let index = parts.next().unwrap_or_default();
            let vertex = resolve(index, self.points.len(), "vertex")?;
            if let Some(part) = parts.nth(1).filter(|part| !part.is_empty()) {
                self.normals_differ |= resolve(part, self.normals.len(), "normal")? != vertex;
            }
            if self.highest.is_none_or(|(highest, _)| vertex > highest) {
                self.highest = Some((vertex, line_number));
            }
            memory.make_room(&mut self.corners, 1)?;
            self.corners.push(vertex);
        }
        let count = self.corners.len();
        if count < 3 {
            return Err(format!("the face has {count} corners; remove it"));
        }
        self.faces.push(memory, &self.points, &self.corners)
    }

    fn finish(self, input: &Input) -> Result<Geometry, Error> {
        if self.points.is_empty() {
            let problem = "no line begins with 'v'; check that it is an OBJ file with vertices";
            return Err(input.error(Location::Whole, problem));
        }
        if let Some((highest, line)) = self.highest
            && highest as usize >= self.points.len()
        {
            let problem = format!(
                "the face names vertex {}, but there are only {}",
                u64::from(highest) + 1,
                self.points.len()
            );
            return Err(input.error(Location::Line(line), problem));
        }
        let per_vertex = self.normals.len() == self.points.len() && !self.normals_differ;
        let faces = self.faces.finish(&input.memory, &self.points);
        Ok(Geometry {
            normals: per_vertex.then_some(self.normals),
            faces: faces.map_err(|problem| input.error(Location::Whole, problem))?,
            ..Geometry::from_points(self.points, Dtype::Text, Format::Obj)
        })
    }
}

/// Converts an index of the file to one from 0: positive ones count from 1, negative ones backward
/// from the last of the `so_far` before it.
fn resolve(word: &[u8], so_far: usize, what: &str) -> Result<u32, String> {
    let index: i64 = std::str::from_utf8(word)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("{} is not an index", quoted(word)))?;
    let resolved = match index {
        0 => return Err(format!("{what} index 0; OBJ counts from 1")),
        1.. => index - 1,
        _ => so_far as i64 + index,
    };
    u32::try_from(resolved)
        .ok()
        .filter(|&i| i < u32::MAX)
        .ok_or_else(|| {
            format!("{what} index {index} is out of range; {so_far} are defined before it")
        })
}

/// Writes a mesh with the fewest digits that give back the same numbers.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    for [x, y, z] in mesh.vertices() {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for face in mesh.faces() {
        let [a, b, c] = face.map(|corner| u64::from(corner) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
