//! Columns of numbers as text: `.xyz`, `.csv`, `.txt`.
//!
//! The delimiter is `;`, `,` or white space, whichever the first row shows. A line that begins with `#`
//! or `//` is a comment. A first line that is not all numbers, or a comment just before the first row,
//! names the columns where it names `x`, `y` and `z`. Without names, 3 columns are points, 6 are points
//! and normals (or colors, where all of them are whole numbers of 0 to 255), and any others are kept as
//! attributes. A first line with one number is the number of rows.

use isograd::data::Attribute;

use crate::error::{Error, Place};
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite};
use crate::number::Dtype;
use crate::source::{Lines, Source, number, shown};

/// Reads a table of numbers as a cloud.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let bytes = source.bytes.as_slice();
    // A byte order mark, as some editors write it.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = Reader::default();
    let mut lines = Lines::new(bytes);
    while let Some((number, line)) = lines.next_filled() {
        reader
            .line(line, number)
            .map_err(|problem| source.error(Place::Line(number), problem))?;
    }
    reader.finish(source)
}

/// What separates the fields of a row.
#[derive(Clone, Copy, PartialEq)]
enum Delimiter {
    Space,
    Byte(u8),
}

impl Delimiter {
    fn of(line: &[u8]) -> Self {
        match [b';', b','].iter().find(|d| line.contains(d)) {
            Some(&d) => Self::Byte(d),
            None => Self::Space,
        }
    }

    fn fields(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        let line = match self {
            // A delimiter after the last field, as some programs write it, opens no new one.
            Self::Byte(d) => line.strip_suffix(&[d]).unwrap_or(line),
            Self::Space => line,
        };
        line.split(move |b| match self {
            Self::Space => b.is_ascii_whitespace(),
            Self::Byte(d) => *b == d,
        })
        .map(<[u8]>::trim_ascii)
        .filter(move |field| self != Self::Space || !field.is_empty())
    }

    /// The fields as numbers, or the first that is none.
    fn numbers(self, line: &[u8], row: &mut Vec<f64>) -> Result<(), String> {
        row.clear();
        for field in self.fields(line) {
            row.push(number(field).ok_or_else(|| {
                format!(
                    "{} is not a number; rows hold numbers alone, with a point as decimal mark",
                    shown(field)
                )
            })?);
        }
        Ok(())
    }
}

/// What has been read so far.
#[derive(Default)]
struct Reader<'a> {
    /// The comment read last.
    comment: &'a [u8],
    /// The number that stands alone in the first line, and that line.
    promised: Option<(f64, usize)>,
    /// Names of the columns, lower case, where a line of its own gives them.
    names: Option<Vec<String>>,
    /// Known from the first row on.
    table: Option<Table>,
    row: Vec<f64>,
}

impl<'a> Reader<'a> {
    fn line(&mut self, line: &'a [u8], line_number: usize) -> Result<(), String> {
        if let Some(comment) = comment_text(line) {
            self.comment = comment;
            return Ok(());
        }
        if let Some(table) = &mut self.table {
            table.delimiter.numbers(line, &mut self.row)?;
            return table.push(&self.row);
        }
        let delimiter = Delimiter::of(line);
        let parsed = delimiter.numbers(line, &mut self.row);
        if self.names.is_none() && self.promised.is_none() {
            if parsed.is_err() && is_header(delimiter, line) {
                self.names = Some(names(delimiter, line));
                return Ok(());
            }
            if parsed.is_ok() && self.row.len() == 1 {
                self.promised = Some((self.row[0], line_number));
                return Ok(());
            }
        }
        parsed?;
        let mut table = Table::new(delimiter, self.column_names());
        table.push(&self.row)?;
        self.table = Some(table);
        Ok(())
    }

    /// The names of the columns: from a line of their own, or from the comment before the first row.
    fn column_names(&mut self) -> Names {
        let in_comment = names(Delimiter::of(self.comment), self.comment);
        match self.names.take() {
            Some(names) => Names::Given(names),
            None if in_comment.len() == self.row.len() && xyz(&in_comment).is_some() => {
                Names::Given(in_comment)
            }
            None => Names::None(self.row.len()),
        }
    }

    fn finish(self, source: &Source) -> Result<Geometry, Error> {
        let rows = self.table.as_ref().map_or(0, Table::rows);
        if let Some((count, line)) = self.promised
            && count != rows as f64
        {
            let problem = format!(
                "the first line promises {count} rows, but there are {rows}; the file is cut short or the count is wrong"
            );
            return Err(source.error(Place::Line(line), problem));
        }
        let table = self
            .table
            .unwrap_or_else(|| Table::new(Delimiter::Space, Names::None(3)));
        Ok(table.into_geometry())
    }
}

/// What is known of the columns before the rows are read.
enum Names {
    Given(Vec<String>),
    /// Nothing but how many there are.
    None(usize),
}

/// Rows of equal length, and what each column is.
struct Table {
    delimiter: Delimiter,
    xyz: [usize; 3],
    normal: Option<[usize; 3]>,
    names: Vec<String>,
    values: Vec<f64>,
}

impl Table {
    fn new(delimiter: Delimiter, names: Names) -> Self {
        let (xyz, normal, names) = match names {
            Names::Given(names) => (xyz(&names).unwrap_or([0, 1, 2]), normal(&names), names),
            Names::None(width) => {
                let names = (0..width).map(|c| format!("column_{}", c + 1)).collect();
                ([0, 1, 2], (width == 6).then_some([3, 4, 5]), names)
            }
        };
        Self {
            delimiter,
            xyz,
            normal,
            names,
            values: Vec::new(),
        }
    }

    fn push(&mut self, row: &[f64]) -> Result<(), String> {
        let width = self.names.len();
        if row.len() < 3 {
            return Err(format!(
                "the row has {} numbers; x, y and z are needed",
                row.len()
            ));
        }
        if row.len() != width {
            return Err(format!(
                "the row has {} numbers, but the lines before it have {width} columns",
                row.len()
            ));
        }
        refuse_not_finite("point", self.xyz.map(|column| row[column]))?;
        if let Some(normal) = self.normal {
            refuse_not_finite("normal", normal.map(|column| row[column]))?;
        }
        self.values.extend_from_slice(row);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.values.len() / self.names.len()
    }

    fn column(&self, column: usize) -> impl Iterator<Item = f64> {
        let values = self.values.iter().skip(column);
        values.step_by(self.names.len()).copied()
    }

    fn three(&self, columns: [usize; 3]) -> Vec<[f64; 3]> {
        let rows = self.values.chunks_exact(self.names.len());
        rows.map(|row| columns.map(|column| row[column])).collect()
    }

    /// Six columns without names may be points and colors: whole numbers of 0 to 255, not all 0 or 1.
    fn tell_colors_from_normals(&mut self) {
        let byte = |v: f64| v.fract() == 0.0 && (0.0..=255.0).contains(&v);
        let is_unnamed = self.names.last().is_some_and(|name| name == "column_6");
        let colors = is_unnamed
            && self.names.len() == 6
            && (3..6).all(|c| self.column(c).all(byte))
            && (3..6).any(|c| self.column(c).any(|v| v > 1.0));
        if colors {
            self.normal = None;
            for (name, color) in self.names[3..].iter_mut().zip(["red", "green", "blue"]) {
                *name = color.into();
            }
        }
    }

    fn into_geometry(mut self) -> Geometry {
        self.tell_colors_from_normals();
        let used = |c: &usize| {
            self.xyz.contains(c) || self.normal.is_some_and(|normal| normal.contains(c))
        };
        let attributes = (0..self.names.len())
            .filter(|c| !used(c))
            .map(|c| Attribute {
                name: self.names[c].clone(),
                components: 1,
                values: self.column(c).collect(),
            })
            .collect();
        Geometry {
            points: self.three(self.xyz),
            normals: self.normal.map(|normal| self.three(normal)),
            attributes,
            faces: Vec::new(),
            dtype: Dtype::Text,
            format: Format::Text,
        }
    }
}

fn comment_text(line: &[u8]) -> Option<&[u8]> {
    line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"//"))
}

/// Whether a line that is not all numbers can be a header: three fields at least, each with a letter and
/// none a number.
fn is_header(delimiter: Delimiter, line: &[u8]) -> bool {
    let is_word =
        |field: &[u8]| number(field).is_none() && field.iter().any(u8::is_ascii_alphabetic);
    delimiter.fields(line).all(is_word) && delimiter.fields(line).count() >= 3
}

fn names(delimiter: Delimiter, line: &[u8]) -> Vec<String> {
    delimiter
        .fields(line)
        .map(|field| {
            String::from_utf8_lossy(field)
                .trim_matches(['"', '\''])
                .trim()
                .to_ascii_lowercase()
        })
        .collect()
}

fn xyz(names: &[String]) -> Option<[usize; 3]> {
    find(names, ["x", "y", "z"])
}

fn normal(names: &[String]) -> Option<[usize; 3]> {
    find(names, ["nx", "ny", "nz"]).or_else(|| find(names, ["normal_x", "normal_y", "normal_z"]))
}

fn find(names: &[String], wanted: [&str; 3]) -> Option<[usize; 3]> {
    let at = |name: &str| names.iter().position(|n| n == name);
    Some([at(wanted[0])?, at(wanted[1])?, at(wanted[2])?])
}
