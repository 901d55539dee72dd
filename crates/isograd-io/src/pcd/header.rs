//! The header of a PCD file, checked against the file's size.

use super::{NORMAL, PACKED, PADDING};
use crate::columns::find_columns;
use crate::error::{Error, Location};
use crate::lines::{Lines, quoted, words};
use crate::names::{MAX_COLUMNS, UniqueNames};
use crate::number::{Dtype, Number};
use crate::source::Input;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

/// Column of the table of points: a component of a field, or a channel of a packed color.
#[derive(Debug)]
pub(super) struct Column {
    pub name: String,
    pub number: Number,
    /// Shift of the channel in a packed color.
    pub shift: Option<u32>,
    /// Index among the numbers of a line.
    pub word: usize,
    /// Byte offset of the first point's value, and distance to that of the next point.
    pub base: usize,
    pub stride: usize,
}

#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub points: usize,
    pub columns: Vec<Column>,
    /// Numbers in a line.
    pub words: usize,
    /// Bytes of a point.
    pub row: usize,
    /// Byte offset of the data.
    pub body: usize,
    /// Number of lines of the header.
    pub lines: usize,
    /// Line of the number of points.
    pub points_line: usize,
}

/// Name, number type and count of a field.
type FieldType<'a> = (&'a [u8], Number, usize);

/// Entries of the header: words and line number.
#[derive(Default)]
struct Entries<'a> {
    fields: Vec<&'a [u8]>,
    sizes: Vec<usize>,
    types: Vec<&'a [u8]>,
    counts: Vec<usize>,
    /// Width, height, points.
    numbers: [Option<usize>; 3],
    points_line: usize,
}

impl<'a> Entries<'a> {
    /// Reads a line; the encoding at the end of the header.
    fn line(&mut self, line: &'a [u8], number: usize) -> Result<Option<Encoding>, String> {
        let mut rest = words(line);
        let key = rest.next().unwrap_or_default();
        match key {
            b"" | b"VERSION" | b"VIEWPOINT" => {}
            key if key.starts_with(b"#") => {}
            b"FIELDS" | b"COLUMNS" => self.fields = few(rest)?,
            b"TYPE" => self.types = few(rest)?,
            b"SIZE" => self.sizes = counts(rest)?,
            b"COUNT" => self.counts = counts(rest)?,
            b"WIDTH" | b"HEIGHT" | b"POINTS" => {
                let index = match key {
                    b"WIDTH" => 0,
                    b"HEIGHT" => 1,
                    _ => 2,
                };
                let values = counts(rest)?;
                let [count] = values[..] else {
                    return Err("does not have one number".into());
                };
                self.numbers[index] = Some(count);
                self.points_line = number;
            }
            b"DATA" => {
                return match rest.next() {
                    Some(b"ascii") => Ok(Some(Encoding::Ascii)),
                    Some(b"binary") => Ok(Some(Encoding::Binary)),
                    Some(b"binary_compressed") => Ok(Some(Encoding::Compressed)),
                    _ => Err("must be ascii, binary or binary_compressed".into()),
                };
            }
            _ => return Err("is not a line of a PCD header".into()),
        }
        Ok(None)
    }

    /// Number of points.
    fn points(&self) -> Result<usize, String> {
        let [width, height, points] = self.numbers;
        let size = match (width, height) {
            (Some(width), height) => width.checked_mul(height.unwrap_or(1)),
            (None, _) => points,
        };
        match (size, points) {
            (Some(size), None) => Ok(size),
            (Some(size), Some(points)) if size == points => Ok(size),
            (None, None) => Err("the header lacks WIDTH or POINTS".into()),
            _ => Err("POINTS is not WIDTH times HEIGHT".into()),
        }
    }

    /// Names, number types and counts of the fields.
    fn fields(&self) -> Result<Vec<FieldType<'a>>, String> {
        let n = self.fields.len();
        let counts_fit = self.counts.is_empty() || self.counts.len() == n;
        if self.sizes.len() != n || self.types.len() != n || !counts_fit {
            return Err("FIELDS, SIZE, TYPE and COUNT differ in length".into());
        }
        let field = |i: usize| {
            let number = number(self.types[i], self.sizes[i]).ok_or_else(|| {
                let (name, kind) = (quoted(self.fields[i]), quoted(self.types[i]));
                format!(
                    "field {name} has the type {kind} of size {}, which is not supported",
                    self.sizes[i]
                )
            })?;
            Ok((
                self.fields[i],
                number,
                self.counts.get(i).copied().unwrap_or(1),
            ))
        };
        (0..n).map(field).collect()
    }
}

impl Header {
    pub fn parse(input: &Input) -> Result<Self, Error> {
        let mut lines = Lines::new(input.bytes);
        let mut entries = Entries::default();
        let encoding = loop {
            let Some((number, line)) = lines.next() else {
                let problem = "the header has no 'DATA' line; the file is cut short";
                return Err(input.error(Location::Line(lines.number), problem));
            };
            let end = entries.line(line, number).map_err(|problem| {
                let problem = format!("{} {problem}", quoted(line));
                input.error(Location::Line(number), problem)
            })?;
            if let Some(encoding) = end {
                break encoding;
            }
        };
        let bad = |problem: String| input.error(Location::Whole, problem);
        let points = entries.points().map_err(bad)?;
        let fields = entries.fields().map_err(bad)?;
        let mut header = Self {
            encoding,
            points,
            columns: Vec::new(),
            words: 0,
            row: 0,
            body: lines.offset.min(input.bytes.len()),
            lines: lines.number,
            points_line: entries.points_line,
        };
        header.measure(&fields).map_err(bad)?;
        header.check_size(input)?;
        header.add_columns(&fields, input).map_err(bad)?;
        Ok(header)
    }

    /// Adds up the numbers in a line and the bytes of a point.
    fn measure(&mut self, fields: &[(&[u8], Number, usize)]) -> Result<(), String> {
        let add = |(words, row): (usize, usize), (_, number, count): &(&[u8], Number, usize)| {
            let bytes = count.checked_mul(number.size())?;
            Some((words.checked_add(*count)?, row.checked_add(bytes)?))
        };
        let sums = fields.iter().try_fold((0, 0), add);
        (self.words, self.row) =
            sums.ok_or("the sizes of the fields are too large; the file is damaged")?;
        Ok(())
    }

    /// Names the columns, after the sizes were checked against the file.
    fn add_columns(
        &mut self,
        fields: &[(&[u8], Number, usize)],
        input: &Input,
    ) -> Result<(), String> {
        /// Upper bound for the memory of a column and its name.
        const EACH: usize = 512;
        let mut unique = UniqueNames::default();
        let (mut word, mut offset) = (0, 0);
        for &(name, number, count) in fields {
            let size = number.size();
            // Without points, one column of a field says that it is there.
            let components = if self.points == 0 {
                count.min(1)
            } else {
                count
            };
            let name = String::from_utf8_lossy(name);
            let (base, stride) = match self.encoding {
                Encoding::Compressed => (offset * self.points, count * size),
                _ => (offset, self.row),
            };
            let mut add = |name: &str, component: usize, shift: Option<u32>| {
                self.columns.push(Column {
                    name: unique.add(name, |_| true),
                    number,
                    shift,
                    word: word + component,
                    base: base + component * size,
                    stride,
                });
            };
            if name == PADDING {
                // It has no column.
            } else if PACKED.contains(&&*name) && count == 1 && size == 4 {
                let channels = [("red", 16), ("green", 8), ("blue", 0), ("alpha", 24)];
                for (channel, shift) in &channels[..name.len()] {
                    add(channel, 0, Some(*shift));
                }
            } else {
                if components > MAX_COLUMNS {
                    return Err(TOO_MANY.into());
                }
                input.memory.reserve(components * EACH)?;
                for component in 0..components {
                    match count {
                        1 => add(&name, 0, None),
                        _ => add(&format!("{name}_{component}"), component, None),
                    }
                }
            }
            if self.columns.len() > MAX_COLUMNS {
                return Err(TOO_MANY.into());
            }
            (word, offset) = (word + count, offset + count * size);
        }
        Ok(())
    }

    /// Refuses counts that exceed the rest of the file, before anything is allocated.
    fn check_size(&self, input: &Input) -> Result<(), Error> {
        let left = input.bytes.len() - self.body;
        // A digit, and a space or the end of the line, which the last line may lack.
        let (row, left) = match self.encoding {
            Encoding::Ascii => (self.words.saturating_mul(2), left + 1),
            Encoding::Binary => (self.row, left),
            Encoding::Compressed => (self.row, left.saturating_mul(super::lzf::LARGEST_RATIO)),
        };
        if self.encoding == Encoding::Compressed {
            self.check_unpacked(&input.bytes[self.body..])
                .map_err(|problem| input.error(Location::Byte(self.body), problem))?;
        }
        match self.points.checked_mul(row) {
            Some(needed) if needed <= left => Ok(()),
            _ => {
                let problem = format!(
                    "the header declares {} points (at least {row} bytes each), but the file has {} bytes of data; it is cut short or the count is wrong",
                    self.points,
                    input.bytes.len() - self.body
                );
                Err(input.error(Location::Line(self.points_line), problem))
            }
        }
    }

    /// Checks the sizes before the compressed data.
    fn check_unpacked(&self, data: &[u8]) -> Result<(), String> {
        let Some(&[_, _, _, _, a, b, c, d]) = data.first_chunk::<8>() else {
            return Err(
                "the sizes of the compressed data are missing; the file is cut short".into(),
            );
        };
        let unpacked = u32::from_le_bytes([a, b, c, d]) as usize;
        match Some(unpacked) == self.row.checked_mul(self.points) {
            true => Ok(()),
            false => Err(format!(
                "the data unpack to {unpacked} bytes, but {} points take {} bytes each; the file is damaged",
                self.points, self.row
            )),
        }
    }

    /// Name of every column.
    pub fn names(&self) -> Vec<Option<&str>> {
        self.columns.iter().map(|c| Some(c.name.as_str())).collect()
    }

    /// Columns of the coordinates, and of the normals if there are any.
    pub fn vectors(&self) -> Result<([usize; 3], Option<[usize; 3]>), String> {
        let names = self.names();
        let points = find_columns(&names, ["x", "y", "z"]);
        let points = points.ok_or("the header lacks one of the fields x, y, z")?;
        Ok((points, find_columns(&names, NORMAL)))
    }

    /// Number type of the coordinates.
    pub fn dtype(&self, xyz: [usize; 3]) -> Dtype {
        match self.encoding {
            Encoding::Ascii => Dtype::Text,
            _ => self.columns[xyz[0]].number.dtype(),
        }
    }
}

const TOO_MANY: &str = "more than 4096 numbers per point; remove some";

/// Words of a line, at most as many as columns are accepted.
fn few<'a>(words: impl Iterator<Item = &'a [u8]>) -> Result<Vec<&'a [u8]>, String> {
    let words: Vec<&[u8]> = words.take(MAX_COLUMNS + 1).collect();
    match words.len() > MAX_COLUMNS {
        true => Err(format!("has more than {MAX_COLUMNS} words; remove some")),
        false => Ok(words),
    }
}

fn counts<'a>(words: impl Iterator<Item = &'a [u8]>) -> Result<Vec<usize>, String> {
    let parse = |word: &[u8]| std::str::from_utf8(word).ok()?.parse().ok();
    few(words)?
        .into_iter()
        .map(|word| {
            parse(word).ok_or_else(|| format!("has {}, which is not a count", quoted(word)))
        })
        .collect()
}

fn number(kind: &[u8], size: usize) -> Option<Number> {
    Some(match (kind, size) {
        (b"I", 1) => Number::I8,
        (b"U", 1) => Number::U8,
        (b"I", 2) => Number::I16,
        (b"U", 2) => Number::U16,
        (b"I", 4) => Number::I32,
        (b"U", 4) => Number::U32,
        (b"I", 8) => Number::I64,
        (b"U", 8) => Number::U64,
        (b"F", 4) => Number::F32,
        (b"F", 8) => Number::F64,
        _ => return None,
    })
}
