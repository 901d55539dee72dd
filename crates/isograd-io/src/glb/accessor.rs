//! Numbers of a GLB: accessors into views of the buffers.

use super::buffers::Buffers;
use super::document::{Accessor, Document};
use crate::error::{Error, Location};
use crate::number::{Endian, Number};
use crate::source::Input;

/// Vectors of numbers in a buffer.
pub(super) struct Vectors<'a> {
    /// Index of the accessor.
    pub index: usize,
    /// Number of vectors.
    pub count: usize,
    bytes: &'a [u8],
    stride: usize,
    number: Number,
    /// Divisor of whole numbers that stand for fractions.
    divisor: f64,
}

impl Vectors<'_> {
    /// Component `component` of vector `index`.
    pub fn get(&self, index: usize, component: usize) -> f64 {
        let at = index * self.stride + component * self.number.size();
        // The range was checked when the accessor was opened.
        let value = self
            .number
            .read(&self.bytes[at..], Endian::Little)
            .unwrap_or_default();
        match self.divisor == 1.0 {
            true => value,
            false => (value / self.divisor).max(-1.0),
        }
    }

    /// The first three components of vector `index`.
    pub fn vector(&self, index: usize) -> [f64; 3] {
        [0, 1, 2].map(|component| self.get(index, component))
    }

    /// Where vector `index` is, for messages.
    pub fn location(&self, index: usize) -> Location {
        let name = name(self.index);
        Location::Row { name, index }
    }
}

fn name(index: usize) -> String {
    format!("accessor {index}")
}

/// Opens accessor `index`, whose type must be one of `shapes`. Nothing is allocated.
pub(super) fn open<'a>(
    input: &Input,
    (document, buffers): (&Document, &'a Buffers<'_>),
    index: usize,
    shapes: &[(&str, usize)],
) -> Result<Vectors<'a>, Error> {
    let found = document.accessors.get(index).ok_or_else(|| {
        let count = document.accessors.len();
        format!("there are only {count} accessors; the file is damaged")
    });
    found
        .and_then(|accessor| resolve(document, buffers, accessor, index, shapes))
        .map_err(|problem| input.error(Location::Array(name(index)), problem))
}

fn resolve<'a>(
    document: &Document,
    buffers: &'a Buffers<'_>,
    accessor: &Accessor,
    index: usize,
    shapes: &[(&str, usize)],
) -> Result<Vectors<'a>, String> {
    let kind = &accessor.shape;
    let components = shapes
        .iter()
        .find(|(name, _)| name == kind)
        .map(|(_, n)| *n);
    let components = components.ok_or_else(|| {
        let names: Vec<&str> = shapes.iter().map(|(name, _)| *name).collect();
        format!("its type is '{kind}', not {}", names.join(" or "))
    })?;
    let (number, largest) = match accessor.component_type {
        5120 => (Number::I8, 127.0),
        5121 => (Number::U8, 255.0),
        5122 => (Number::I16, 32767.0),
        5123 => (Number::U16, 65535.0),
        5125 => (Number::U32, 1.0),
        5126 => (Number::F32, 1.0),
        other => return Err(format!("its component type {other} is unknown")),
    };
    let (Some(view), None) = (accessor.buffer_view, accessor.sparse) else {
        return Err("its values are sparse or compressed; save the file without that".into());
    };
    const DAMAGED: &str = "it reaches beyond the end of its data; the file is cut short or damaged";
    let view = document
        .buffer_views
        .get(view)
        .ok_or("its buffer view is missing; the file is damaged")?;
    let Some(Some(buffer)) = buffers.get(view.buffer) else {
        return Err("its values are in another file; save all in one .glb".into());
    };
    let end = view.byte_offset.checked_add(view.byte_length);
    let bytes = end
        .and_then(|end| buffer.get(view.byte_offset..end))
        .ok_or(DAMAGED)?;
    let bytes = bytes.get(accessor.byte_offset..).ok_or(DAMAGED)?;
    let size = components * number.size();
    let stride = view.byte_stride.unwrap_or(size).max(size);
    let needed = match accessor.count {
        0 => Some(0),
        count => stride
            .checked_mul(count - 1)
            .and_then(|n| n.checked_add(size)),
    };
    if needed.is_none_or(|needed| needed > bytes.len()) {
        return Err(DAMAGED.into());
    }
    Ok(Vectors {
        index,
        count: accessor.count,
        bytes,
        stride,
        number,
        divisor: if accessor.normalized { largest } else { 1.0 },
    })
}
