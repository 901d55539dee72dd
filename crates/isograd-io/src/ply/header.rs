//! The header of a PLY file, checked against the file's size.

use crate::error::{Error, Location};
use crate::number::{Endian, Number};
use crate::source::{Lines, Source, quoted, words};

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

impl Header {
    pub fn parse(source: &Source) -> Result<Self, Error> {
        let mut lines = Lines::new(&source.bytes);
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let Some((number, line)) = lines.next() else {
                return Err(source.error(
                    Location::Line(lines.number),
                    "the header has no 'end_header' line; the file is cut short",
                ));
            };
            let bad = |problem: &str| {
                let text = format!("{} {problem}", quoted(line));
                source.error(Location::Line(number), text)
            };
            let mut fields = words(line);
            match fields.next() {
                Some(b"end_header") => break,
                None | Some(b"ply" | b"comment" | b"obj_info") => {}
                Some(b"format") => {
                    encoding = Some(parse_format(fields.next()).ok_or_else(|| {
                        bad("is not a PLY format; it must be ascii, binary_little_endian or binary_big_endian")
                    })?);
                }
                Some(b"element") => {
                    let element = parse_element(fields, number)
                        .ok_or_else(|| bad("is not 'element NAME COUNT'"))?;
                    if elements.iter().any(|e| e.name == element.name) {
                        return Err(bad("is there twice; merge the two"));
                    }
                    elements.push(element);
                }
                Some(b"property") => {
                    let property = parse_property(fields).ok_or_else(|| {
                        bad("is not 'property TYPE NAME' or 'property list TYPE TYPE NAME'")
                    })?;
                    let element = elements
                        .last_mut()
                        .ok_or_else(|| bad("stands before any element"))?;
                    if element.properties.iter().any(|p| p.name == property.name) {
                        return Err(bad("is there twice; rename one of the two"));
                    }
                    element.properties.push(property);
                }
                Some(_) => return Err(bad("is not a line of a PLY header")),
            }
        }
        let encoding = encoding.ok_or_else(|| {
            source.error(
                Location::Line(lines.number),
                "the header has no 'format' line",
            )
        })?;
        let header = Self {
            encoding,
            elements,
            body: lines.offset.min(source.bytes.len()),
            lines: lines.number,
        };
        header.check_size(source)?;
        Ok(header)
    }

    /// Refuses counts that exceed the rest of the file, before anything is allocated.
    fn check_size(&self, source: &Source) -> Result<(), Error> {
        // The last line of a text may lack its end.
        let slack = usize::from(self.encoding == Encoding::Ascii);
        let mut left = source.bytes.len() - self.body + slack;
        for element in &self.elements {
            let min_bytes = element.min_bytes(self.encoding);
            if min_bytes == 0 && element.count > 0 {
                let problem = format!("element '{}' has no property; remove it", element.name);
                return Err(source.error(Location::Line(element.line), problem));
            }
            match element.count.checked_mul(min_bytes) {
                Some(needed) if needed <= left => left -= needed,
                _ => {
                    let problem = format!(
                        "the header declares {} of element '{}' (at least {min_bytes} bytes each), but only {left} bytes are left; the file is cut short or the count is wrong",
                        element.count, element.name
                    );
                    return Err(source.error(Location::Line(element.line), problem));
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

fn parse_element<'a>(mut fields: impl Iterator<Item = &'a [u8]>, line: usize) -> Option<Element> {
    Some(Element {
        name: text(fields.next()?),
        count: std::str::from_utf8(fields.next()?).ok()?.parse().ok()?,
        properties: Vec::new(),
        line,
    })
}

fn parse_property<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Option<Property> {
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
    Some(Property {
        name: text(fields.next()?),
        kind,
    })
}

fn text(word: &[u8]) -> String {
    String::from_utf8_lossy(word).into_owned()
}
