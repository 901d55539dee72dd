//! Object file format as text: `OFF`, with normals (`N`) and colors (`C`) of the vertices. Texture coordinates (`ST`) and colors
//! of faces are ignored.
//!
//! Geomview, whose format it is, has normals before colors. MeshLab begins with `NCOFF`, and has colors before normals.

use std::io::{self, Write};

use isograd::{Mesh, Real};

use crate::columns::{NORMAL, PointTable, find_columns};
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::lines::{Lines, number, quoted, words};
use crate::number::{Dtype, as_index};
use crate::polygon::triangulate;
use crate::source::Input;

/// Kind of the vertices, from the keyword in the first line.
#[derive(Clone, Copy, Debug, Default)]
struct Kind {
    texture: bool,
    colors: bool,
    normals: bool,
    /// Whether the keyword has the normals before the colors.
    normals_named_first: bool,
    /// Whether vertices have their colors before their normals.
    colors_come_first: bool,
}

impl Kind {
    /// Splits the keyword off the first line, which need not have one; the counts may follow it, even without a space.
    fn split(line: &[u8]) -> Result<(Self, &[u8]), String> {
        let mut kind = Self::default();
        let mut rest = line;
        loop {
            rest = match rest {
                [b'S', b'T', after @ ..] if !kind.texture => {
                    kind.texture = true;
                    after
                }
                [b'C', after @ ..] if !kind.colors => {
                    (kind.colors, kind.normals_named_first) = (true, kind.normals);
                    after
                }
                [b'N', after @ ..] if !kind.normals => {
                    kind.normals = true;
                    after
                }
                _ => break,
            };
        }
        match rest.strip_prefix(b"OFF") {
            Some(counts) if counts.trim_ascii().starts_with(b"BINARY") => {
                Err("the file is binary; save it as text".into())
            }
            Some(counts) => Ok((kind, counts)),
            None if line.first().is_some_and(u8::is_ascii_digit) => Ok((Self::default(), line)),
            None => Err(format!(
                "{} is not 'OFF', 'COFF', 'NOFF', 'CNOFF' or 'NCOFF'",
                quoted(line)
            )),
        }
    }

    /// Names of the columns of a vertex with `width` numbers.
    fn names(self, width: usize) -> Result<Vec<Option<&'static str>>, String> {
        let mut names = vec!["x", "y", "z"];
        let normals = if self.normals { &NORMAL[..] } else { &[] };
        let texture = if self.texture { 2 } else { 0 };
        let colors = match width.saturating_sub(names.len() + normals.len() + texture) {
            _ if !self.colors => &[][..],
            count => &["red", "green", "blue", "alpha"][..count.clamp(3, 4)],
        };
        names.extend(match self.colors_come_first {
            true => [colors, normals].concat(),
            false => [normals, colors].concat(),
        });
        let names: Vec<_> = names
            .into_iter()
            .map(Some)
            .chain([None; 2].into_iter().take(texture))
            .collect();
        match names.len() == width {
            true => Ok(names),
            false => Err(format!(
                "the vertex has {width} numbers, but the first line of the file announces {}; vertices with colors need 'COFF', and with normals 'NOFF'",
                names.len()
            )),
        }
    }
}

/// Lines without comments, and the number of the last one.
#[derive(Clone)]
struct Rows<'a> {
    input: &'a Input<'a>,
    lines: Lines<'a>,
}

impl<'a> Rows<'a> {
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        loop {
            let (number, line) = self.lines.next_filled()?;
            let line = line
                .split(|&b| b == b'#')
                .next()
                .unwrap_or_default()
                .trim_ascii();
            if !line.is_empty() {
                return Some((number, line));
            }
        }
    }

    /// Row `index` of `count`.
    fn row(&mut self, what: &str, index: usize, count: usize) -> Result<(usize, &'a [u8]), Error> {
        let number = self.lines.number;
        self.next().ok_or_else(|| {
            let problem = format!("the file ends after {index} of {count} {what}; it is cut short");
            self.input.error(Location::Line(number), problem)
        })
    }
}

/// Reads an OFF file.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let mut rows = Rows {
        input,
        lines: Lines::new(input.bytes),
    };
    let bad = |line: usize, problem: String| input.error(Location::Line(line), problem);
    let no_counts = "the numbers of vertices and faces are missing; the file is cut short";
    let (mut line, first) = rows.next().ok_or_else(|| bad(1, no_counts.into()))?;
    let (mut kind, mut text) = Kind::split(first).map_err(|problem| bad(line, problem))?;
    if text.trim_ascii().is_empty() {
        (line, text) = rows.next().ok_or_else(|| bad(line, no_counts.into()))?;
    }
    let left = input.bytes.len().saturating_sub(rows.lines.offset) + 1;
    let [vertices, faces] = counts(text, left).map_err(|problem| bad(line, problem))?;
    kind.colors_come_first =
        kind.normals_named_first && colors_come_first(rows.clone(), kind.texture, vertices);
    let table = read_vertices(&mut rows, kind, vertices)?;
    let points = table.as_ref().map_or(&[][..], PointTable::points);
    let triangles = read_faces(&mut rows, faces, points)?;
    Ok(Geometry {
        faces: triangles,
        ..match table {
            Some(table) => table.into_geometry(Dtype::Text, Format::Off),
            None => Geometry::from_points(Vec::new(), Dtype::Text, Format::Off),
        }
    })
}

/// Numbers of vertices and faces, refused if they exceed the `left` bytes, before anything is allocated.
fn counts(line: &[u8], left: usize) -> Result<[usize; 2], String> {
    let mut numbers = words(line).map(|word| std::str::from_utf8(word).ok()?.parse().ok());
    let (Some(Some(vertices)), Some(Some(faces))) = (numbers.next(), numbers.next()) else {
        return Err(format!(
            "{} is not the numbers of vertices, faces and edges",
            quoted(line)
        ));
    };
    // Three digits with a space or the end of the line behind each, and the number of corners for a face.
    let needed =
        |vertices: usize, faces: usize| vertices.checked_mul(6)?.checked_add(faces.checked_mul(8)?);
    match needed(vertices, faces) {
        Some(needed) if needed <= left => Ok([vertices, faces]),
        _ => Err(format!(
            "the file declares {vertices} vertices and {faces} faces, but only {left} bytes are left; it is cut short or the counts are wrong"
        )),
    }
}

/// Whether a vertex has a color only if colors come before normals.
fn colors_come_first(mut rows: Rows, texture: bool, count: usize) -> bool {
    let is_color = |values: &[f64]| {
        let is_byte = |v: &f64| v.fract() == 0.0 && (0.0..=255.0).contains(v);
        values.iter().all(|v| (0.0..=1.0).contains(v)) || values.iter().all(is_byte)
    };
    let mut row = Vec::new();
    (0..count).map_while(|_| rows.next()).any(|(_, text)| {
        row.clear();
        row.extend(
            words(text)
                .take(LONGEST)
                .map_while(|word| number(word).ok()),
        );
        let end = row.len() - if texture { 2.min(row.len()) } else { 0 };
        // Three numbers of the normal, and three or four of the color.
        let values = row.get(3..end).unwrap_or_default();
        match values {
            [_, _, _, last @ ..] if matches!(last.len(), 3 | 4) => {
                !is_color(last) && is_color(&values[..last.len()])
            }
            _ => false,
        }
    })
}

/// Reads the vertices; `None` if there are none.
fn read_vertices(rows: &mut Rows, kind: Kind, count: usize) -> Result<Option<PointTable>, Error> {
    let input = rows.input;
    let mut table = None;
    let (mut row, mut width) = (Vec::new(), 0);
    for index in 0..count {
        let (line, text) = rows.row("vertices", index, count)?;
        let mut push = || {
            row.clear();
            for word in words(text) {
                if row.len() == LONGEST {
                    return Err(format!("the vertex has more than {LONGEST} numbers"));
                }
                row.push(number(word)?);
            }
            if table.is_none() {
                width = row.len();
                let names = kind.names(width)?;
                let normal = find_columns(&names, NORMAL);
                table = Some(PointTable::new(input, &names, [0, 1, 2], normal, count)?);
            } else if row.len() != width {
                return Err(format!(
                    "the vertex has {} numbers, and those before it {width}",
                    row.len()
                ));
            }
            table
                .as_mut()
                .map_or(Ok(()), |table| table.push(&input.memory, &row))
        };
        push().map_err(|problem| input.error(Location::Line(line), problem))?;
    }
    Ok(table)
}

/// Most numbers of a vertex: coordinates, normal, color with opacity, texture.
const LONGEST: usize = 12;

/// Reads faces and cuts them into triangles.
fn read_faces(rows: &mut Rows, count: usize, points: &[[f64; 3]]) -> Result<Vec<[u32; 3]>, Error> {
    let vertices = points.len();
    let memory = &rows.input.memory;
    let mut triangles = Vec::new();
    let mut corners = Vec::new();
    for index in 0..count {
        let (line, text) = rows.row("faces", index, count)?;
        let mut push = || {
            let mut words = words(text);
            let length = number(words.next().unwrap_or_default())?;
            // A corner takes two bytes.
            let length = as_index(length, text.len() / 2 + 1).ok_or_else(|| {
                format!("the face declares {length} corners, more than the line holds")
            })?;
            if length < 3 {
                return Err(format!("the face has {length} corners; remove it"));
            }
            corners.clear();
            for _ in 0..length {
                let word = words.next().ok_or("the line has too few numbers")?;
                let corner = as_index(number(word)?, vertices.min(u32::MAX as usize));
                let corner = corner.ok_or_else(|| {
                    let last = vertices as i64 - 1;
                    format!(
                        "the face names vertex {}, but the vertices are 0 to {last}",
                        quoted(word)
                    )
                })?;
                memory.make_room(&mut corners, 1)?;
                corners.push(corner as u32);
            }
            triangulate(memory, points, &corners, &mut triangles)
        };
        push().map_err(|problem| rows.input.error(Location::Line(line), problem))?;
    }
    Ok(triangles)
}

/// Writes a mesh with the fewest digits that give back the same numbers.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    writeln!(
        out,
        "OFF\n{} {} 0",
        mesh.vertices().len(),
        mesh.faces().len()
    )?;
    for [x, y, z] in mesh.vertices() {
        writeln!(out, "{x:?} {y:?} {z:?}")?;
    }
    for [a, b, c] in mesh.faces() {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}
