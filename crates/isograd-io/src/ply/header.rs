//! The header of a PLY file, checked against the file's size.

use crate::error::{Error, Place};
use crate::number::{Endian, Number};
use crate::source::{Lines, Source, shown, words};

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
    /// Where the data begin, in bytes.
    pub body: usize,
    /// Number of the header's last line.
    pub lines: usize,
}

impl Element {
    /// The fewest bytes that one element can take.
    fn least_bytes(&self, encoding: Encoding) -> usize {
        let bytes = |p: &Property| match (encoding, p.kind) {
            // A digit, and a space or the end of the line.
            (Encoding::Ascii, _) => 2,
            (Encoding::Binary(_), Kind::Scalar(number)) => number.size(),
            (Encoding::Binary(_), Kind::List { count, .. }) => count.size(),
        };
        self.properties.iter().map(bytes).sum()
    }

    /// The bytes that every element takes, unless there is a list.
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
                    Place::Line(lines.number),
                    "the header has no 'end_header' line; the file is cut short",
                ));
            };
            let bad = |problem: &str| {
                let text = format!("{} {problem}", shown(line));
                source.error(Place::Line(number), text)
            };
            let mut fields = words(line);
            match fields.next() {
                Some(b"end_header") => break,
                None | Some(b"ply" | b"comment" | b"obj_info") => {}
                Some(b"format") => {
                    encoding = Some(parse_format(fields.next()).ok_or_else(|| {
                        bad("is no PLY format; it must be ascii, binary_little_endian or binary_big_endian")
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
                Some(_) => return Err(bad("is no line of a PLY header")),
            }
        }
        let encoding = encoding.ok_or_else(|| {
            source.error(Place::Line(lines.number), "the header has no 'format' line")
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

    /// Refuses counts that the rest of the file can't hold, before anything is allocated.
    fn check_size(&self, source: &Source) -> Result<(), Error> {
        // The last line of a text may lack its end.
        let slack = usize::from(self.encoding == Encoding::Ascii);
        let mut left = source.bytes.len() - self.body + slack;
        for element in &self.elements {
            let least = element.least_bytes(self.encoding);
            if least == 0 && element.count > 0 {
                let problem = format!("element '{}' has no property; remove it", element.name);
                return Err(source.error(Place::Line(element.line), problem));
            }
            match element.count.checked_mul(least) {
                Some(needed) if needed <= left => left -= needed,
                _ => {
                    let problem = format!(
                        "the header promises {} of element '{}' (at least {least} bytes each), but only {left} bytes are left for them; the file is cut short or the count is wrong",
                        element.count, element.name
                    );
                    return Err(source.error(Place::Line(element.line), problem));
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
        let count = parse_type(fields.next()?)?;
        if matches!(count, Number::F32 | Number::F64) {
            return None;
        }
        Kind::List {
            count,
            item: parse_type(fields.next()?)?,
        }
    } else {
        Kind::Scalar(parse_type(first)?)
    };
    Some(Property {
        name: text(fields.next()?),
        kind,
    })
}

fn parse_type(word: &[u8]) -> Option<Number> {
    Some(match word {
        b"char" | b"int8" => Number::I8,
        b"uchar" | b"uint8" => Number::U8,
        b"short" | b"int16" => Number::I16,
        b"ushort" | b"uint16" => Number::U16,
        b"int" | b"int32" => Number::I32,
        b"uint" | b"uint32" => Number::U32,
        b"int64" => Number::I64,
        b"uint64" => Number::U64,
        b"float" | b"float32" => Number::F32,
        b"double" | b"float64" => Number::F64,
        _ => return None,
    })
}

fn text(word: &[u8]) -> String {
    String::from_utf8_lossy(word).into_owned()
}
