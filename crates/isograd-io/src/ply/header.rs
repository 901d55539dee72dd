//! The header of a PLY file, checked against the file's size.

use std::collections::HashSet;

use crate::error::{Error, Location};
use crate::lines::{Lines, quoted, words};
use crate::names::MAX_COLUMNS;
use crate::number::{Endian, Number};
use crate::source::Input;

/// Largest number of elements.
const MAX_ELEMENTS: usize = 256;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary(Endian),
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Scalar(Number),
    List { count: Number, item: Number },
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    line: usize,
}

#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Byte offset of the data.
    pub body: usize,
    /// Number of lines of the header.
    pub lines: usize,
}

impl Element {
    /// Smallest number of bytes of one element.
    fn min_bytes(&self, encoding: Encoding) -> usize {
        let bytes = |p: &Property| match (encoding, p.kind) {
            // A digit, and a space or the end of the line.
            (Encoding::Ascii, _) => 2,
            (Encoding::Binary(_), Kind::Scalar(number)) => number.size(),
            (Encoding::Binary(_), Kind::List { count, .. }) => count.size(),
        };
        self.properties.iter().map(bytes).sum()
    }

    /// Number of bytes of each element; `None` if it has a list.
    pub fn fixed_bytes(&self) -> Option<usize> {
        self.properties
            .iter()
            .map(|p| match p.kind {
                Kind::Scalar(number) => Some(number.size()),
                Kind::List { .. } => None,
            })
            .sum()
    }
}

/// Lines of a header, as far as they are read. The sets make the work per line constant.
#[derive(Default)]
struct Builder<'a> {
    encoding: Option<Encoding>,
    elements: Vec<Element>,
    element_names: HashSet<&'a [u8]>,
    /// Names of the properties of the last element.
    property_names: HashSet<&'a [u8]>,
    /// Number of properties of all elements.
    properties: usize,
}

impl<'a> Builder<'a> {
    /// Reads a line; `true` at the end of the header.
    fn line(&mut self, line: &'a [u8], number: usize) -> Result<bool, String> {
        let mut fields = words(line);
        match fields.next() {
            Some(b"end_header") => return Ok(true),
            None | Some(b"ply" | b"comment" | b"obj_info") => {}
            Some(b"format") => {
                self.encoding = Some(parse_format(fields.next()).ok_or(
                    "is not a PLY format; it must be ascii, binary_little_endian or binary_big_endian",
                )?);
            }
            Some(b"element") => self.element(fields, number)?,
            Some(b"property") => self.property(fields)?,
            Some(_) => return Err("is not a line of a PLY header".into()),
        }
        Ok(false)
    }

    fn element(
        &mut self,
        fields: impl Iterator<Item = &'a [u8]>,
        line: usize,
    ) -> Result<(), String> {
        let (name, count) = parse_element(fields).ok_or("is not 'element NAME COUNT'")?;
        if !self.element_names.insert(name) {
            return Err("is there twice; merge the two".into());
        }
        if self.elements.len() == MAX_ELEMENTS {
            return Err(format!(
                "follows {MAX_ELEMENTS} elements, the maximum; remove some"
            ));
        }
        self.property_names.clear();
        self.elements.push(Element {
            name: text(name),
            count,
            properties: Vec::new(),
            line,
        });
        Ok(())
    }

    fn property(&mut self, fields: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let (name, kind) = parse_property(fields)
            .ok_or("is not 'property TYPE NAME' or 'property list TYPE TYPE NAME'")?;
        let element = self
            .elements
            .last_mut()
            .ok_or("stands before any element")?;
        if !self.property_names.insert(name) {
            return Err("is there twice; rename one of the two".into());
        }
        if self.properties == MAX_COLUMNS {
            return Err(format!(
                "follows {MAX_COLUMNS} properties, the maximum; remove some"
            ));
        }
        self.properties += 1;
        element.properties.push(Property {
            name: text(name),
            kind,
        });
        Ok(())
    }
}

impl Header {
    pub fn parse(input: &Input) -> Result<Self, Error> {
        let mut lines = Lines::new(input.bytes);
        let mut builder = Builder::default();
        loop {
            let Some((number, line)) = lines.next() else {
                return Err(input.error(
                    Location::Line(lines.number),
                    "the header has no 'end_header' line; the file is cut short",
                ));
            };
            let is_end = builder.line(line, number).map_err(|problem| {
                let problem = format!("{} {problem}", quoted(line));
                input.error(Location::Line(number), problem)
            })?;
            if is_end {
                break;
            }
        }
        let encoding = builder.encoding.ok_or_else(|| {
            let problem = "the header has no 'format' line";
            input.error(Location::Line(lines.number), problem)
        })?;
        let header = Self {
            encoding,
            elements: builder.elements,
            body: lines.offset.min(input.bytes.len()),
            lines: lines.number,
        };
        header.check_size(input)?;
        Ok(header)
    }

    /// Refuses counts that exceed the rest of the file, before anything is allocated.
    fn check_size(&self, input: &Input) -> Result<(), Error> {
        // The last line of a text may lack its end.
        let slack = usize::from(self.encoding == Encoding::Ascii);
        let mut left = input.bytes.len() - self.body + slack;
        for element in &self.elements {
            let min_bytes = element.min_bytes(self.encoding);
            if min_bytes == 0 && element.count > 0 {
                let problem = format!("element '{}' has no property; remove it", element.name);
                return Err(input.error(Location::Line(element.line), problem));
            }
            match element.count.checked_mul(min_bytes) {
                Some(needed) if needed <= left => left -= needed,
                _ => {
                    let problem = format!(
                        "the header declares {} of element '{}' (at least {min_bytes} bytes each), but only {left} bytes are left; the file is cut short or the count is wrong",
                        element.count, element.name
                    );
                    return Err(input.error(Location::Line(element.line), problem));
                }
            }
        }
        Ok(())
    }
}

fn parse_format(word: Option<&[u8]>) -> Option<Encoding> {
    Some(match word? {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::Binary(Endian::Little),
        b"binary_big_endian" => Encoding::Binary(Endian::Big),
        _ => return None,
    })
}

/// Name and count of an element.
fn parse_element<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Option<(&'a [u8], usize)> {
    let name = fields.next()?;
    let count = std::str::from_utf8(fields.next()?).ok()?.parse().ok()?;
    Some((name, count))
}

/// Name and kind of a property.
fn parse_property<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Option<(&'a [u8], Kind)> {
    let first = fields.next()?;
    let kind = if first == b"list" {
        let count = Number::from_ply(fields.next()?)?;
        if matches!(count, Number::F32 | Number::F64) {
            return None;
        }
        Kind::List {
            count,
            item: Number::from_ply(fields.next()?)?,
        }
    } else {
        Kind::Scalar(Number::from_ply(first)?)
    };
    Some((fields.next()?, kind))
}

fn text(word: &[u8]) -> String {
    String::from_utf8_lossy(word).into_owned()
}
