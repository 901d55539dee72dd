//! Columns of numbers as text: `.xyz`, `.csv`, `.txt`, and `.pts`, `.xyzn`, `.xyzrgb`.
//!
//! The delimiter is `;`, `,` or white space, as in the first row; fields may be quoted. A line that begins with `#` or
//! `//` is a comment. Column names come from a first line that is not all numbers, or from a comment just before the first
//! row. A header must name the coordinates ([`names::find`]), or the user chooses columns. Without a header, 3 columns are
//! points, 6 are points and normals (or colors, if all of them are whole numbers from 0 to 255), and any others are
//! attributes. A first line with a single number is the number of rows.
//!
//! Without a header, a `.pts` has intensity, color, or both behind the points, an `.xyzn` normals and an `.xyzrgb` colors. In a
//! `.pts` several scans may follow one another, each under its number of rows.

use std::io::{self, Write};

use isograd::{PointCloud, Real};

use crate::columns::{NORMAL, PointTable, column_names, row};
use crate::error::{Error, Location};
use crate::fields::Delimiter;
use crate::format::Format;
use crate::geometry::Geometry;
use crate::limits::Memory;
use crate::lines::Lines;
use crate::names::{self, Quantity};
use crate::number::Dtype;
use crate::source::Input;

/// Reads a table of numbers as a point cloud.
pub(crate) fn read(input: &Input, format: Format) -> Result<Geometry, Error> {
    let byte_order_mark = b"\xef\xbb\xbf";
    let bytes = input.bytes.strip_prefix(byte_order_mark);
    let bytes = bytes.unwrap_or(input.bytes);
    let mut reader = Reader {
        input,
        format,
        comment: (0, b""),
        declared: None,
        table: None,
        row: Vec::new(),
    };
    let mut lines = Lines::new(bytes);
    while let Some((number, line)) = lines.next_filled() {
        reader
            .line(line, number)
            .map_err(|(number, problem)| input.error(Location::Line(number), problem))?;
    }
    reader.finish()
}

/// State of the reader.
struct Reader<'a> {
    input: &'a Input<'a>,
    format: Format,
    /// The last comment and its line.
    comment: (usize, &'a [u8]),
    /// The number that stands alone in the first line, and the number of that line.
    declared: Option<(f64, usize)>,
    /// Known from the header or the first row on.
    table: Option<Table>,
    row: Vec<f64>,
}

impl<'a> Reader<'a> {
    /// Reads a line; an error is a problem and its line.
    fn line(&mut self, line: &'a [u8], number: usize) -> Result<(), (usize, String)> {
        let here = |problem| (number, problem);
        if let Some(comment) = line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"//")) {
            self.comment = (number, comment.trim_ascii());
            return Ok(());
        }
        let memory = &self.input.memory;
        if let Some(table) = &mut self.table {
            let delimiter = *table.delimiter.get_or_insert(Delimiter::detect(line));
            delimiter.numbers(line, &mut self.row).map_err(here)?;
            if self.format == Format::Pts
                && let ([more], Some((count, _))) = (self.row.as_slice(), &mut self.declared)
                && *count == table.rows.len() as f64
            {
                *count += more;
                return Ok(());
            }
            return table.push(memory, &self.row).map_err(here);
        }
        let delimiter = Delimiter::detect(line);
        let parsed = delimiter.numbers(line, &mut self.row);
        if parsed.is_err()
            && self.declared.is_none()
            && self.is_header(delimiter, line).map_err(here)?
        {
            self.table = Some(self.with_header(delimiter, line).map_err(here)?);
            return Ok(());
        }
        parsed.map_err(here)?;
        if self.declared.is_none() && self.row.len() == 1 {
            self.declared = Some((self.row[0], number));
            return Ok(());
        }
        let mut table = match self.header_in_comment(delimiter) {
            Some(by) => self
                .with_header(by, self.comment.1)
                .map_err(|problem| (self.comment.0, problem))?,
            None => Table::new(self.input, self.format, None, self.row.len()).map_err(here)?,
        };
        table.delimiter = Some(delimiter);
        table.push(memory, &self.row).map_err(here)?;
        self.table = Some(table);
        Ok(())
    }

    /// Whether a line that is not all numbers has the names of the columns.
    fn is_header(&self, delimiter: Delimiter, line: &[u8]) -> Result<bool, String> {
        Ok(delimiter.is_header(line) || self.names_points(&delimiter.names(line)?))
    }

    /// Whether the columns of the coordinates are clear from these names.
    fn names_points(&self, all: &[String]) -> bool {
        match &self.input.options.columns.points {
            Some(wanted) => wanted.iter().all(|name| all.contains(name)),
            None => names::find(all, Quantity::Points).is_some(),
        }
    }

    /// The delimiter of the header in the comment before the first row, if it is one: as many names as the row has
    /// numbers, and coordinates among them. Prose has no commas where the row has them.
    fn header_in_comment(&self, of_row: Delimiter) -> Option<Delimiter> {
        let comment = self.comment.1;
        let delimiter = Delimiter::detect(comment);
        let names = delimiter.names(comment).ok()?;
        let is_table =
            delimiter == of_row && of_row != Delimiter::Space && delimiter.is_header(comment);
        let is_header = names.len() == self.row.len() && (is_table || self.names_points(&names));
        is_header.then_some(delimiter)
    }

    fn with_header(&self, delimiter: Delimiter, line: &[u8]) -> Result<Table, String> {
        // Names, also in lower case and in the attributes; up to three bytes for one that is not UTF-8.
        self.input.memory.reserve(9 * line.len())?;
        let names = delimiter.names(line)?;
        let width = names.len();
        Table::new(self.input, self.format, Some(names), width)
    }

    fn finish(self) -> Result<Geometry, Error> {
        let rows = self.table.as_ref().map_or(0, |table| table.rows.len());
        if let Some((count, line)) = self.declared
            && count != rows as f64
        {
            let problem = format!(
                "the file declares {count} rows, but there are {rows}; the file is cut short or the count is wrong"
            );
            return Err(self.input.error(Location::Line(line), problem));
        }
        let comment = Delimiter::detect(self.comment.1);
        let names = comment.names(self.comment.1);
        let table = match self.table {
            Some(table) => Some(table),
            // A header without rows.
            None if names.is_ok_and(|names| self.names_points(&names)) => {
                let table = self.with_header(comment, self.comment.1);
                let line = Location::Line(self.comment.0);
                Some(table.map_err(|problem| self.input.error(line, problem))?)
            }
            None => None,
        };
        let Some(table) = table else {
            return Ok(Geometry::from_points(Vec::new(), Dtype::Text, self.format));
        };
        table
            .into_geometry(self.input, self.format)
            .map_err(|problem| self.input.error(Location::Whole, problem))
    }
}

/// Rows of equal length.
struct Table {
    /// Known from the first row on.
    delimiter: Option<Delimiter>,
    width: usize,
    /// Whether the normals may be colors.
    may_be_colors: bool,
    rows: PointTable,
}

impl Table {
    /// A table of `width` columns, with their names if there is a header.
    fn new(
        input: &Input,
        format: Format,
        names: Option<Vec<String>>,
        width: usize,
    ) -> Result<Self, String> {
        let wanted = &input.options.columns;
        let is_plain = names.is_none() && wanted.points.is_none();
        if is_plain && matches!(format, Format::Xyzn | Format::Xyzrgb) && width < 6 {
            let vector = if format == Format::Xyzn {
                "nx, ny and nz"
            } else {
                "r, g and b"
            };
            let name = format.name();
            return Err(format!(
                "the row has {width} numbers, and {name} has x, y, z, {vector}"
            ));
        }
        let xyz = match (&wanted.points, &names) {
            (Some(wanted), names) => names::choose(wanted, names.as_deref(), width)?,
            (None, Some(names)) => {
                names::find(names, Quantity::Points).ok_or_else(|| names::unrecognized(names))?
            }
            (None, None) => [0, 1, 2],
        };
        let plain_six = is_plain && width == 6 && format == Format::Text;
        let normal = match (&wanted.normals, &names) {
            (Some(wanted), names) => Some(names::choose(wanted, names.as_deref(), width)?),
            (None, Some(names)) => names::find(names, Quantity::Normals),
            (None, None) => (plain_six || is_plain && format == Format::Xyzn).then_some([3, 4, 5]),
        };
        let may_be_colors = plain_six && wanted.normals.is_none();
        let names = names.unwrap_or_else(|| {
            let known = attribute_names(format, width);
            let name = |column: usize| known.get(column.wrapping_sub(4)).map(|&name| name.into());
            (1..=width)
                .map(|column| name(column).unwrap_or_else(|| format!("column_{column}")))
                .collect()
        });
        // A column without a name is the index that some programs write.
        let names: Vec<Option<&str>> = names
            .iter()
            .map(|name| Some(name.as_str()).filter(|name| !name.is_empty()))
            .collect();
        Ok(Self {
            delimiter: None,
            width,
            may_be_colors,
            rows: PointTable::new(input, &names, xyz, normal, 0)?,
        })
    }

    fn push(&mut self, memory: &Memory, row: &[f64]) -> Result<(), String> {
        let (n, width) = (row.len(), self.width);
        if n < 3 {
            return Err(format!("the row has {n} numbers; x, y and z are required"));
        }
        if n != width {
            let may_be_decimal = self.delimiter == Some(Delimiter::Byte(b',')) && n == 2 * width;
            let hint = match may_be_decimal {
                true => "; decimal commas must be decimal points",
                false => "",
            };
            return Err(format!(
                "the row has {n} numbers, but the lines before it have {width} columns{hint}"
            ));
        }
        self.rows.push(memory, row)
    }

    fn into_geometry(mut self, input: &Input, format: Format) -> Result<Geometry, String> {
        if self.may_be_colors {
            self.rows.reinterpret_normals_as_colors(&input.memory)?;
        }
        Ok(self.rows.into_geometry(Dtype::Text, format))
    }
}

/// Names of the columns behind x, y and z in a file of `width` columns without a header.
fn attribute_names(format: Format, width: usize) -> &'static [&'static str] {
    const ALL: &[&str] = &["intensity", "red", "green", "blue"];
    match (format, width) {
        (Format::Pts, 4) => &ALL[..1],
        (Format::Pts, 6) | (Format::Xyzrgb, _) => &ALL[1..],
        (Format::Pts, 7..) => ALL,
        _ => &[],
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
    let names = column_names(cloud, char::is_ascii_alphanumeric, &NORMAL, &[])?;
    writeln!(out, "{comment}{}", names.join(delimiter))?;
    for i in 0..cloud.len() {
        let row: Vec<String> = row(cloud, i).map(|value| format!("{value:?}")).collect();
        writeln!(out, "{}", row.join(delimiter))?;
    }
    Ok(())
}
