//! Arrays of a VTK file: ascii, inline base64, appended raw or base64; compressed by zlib or not.

use std::borrow::Cow;

use super::stream::{Encoding, Stream};
use super::xml::{Appended, Node, parse};
use crate::error::{Error, Location};
use crate::lines::{number, words};
use crate::number::{Dtype, Endian, Number};
use crate::source::Input;

/// A VTK file: its XML tree and the storage format of its arrays.
pub(super) struct VtkFile<'a> {
    pub input: &'a Input<'a>,
    root: Node,
    appended: Option<Appended>,
    encoding: Encoding,
}

/// A `DataArray` whose values are not read yet.
#[derive(Debug)]
pub(super) struct DataArray<'a> {
    pub name: String,
    pub components: usize,
    /// Number of values of all components.
    pub count: usize,
    pub dtype: Dtype,
    numbers: Numbers<'a>,
}

/// Numbers of an array in their own type.
#[derive(Debug)]
enum Numbers<'a> {
    Text(&'a [u8]),
    Binary {
        bytes: Cow<'a, [u8]>,
        number: Number,
    },
}

impl<'a> VtkFile<'a> {
    /// Parses the XML of a data set of type `kind` (`PolyData` or `ImageData`).
    pub fn open(input: &'a Input<'a>, kind: &str) -> Result<Self, Error> {
        let (root, appended) = parse(input)?;
        let refuse = |problem: String| Err(input.error(Location::Whole, problem));
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
        let encoding = Encoding {
            endian: match file.attribute("byte_order") {
                Some("BigEndian") => Endian::Big,
                _ => Endian::Little,
            },
            header: match file.attribute("header_type") {
                Some("UInt64") => Number::U64,
                _ => Number::U32,
            },
            compressed,
            file_size: input.bytes.len(),
        };
        Ok(Self {
            input,
            root,
            appended,
            encoding,
        })
    }

    /// The data set: the element `kind` of [`Self::open`].
    pub fn data_set(&self, kind: &str) -> Result<&Node, Error> {
        let node = self.root.child("VTKFile").and_then(|file| file.child(kind));
        node.ok_or_else(|| {
            self.input
                .error(Location::Whole, format!("no element <{kind}>"))
        })
    }

    /// Refuses rows of an array that are not finite.
    pub fn check_rows(&self, node: &Node, what: &str, rows: &[[f64; 3]]) -> Result<(), Error> {
        let name = node.attribute("Name").unwrap_or(&node.name);
        self.input.check_rows(name, what, rows)
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
            "DataArray" => self.input.error(Location::Array(name.into()), problem),
            _ => self.input.error(location, problem),
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

    /// Finds the data of an array. Nothing is allocated for its values.
    pub fn array(&self, node: &Node) -> Result<DataArray<'a>, Error> {
        let bad = |problem: String| self.error(node, problem);
        let (numbers, dtype) = self.numbers_of(node).map_err(bad)?;
        let count = match &numbers {
            Numbers::Text(text) => words(text).count(),
            Numbers::Binary { bytes, number } => bytes.len() / number.size(),
        };
        let components = match node.attribute("NumberOfComponents") {
            Some(text) => text.trim().parse().ok().filter(|&n| n > 0),
            None => Some(1),
        };
        let components = components
            .filter(|&n| count % n == 0)
            .ok_or_else(|| bad("NumberOfComponents does not fit the number of values".into()))?;
        Ok(DataArray {
            name: node.attribute("Name").unwrap_or_default().into(),
            components,
            count,
            dtype,
            numbers,
        })
    }

    /// Values of an array.
    pub fn values(&self, node: &Node, array: &DataArray) -> Result<Vec<f64>, Error> {
        let values = self.input.memory.filled(array.count);
        let mut values: Vec<f64> = values.map_err(|problem| self.error(node, problem))?;
        self.read(node, array, |at, value| values[at] = value)?;
        Ok(values)
    }

    /// Rows of an array of three components.
    pub fn rows(&self, node: &Node, array: &DataArray) -> Result<Vec<[f64; 3]>, Error> {
        let rows = self.input.memory.filled(array.count / 3);
        let mut rows: Vec<[f64; 3]> = rows.map_err(|problem| self.error(node, problem))?;
        let values = rows.as_flattened_mut();
        self.read(node, array, |at, value| values[at] = value)?;
        Ok(rows)
    }

    /// Calls `put` with the index and the value of every number of an array.
    pub fn read(
        &self,
        node: &Node,
        array: &DataArray,
        mut put: impl FnMut(usize, f64),
    ) -> Result<(), Error> {
        match &array.numbers {
            Numbers::Text(text) => {
                for (at, word) in words(text).enumerate() {
                    put(
                        at,
                        number(word).map_err(|problem| self.error(node, problem))?,
                    );
                }
            }
            Numbers::Binary { bytes, number } => {
                let values = number.read_all(bytes, self.encoding.endian);
                values.enumerate().for_each(|(at, value)| put(at, value));
            }
        }
        Ok(())
    }

    fn numbers_of(&self, node: &Node) -> Result<(Numbers<'a>, Dtype), String> {
        let kind = node.attribute("type").unwrap_or_default();
        let number =
            Number::from_vtk(kind).ok_or_else(|| format!("the type '{kind}' is not supported"))?;
        let text = self.input.bytes.get(node.text.clone()).unwrap_or_default();
        let stream = match node.attribute("format").unwrap_or("ascii") {
            "ascii" => return Ok((Numbers::Text(text), Dtype::Text)),
            "binary" => Stream::Base64(text),
            "appended" => self.appended_stream(node)?,
            other => return Err(format!("the format '{other}' is not supported")),
        };
        let bytes = self.encoding.read(stream, &self.input.memory)?;
        if bytes.len() % number.size() != 0 {
            return Err("the bytes are not a whole number of values; the file is damaged".into());
        }
        Ok((Numbers::Binary { bytes, number }, number.dtype()))
    }

    fn appended_stream(&self, node: &Node) -> Result<Stream<'a>, String> {
        let appended = self
            .appended
            .as_ref()
            .ok_or("there is no <AppendedData>; the file is cut short")?;
        let offset = node.attribute("offset");
        let bytes = offset
            .and_then(|text| text.trim().parse::<usize>().ok())
            .and_then(|offset| appended.range.start.checked_add(offset))
            .and_then(|start| self.input.bytes.get(start..appended.range.end))
            .ok_or("its offset lies beyond the end of the file; the file is cut short")?;
        Ok(match appended.base64 {
            true => Stream::Base64(bytes),
            false => Stream::Raw(bytes),
        })
    }
}
