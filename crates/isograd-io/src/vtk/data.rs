//! Arrays of a VTK file: ascii, inline base64, appended raw or base64; compressed by zlib or not.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use super::xml::{Appended, Node, parse};
use crate::error::{Error, Location};
use crate::number::{Dtype, Endian, Number, as_index};
use crate::source::{Source, number, words};

/// A VTK file: its XML tree and the storage format of its arrays.
pub(super) struct VtkFile<'a> {
    source: &'a Source,
    root: Node,
    appended: Option<Appended>,
    endian: Endian,
    header: Number,
    compressed: bool,
}

/// Content of a `DataArray`.
#[derive(Debug)]
pub(super) struct DataArray {
    pub name: String,
    pub components: usize,
    pub values: Vec<f64>,
    pub dtype: Dtype,
}

impl<'a> VtkFile<'a> {
    /// Parses the XML of a data set of type `kind` (`PolyData` or `ImageData`).
    pub fn open(source: &'a Source, kind: &str) -> Result<Self, Error> {
        let (root, appended) = parse(source)?;
        let refuse = |problem: String| Err(source.error(Location::Whole, problem));
        let Some(file) = root.child("VTKFile") else {
            return refuse("no element <VTKFile>; the file is not VTK XML".into());
        };
        if file.attribute("type") != Some(kind) || file.child(kind).is_none() {
            return refuse(format!("the data set is not {kind}; save it as {kind}"));
        }
        let compressed = match file.attribute("compressor") {
            None => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return refuse(format!(
                    "the compressor '{other}' is not supported; save it with zlib or uncompressed"
                ));
            }
        };
        Ok(Self {
            endian: match file.attribute("byte_order") {
                Some("BigEndian") => Endian::Big,
                _ => Endian::Little,
            },
            header: match file.attribute("header_type") {
                Some("UInt64") => Number::U64,
                _ => Number::U32,
            },
            compressed,
            source,
            root,
            appended,
        })
    }

    /// The data set: the element `kind` of [`Self::open`].
    pub fn data_set(&self, kind: &str) -> Result<&Node, Error> {
        let node = self.root.child("VTKFile").and_then(|file| file.child(kind));
        node.ok_or_else(|| {
            self.source
                .error(Location::Whole, format!("no element <{kind}>"))
        })
    }

    /// Refuses rows of an array that are not finite.
    pub fn check_rows(&self, node: &Node, what: &str, rows: &[[f64; 3]]) -> Result<(), Error> {
        let name = node.attribute("Name").unwrap_or(&node.name);
        self.source.check_rows(name, what, rows)
    }

    /// An error at an element.
    pub fn error(&self, node: &Node, problem: impl Into<String>) -> Error {
        let name = node.attribute("Name").unwrap_or(&node.name);
        let location = Location::Element {
            name: format!("<{}> '{name}'", node.name),
            index: 0,
            byte: node.byte,
        };
        match node.name.as_str() {
            "DataArray" => self.source.error(Location::Array(name.into()), problem),
            _ => self.source.error(location, problem),
        }
    }

    /// A required count in an attribute.
    pub fn count(&self, node: &Node, name: &str) -> Result<usize, Error> {
        node.attribute(name)
            .and_then(|text| text.trim().parse().ok())
            .ok_or_else(|| {
                self.error(
                    node,
                    format!("the attribute {name} is missing or not a count"),
                )
            })
    }

    /// Numbers in an attribute, or `default` if it is absent.
    pub fn numbers<const N: usize>(
        &self,
        node: &Node,
        name: &str,
        default: Option<[f64; N]>,
    ) -> Result<[f64; N], Error> {
        let Some(text) = node.attribute(name) else {
            return default.ok_or_else(|| self.error(node, format!("no attribute {name}")));
        };
        let values: Option<Vec<f64>> = words(text.as_bytes())
            .map(|word| number(word).ok())
            .collect();
        values
            .and_then(|values| <[f64; N]>::try_from(values).ok())
            .ok_or_else(|| self.error(node, format!("{name}=\"{text}\" is not {N} numbers")))
    }

    /// Reads an array.
    pub fn array(&self, node: &Node) -> Result<DataArray, Error> {
        let (values, dtype) = self
            .values(node)
            .map_err(|problem| self.error(node, problem))?;
        let components = match node.attribute("NumberOfComponents") {
            Some(text) => text.trim().parse().ok().filter(|&n| n > 0),
            None => Some(1),
        };
        let components = components
            .filter(|&n| values.len() % n == 0)
            .ok_or_else(|| {
                self.error(node, "NumberOfComponents does not fit the number of values")
            })?;
        Ok(DataArray {
            name: node.attribute("Name").unwrap_or_default().into(),
            components,
            values,
            dtype,
        })
    }

    fn values(&self, node: &Node) -> Result<(Vec<f64>, Dtype), String> {
        let kind = node.attribute("type").unwrap_or_default();
        let number_type =
            Number::from_vtk(kind).ok_or_else(|| format!("the type '{kind}' is not supported"))?;
        let text = self.source.bytes.get(node.text.clone()).unwrap_or_default();
        let stream = match node.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let values: Result<_, _> = words(text).map(number).collect();
                return Ok((values?, Dtype::Text));
            }
            "binary" => Stream::base64(text),
            "appended" => self.appended_stream(node)?,
            other => return Err(format!("the format '{other}' is not supported")),
        };
        let bytes = if self.compressed {
            self.compressed_bytes(stream)?
        } else {
            self.plain_bytes(stream)?
        };
        if bytes.len() % number_type.size() != 0 {
            return Err("the bytes are not a whole number of values; the file is damaged".into());
        }
        let values = number_type.read_all(&bytes, self.endian);
        Ok((values, number_type.dtype()))
    }

    fn appended_stream(&self, node: &Node) -> Result<Stream<'a>, String> {
        let appended = self
            .appended
            .as_ref()
            .ok_or("there is no <AppendedData>; the file is cut short")?;
        let bytes = node
            .attribute("offset")
            .and_then(|text| text.trim().parse::<usize>().ok())
            .and_then(|offset| appended.start.checked_add(offset))
            .and_then(|start| self.source.bytes.get(start..))
            .ok_or("its offset lies beyond the end of the file; the file is cut short")?;
        if !appended.base64 {
            return Ok(Stream::Raw(bytes));
        }
        let end = memchr::memchr(b'<', bytes).unwrap_or(bytes.len());
        Ok(Stream::base64(&bytes[..end]))
    }

    /// Reads `length, data`.
    fn plain_bytes(&self, mut stream: Stream) -> Result<Vec<u8>, String> {
        let header = self.header.size();
        let length = self.word(&stream.peek(header)?)?;
        let total = length.checked_add(header).ok_or(CUT)?;
        if stream.is_padded_after(header) {
            stream.take(header)?;
            return Ok(stream.take(length)?.into_owned());
        }
        Ok(stream.take(total)?[header..].to_vec())
    }

    /// Reads `blocks, block size, last block size, compressed sizes…`, then the blocks.
    fn compressed_bytes(&self, mut stream: Stream) -> Result<Vec<u8>, String> {
        let word = self.header.size();
        let blocks = self.word(&stream.peek(word)?)?;
        let header = blocks
            .checked_add(3)
            .and_then(|n| n.checked_mul(word))
            .ok_or(CUT)?;
        let sizes = stream.take(header)?;
        let sizes = sizes[3 * word..]
            .chunks_exact(word)
            .map(|bytes| self.word(bytes))
            .collect::<Result<Vec<usize>, _>>()?;
        let total = sizes.iter().try_fold(0usize, |sum, &n| sum.checked_add(n));
        let packed = stream.take(total.ok_or(CUT)?)?;
        let mut rest = &packed[..];
        let mut bytes = Vec::new();
        for size in sizes {
            let (block, after) = rest.split_at(size);
            ZlibDecoder::new(block)
                .read_to_end(&mut bytes)
                .map_err(|e| format!("a compressed block is damaged: {e}"))?;
            rest = after;
        }
        Ok(bytes)
    }

    /// Parses a word of a binary header: a count that does not exceed the size of the file.
    fn word(&self, bytes: &[u8]) -> Result<usize, String> {
        let value = self.header.read(bytes, self.endian).ok_or(CUT)?;
        as_index(value, self.source.bytes.len())
            .ok_or_else(|| format!("a length of {value} bytes exceeds the file; it is damaged"))
    }
}

/// Error of truncated data.
const CUT: &str = "the data are cut short";

/// Encoded bytes: raw, or base64 without white space.
enum Stream<'a> {
    Raw(&'a [u8]),
    Base64 { text: Cow<'a, [u8]>, at: usize },
}

impl<'a> Stream<'a> {
    fn base64(text: &'a [u8]) -> Self {
        let text = text.trim_ascii();
        let text = if text.iter().any(u8::is_ascii_whitespace) {
            Cow::Owned(
                text.iter()
                    .copied()
                    .filter(|b| !b.is_ascii_whitespace())
                    .collect(),
            )
        } else {
            Cow::Borrowed(text)
        };
        Self::Base64 { text, at: 0 }
    }

    /// Reads the next `n` bytes, which are encoded on their own.
    fn take(&mut self, n: usize) -> Result<Cow<'a, [u8]>, String> {
        let bytes = self.peek(n)?;
        match self {
            Self::Raw(rest) => *rest = &rest[n..],
            Self::Base64 { at, .. } => *at += encoded_length(n),
        }
        Ok(bytes)
    }

    fn peek(&self, n: usize) -> Result<Cow<'a, [u8]>, String> {
        match self {
            Self::Raw(rest) => Ok(Cow::Borrowed(rest.get(..n).ok_or(CUT)?)),
            Self::Base64 { text, at } => {
                let end = at.checked_add(encoded_length(n)).ok_or(CUT)?;
                let mut bytes = STANDARD
                    .decode(text.get(*at..end).ok_or(CUT)?)
                    .map_err(|e| format!("broken base64: {e}"))?;
                if bytes.len() < n {
                    return Err(CUT.into());
                }
                bytes.truncate(n);
                Ok(Cow::Owned(bytes))
            }
        }
    }

    /// Whether the next `n` bytes of base64 end in padding, so that a new stream follows them.
    fn is_padded_after(&self, n: usize) -> bool {
        match self {
            Self::Raw(_) => false,
            Self::Base64 { text, at } => text.get(at + encoded_length(n) - 1) == Some(&b'='),
        }
    }
}

/// Letters of base64 for `n` bytes, padding included.
fn encoded_length(n: usize) -> usize {
    n.div_ceil(3).saturating_mul(4)
}
