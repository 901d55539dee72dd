//! Columns of numbers as text: `.xyz`, `.csv`, `.txt`.
//!
//! The delimiter is `;`, `,` or white space, as in the first row. A line that begins with `#` or `//` is
//! a comment. Column names come from a first line that is not all numbers, or from a comment just before
//! the first row if it names `x`, `y` and `z`. Without names, 3 columns are points, 6 are points and
//! normals (or colors, if all of them are whole numbers from 0 to 255), and any others are attributes. A
//! first line with a single number is the number of rows.

use std::io::{self, Write};

use isograd::{PointCloud, Real};

use crate::columns::{PointTable, column_names, find_columns, row};
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::number::Dtype;
use crate::source::{Lines, Source, number};

/// Reads a table of numbers as a point cloud.
pub(crate) fn read(source: &Source) -> Result<Geometry, Error> {
    let bytes = source.bytes.as_slice();
    let byte_order_mark = b"\xef\xbb\xbf";
    let bytes = bytes.strip_prefix(byte_order_mark).unwrap_or(bytes);
    let mut reader = Reader::default();
    let mut lines = Lines::new(bytes);
    while let Some((number, line)) = lines.next_filled() {
        reader
            .line(line, number)
            .map_err(|problem| source.error(Location::Line(number), problem))?;
    }
    reader.finish(source)
}

/// Separator of the fields of a row.
#[derive(Clone, Copy, PartialEq)]
enum Delimiter {
    Space,
    Byte(u8),
}

impl Delimiter {
    fn detect(line: &[u8]) -> Self {
        match [b';', b','].iter().find(|d| line.contains(d)) {
            Some(&d) => Self::Byte(d),
            None => Self::Space,
        }
    }

    fn fields(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        let line = match self {
            // Some programs write a delimiter after the last field.
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

    /// Parses the fields into `row`; fails at the first that is not a number.
    fn numbers(self, line: &[u8], row: &mut Vec<f64>) -> Result<(), String> {
        row.clear();
        for field in self.fields(line) {
            row.push(number(field).map_err(|problem| {
                format!("{problem}; a row must hold numbers only, with a decimal point")
            })?);
        }
        Ok(())
    }

    fn names(self, line: &[u8]) -> Vec<String> {
        let name = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            text.trim_matches(['"', '\'']).trim().to_ascii_lowercase()
        };
        self.fields(line).map(name).collect()
    }

    /// Whether a line that is not all numbers can be a header: at least three fields, each with a
    /// letter and none a number.
    fn is_header(self, line: &[u8]) -> bool {
        let is_word =
            |field: &[u8]| number(field).is_err() && field.iter().any(u8::is_ascii_alphabetic);
        self.fields(line).all(is_word) && self.fields(line).count() >= 3
    }
}

/// State of the reader.
#[derive(Default)]
struct Reader<'a> {
    /// The last comment.
    comment: &'a [u8],
    /// The number that stands alone in the first line, and the number of that line.
    declared: Option<(f64, usize)>,
    /// Lower-case names of the columns, if a line of its own gives them.
    names: Option<Vec<String>>,
    /// Known from the first row on.
    table: Option<Table>,
    row: Vec<f64>,
}

impl<'a> Reader<'a> {
    fn line(&mut self, line: &'a [u8], line_number: usize) -> Result<(), String> {
        if let Some(comment) = line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"//")) {
            self.comment = comment;
            return Ok(());
        }
        if let Some(table) = &mut self.table {
            table.delimiter.numbers(line, &mut self.row)?;
            return table.push(&self.row);
        }
        let delimiter = Delimiter::detect(line);
        let parsed = delimiter.numbers(line, &mut self.row);
        if self.names.is_none() && self.declared.is_none() {
            if parsed.is_err() && delimiter.is_header(line) {
                self.names = Some(delimiter.names(line));
                return Ok(());
            }
            if parsed.is_ok() && self.row.len() == 1 {
                self.declared = Some((self.row[0], line_number));
                return Ok(());
            }
        }
        parsed?;
        let names = self.names.take().or_else(|| self.names_in_comment());
        let mut table = Table::new(delimiter, names, self.row.len());
        table.push(&self.row)?;
        self.table = Some(table);
        Ok(())
    }

    /// Column names in the comment before the first row.
    fn names_in_comment(&self) -> Option<Vec<String>> {
        let names = Delimiter::detect(self.comment).names(self.comment);
        let has = |name: &str| names.iter().any(|n| n == name);
        let named = names.len() == self.row.len() && has("x") && has("y") && has("z");
        named.then_some(names)
    }

    fn finish(self, source: &Source) -> Result<Geometry, Error> {
        let rows = self.table.as_ref().map_or(0, |table| table.rows.len());
        if let Some((count, line)) = self.declared
            && count != rows as f64
        {
            let problem = format!(
                "the first line declares {count} rows, but there are {rows}; the file is cut short or the count is wrong"
            );
            return Err(source.error(Location::Line(line), problem));
        }
        let table = self.table.map(Table::into_geometry);
        Ok(table.unwrap_or_else(|| Geometry::from_points(Vec::new(), Dtype::Text, Format::Text)))
    }
}

/// Rows of equal length.
struct Table {
    delimiter: Delimiter,
    width: usize,
    has_names: bool,
    rows: PointTable,
}

impl Table {
    /// `width` is the number of columns where they have no names.
    fn new(delimiter: Delimiter, names: Option<Vec<String>>, width: usize) -> Self {
        let has_names = names.is_some();
        let names = names.unwrap_or_else(|| {
            (1..=width)
                .map(|column| format!("column_{column}"))
                .collect()
        });
        let names: Vec<Option<&str>> = names.iter().map(|name| Some(name.as_str())).collect();
        let normal = find_columns(&names, ["nx", "ny", "nz"])
            .or_else(|| find_columns(&names, ["normal_x", "normal_y", "normal_z"]))
            .or((!has_names && width == 6).then_some([3, 4, 5]));
        let xyz = find_columns(&names, ["x", "y", "z"]).unwrap_or([0, 1, 2]);
        Self {
            delimiter,
            width: names.len(),
            has_names,
            rows: PointTable::new(&names, xyz, normal, 0),
        }
    }

    fn push(&mut self, row: &[f64]) -> Result<(), String> {
        let (n, width) = (row.len(), self.width);
        if n < 3 {
            return Err(format!("the row has {n} numbers; x, y and z are required"));
        }
        if n != width {
            return Err(format!(
                "the row has {n} numbers, but the lines before it have {width} columns"
            ));
        }
        self.rows.push(row)
    }

    fn into_geometry(mut self) -> Geometry {
        if !self.has_names && self.width == 6 {
            self.rows.reinterpret_normals_as_colors();
        }
        self.rows.into_geometry(Dtype::Text, Format::Text)
    }
}

/// Writes a cloud under a line of column names (a comment unless the delimiter is a comma), with the
/// fewest digits that give back the same numbers.
pub(crate) fn write_cloud<T: Real>(
    out: &mut impl Write,
    cloud: &PointCloud<T>,
    delimiter: &str,
) -> io::Result<()> {
    let comment = if delimiter == "," { "" } else { "# " };
    let names = column_names(cloud, char::is_ascii_alphanumeric);
    writeln!(out, "{comment}{}", names.join(delimiter))?;
    for i in 0..cloud.len() {
        let row: Vec<String> = row(cloud, i).map(|value| format!("{value:?}")).collect();
        writeln!(out, "{}", row.join(delimiter))?;
    }
    Ok(())
}
