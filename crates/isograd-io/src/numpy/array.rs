//! One array in NumPy's own format (`.npy`, versions 1 to 3).

use std::io::{self, Write};

use isograd::Real;

use crate::bytes::{scalar_name, write_reals};
use crate::number::{Dtype, Endian, Number};

/// First bytes of an array file.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// End of the message for a number type that is not supported.
pub(super) const UNSUPPORTED: &str = "is not supported; save it as float32 or float64";

/// An array of numbers in C order.
#[derive(Debug)]
pub(super) struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
    pub dtype: Dtype,
}

/// An error and its byte offset in the array's file.
#[derive(Debug)]
pub(super) struct ArrayError {
    pub byte: usize,
    pub problem: String,
}

struct Header {
    number: Number,
    endian: Endian,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl Array {
    /// Parses an array file.
    pub fn parse(bytes: &[u8]) -> Result<Self, ArrayError> {
        let error = |byte, problem: &str| ArrayError {
            byte,
            problem: problem.into(),
        };
        let cut_short = || error(bytes.len(), "the header is cut short");
        if !bytes.starts_with(MAGIC) {
            return Err(error(0, "not a NumPy array: the first bytes are wrong"));
        }
        // The length of the header takes 2 bytes in version 1, 4 bytes later.
        let start = match bytes.get(6) {
            Some(1) => 10,
            Some(2 | 3) => 12,
            _ => return Err(error(6, "unknown version of the array format")),
        };
        let length = bytes.get(8..start).ok_or_else(cut_short)?;
        let length = length.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b));
        let end = start + length;
        let text = bytes.get(start..end).ok_or_else(cut_short)?;
        let header = Header::parse(text).map_err(|problem| error(start, &problem))?;
        let array = header.read(&bytes[end..]);
        array.map_err(|problem| error(end, &problem))
    }

    /// The rows of an `(N, 3)` array.
    pub fn rows_of_three(&self) -> Option<Vec<[f64; 3]>> {
        matches!(self.shape[..], [_, 3]).then(|| self.values.as_chunks().0.to_vec())
    }
}

impl Header {
    /// Parses a Python dictionary such as
    /// `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
    fn parse(text: &[u8]) -> Result<Self, String> {
        let text = String::from_utf8_lossy(text);
        let value = |key: &str| {
            let after = text.split_once(&format!("'{key}'"))?.1;
            Some(after.trim_start().strip_prefix(':')?.trim_start())
        };
        let damaged = || "the header is damaged".to_string();
        let descr = value("descr").ok_or_else(damaged)?;
        if descr.starts_with('[') {
            return Err("an array of records; save the columns as plain numbers".into());
        }
        let name = descr.split('\'').nth(1).ok_or_else(damaged)?;
        let (number, endian) =
            parse_type(name).ok_or_else(|| format!("the type '{name}' {UNSUPPORTED}"))?;
        let order = value("fortran_order").ok_or_else(damaged)?;
        let shape = value("shape")
            .and_then(|s| s.strip_prefix('(')?.split_once(')'))
            .ok_or_else(damaged)?
            .0;
        let shape = shape
            .split(',')
            .map(str::trim)
            .filter(|n| !n.is_empty())
            .map(|n| n.trim_end_matches('L').parse().map_err(|_| damaged()))
            .collect::<Result<Vec<usize>, _>>()?;
        if shape.len() > 8 {
            return Err("the array has more than 8 axes".into());
        }
        Ok(Self {
            number,
            endian,
            fortran_order: order.starts_with("True"),
            shape,
        })
    }

    /// Reads the values; the shape is checked against the size of `data` first.
    fn read(self, data: &[u8]) -> Result<Array, String> {
        let count = self.shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
        let needed = count.and_then(|n| n.checked_mul(self.number.size()));
        let needed = needed.filter(|&n| n <= data.len()).ok_or_else(|| {
            format!(
                "the header declares the shape {:?} with {} bytes per value, but only {} bytes follow; the file is cut short or the header is wrong",
                self.shape,
                self.number.size(),
                data.len()
            )
        })?;
        let values = self.number.read_all(&data[..needed], self.endian);
        Ok(Array {
            values: if self.fortran_order {
                to_c_order(&values, &self.shape)
            } else {
                values
            },
            shape: self.shape,
            dtype: self.number.dtype(),
        })
    }
}

fn parse_type(name: &str) -> Option<(Number, Endian)> {
    let (endian, kind) = match name.split_at_checked(1)? {
        (">", kind) => (Endian::Big, kind),
        ("<" | "|" | "=", kind) => (Endian::Little, kind),
        _ => return None,
    };
    Some((Number::from_numpy(kind)?, endian))
}

/// Reorders values from Fortran order (first axis fastest) to C order (last axis fastest).
fn to_c_order(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    let mut ordered = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        let from = (0..shape.len())
            .rev()
            .fold(0, |from, axis| from * shape[axis] + index[axis]);
        ordered.push(values[from]);
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    ordered
}

/// Writes an array of `shape` in the type of its values.
pub(super) fn write<T: Real>(
    out: &mut impl Write,
    shape: &[usize],
    values: &[T],
) -> io::Result<()> {
    let descr = scalar_name::<T>(["<f4", "<f8"]);
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!(
        "{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}",
        shape.trim_end()
    );
    // The data begin at a multiple of 64 bytes.
    let padding = (64 - (10 + header.len() + 1) % 64) % 64;
    header.push_str(&" ".repeat(padding));
    header.push('\n');
    out.write_all(MAGIC)?;
    out.write_all(&[1, 0])?;
    out.write_all(&(header.len() as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    write_reals(out, values.iter().copied())
}
