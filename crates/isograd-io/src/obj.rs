//! Wavefront OBJ: vertices, per-vertex normals and polygons; everything else is passed over.
//!
//! `tobj` was tried first: its errors name no line, and it drops vertices that no face uses.

use std::io::{self, Write};

use isograd::{Mesh, Real};

use crate::error::{Error, Place};
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite, triangulate};
use crate::number::Dtype;
use crate::source::{Lines, Source, number, shown, words};

/// Reads an OBJ file. Normals are kept where there is one per vertex and no face says otherwise.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let mut reader = Reader::default();
    let mut lines = Lines::new(&source.bytes);
    let mut joined = Vec::new();
    while let Some((line_number, line)) = lines.next() {
        let mut line = line;
        // A backslash at the end joins a line to the next.
        if line.ends_with(b"\\") {
            joined.clear();
            while let Some(part) = line.strip_suffix(b"\\") {
                joined.extend_from_slice(part);
                joined.push(b' ');
                line = lines.next().map_or(b"", |(_, next)| next);
            }
            joined.extend_from_slice(line);
            line = &joined;
        }
        reader
            .line(line, line_number)
            .map_err(|problem| source.error(Place::Line(line_number), problem))?;
    }
    reader.finish(source)
}

#[derive(Default)]
struct Reader {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    corners: Vec<u32>,
    /// Some corner has a normal of another index than its vertex.
    normals_differ: bool,
    /// The highest vertex named, and the line that names it.
    highest: Option<(u32, usize)>,
}

impl Reader {
    fn line(&mut self, line: &[u8], line_number: usize) -> Result<(), String> {
        let mut fields = words(line);
        match fields.next() {
            Some(b"v") => {
                let point = three(fields)?;
                refuse_not_finite("vertex", point)?;
                self.points.push(point);
            }
            Some(b"vn") => {
                let normal = three(fields)?;
                refuse_not_finite("normal", normal)?;
                self.normals.push(normal);
            }
            Some(b"f") => self.face(fields, line_number)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(
        &mut self,
        fields: impl Iterator<Item = &'a [u8]>,
        line_number: usize,
    ) -> Result<(), String> {
        self.corners.clear();
        for field in fields.take_while(|field| !field.starts_with(b"#")) {
            let mut parts = field.split(|&b| b == b'/');
            let vertex = resolve(
                parts.next().unwrap_or_default(),
                self.points.len(),
                "vertex",
            )?;
            if let Some(part) = parts.nth(1).filter(|part| !part.is_empty()) {
                self.normals_differ |= resolve(part, self.normals.len(), "normal")? != vertex;
            }
            if self.highest.is_none_or(|(highest, _)| vertex > highest) {
                self.highest = Some((vertex, line_number));
            }
            self.corners.push(vertex);
        }
        if self.corners.len() < 3 {
            return Err(format!(
                "the face has {} corners; remove it",
                self.corners.len()
            ));
        }
        triangulate(&self.corners, &mut self.faces);
        Ok(())
    }

    fn finish(self, source: &Source) -> Result<Geometry, Error> {
        if self.points.is_empty() {
            let problem = "no line begins with 'v'; check that it is an OBJ file with vertices";
            return Err(source.error(Place::Whole, problem));
        }
        if let Some((highest, line)) = self.highest
            && highest as usize >= self.points.len()
        {
            let problem = format!(
                "the face names vertex {}, but there are only {}",
                u64::from(highest) + 1,
                self.points.len()
            );
            return Err(source.error(Place::Line(line), problem));
        }
        let per_vertex = self.normals.len() == self.points.len() && !self.normals_differ;
        Ok(Geometry {
            points: self.points,
            normals: per_vertex.then_some(self.normals),
            attributes: Vec::new(),
            faces: self.faces,
            dtype: Dtype::Text,
            format: Format::Obj,
        })
    }
}

/// The first three numbers of a line; what follows (weights, colors) is passed over.
fn three<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Result<[f64; 3], String> {
    let mut v = [0.0; 3];
    for value in &mut v {
        let word = fields.next().ok_or("the line has fewer than 3 numbers")?;
        *value = number(word).ok_or_else(|| format!("{} is not a number", shown(word)))?;
    }
    Ok(v)
}

/// An index of the file as one from 0: positive ones count from 1, negative ones back from the last.
fn resolve(word: &[u8], so_far: usize, what: &str) -> Result<u32, String> {
    let index: i64 = std::str::from_utf8(word)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("{} is not an index", shown(word)))?;
    let resolved = match index {
        0 => return Err(format!("{what} index 0; OBJ counts from 1")),
        1.. => index - 1,
        _ => so_far as i64 + index,
    };
    u32::try_from(resolved)
        .ok()
        .filter(|&i| i < u32::MAX)
        .ok_or_else(|| format!("{what} index {index} is out of range; {so_far} come before it"))
}

/// Writes a mesh with the fewest digits that give back the same numbers.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    for &vertex in mesh.vertices() {
        let [x, y, z] = vertex;
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for face in mesh.faces() {
        let [a, b, c] = face.map(|corner| u64::from(corner) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
