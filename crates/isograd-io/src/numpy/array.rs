//! One array in NumPy's own format (`.npy`, versions 1 to 3).

use std::io::{self, Write};

use isograd::Real;

use crate::bytes::{push_real, scalar_name};
use crate::number::{Dtype, Endian, Number};

/// An array of numbers, in C order whatever order the file had.
#[derive(Debug)]
pub(super) struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
    pub dtype: Dtype,
}

/// What is wrong, and at which byte of the array's file.
#[derive(Debug)]
pub(super) struct Bad {
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
    /// Reads the array that fills `bytes`.
    pub fn parse(bytes: &[u8]) -> Result<Self, Bad> {
        let bad = |byte, problem: &str| Bad {
            byte,
            problem: problem.into(),
        };
        let cut = || bad(bytes.len(), "the header is cut short");
        if !bytes.starts_with(b"\x93NUMPY") {
            return Err(bad(0, "no NumPy array: the first bytes are not its mark"));
        }
        let (start, length) = match bytes.get(6) {
            Some(1) => (
                10,
                bytes
                    .get(8..10)
                    .map(|b| usize::from(b[0]) | usize::from(b[1]) << 8),
            ),
            Some(2 | 3) => {
                let word = bytes.get(8..).and_then(|b| b.first_chunk::<4>());
                (12, word.map(|b| u32::from_le_bytes(*b) as usize))
            }
            _ => return Err(bad(6, "a version of the array format that is not known")),
        };
        let end = start + length.ok_or_else(cut)?;
        let text = bytes.get(start..end).ok_or_else(cut)?;
        let header = Header::parse(text).map_err(|problem| Bad {
            byte: start,
            problem,
        })?;
        header
            .read(&bytes[end..])
            .map_err(|problem| Bad { byte: end, problem })
    }

    /// The rows of an `(N, 3)` array.
    pub fn rows_of_three(&self) -> Option<Vec<[f64; 3]>> {
        (self.shape.len() == 2 && self.shape[1] == 3).then(|| {
            let rows = self.values.chunks_exact(3);
            rows.map(|row| [row[0], row[1], row[2]]).collect()
        })
    }
}

impl Header {
    /// The header is a Python dictionary such as
    /// `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
    fn parse(text: &[u8]) -> Result<Self, String> {
        let text = String::from_utf8_lossy(text);
        let value = |key: &str| {
            let after = text.split_once(&format!("'{key}'"))?.1;
            Some(after.trim_start().strip_prefix(':')?.trim_start())
        };
        let damaged = || "the header is damaged".to_string();
        let descr = value("descr").ok_or_else(damaged)?;
        let (number, endian) = if descr.starts_with('[') {
            return Err("an array of records; save the columns as plain numbers".into());
        } else {
            let name = descr.split('\'').nth(1).ok_or_else(damaged)?;
            parse_type(name).ok_or_else(|| {
                format!("the type '{name}' is not read; save it as float32 or float64")
            })?
        };
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

    /// The values, after the shape has been checked against the bytes that are there.
    fn read(self, data: &[u8]) -> Result<Array, String> {
        let count = self.shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
        let needed = count.and_then(|n| n.checked_mul(self.number.size()));
        let needed = needed.filter(|&n| n <= data.len()).ok_or_else(|| {
            format!(
                "the header promises the shape {:?} of {} bytes each, but only {} bytes follow; the file is cut short or the header is wrong",
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
    let number = match kind {
        "f4" => Number::F32,
        "f8" => Number::F64,
        "i1" => Number::I8,
        "u1" | "b1" => Number::U8,
        "i2" => Number::I16,
        "u2" => Number::U16,
        "i4" => Number::I32,
        "u4" => Number::U32,
        "i8" => Number::I64,
        "u8" => Number::U64,
        _ => return None,
    };
    Some((number, endian))
}

/// Values with the first axis fastest, turned to the last axis fastest.
fn to_c_order(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    let mut turned = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        let place = (0..shape.len())
            .rev()
            .fold(0, |place, axis| place * shape[axis] + index[axis]);
        turned.push(values[place]);
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    turned
}

/// Writes an array of `shape` with the type of its values.
pub(super) fn write<T: Real>(out: &mut dyn Write, shape: &[usize], values: &[T]) -> io::Result<()> {
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
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(header.len() as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    let mut buffer = Vec::new();
    for chunk in values.chunks(1 << 13) {
        buffer.clear();
        for &value in chunk {
            push_real(&mut buffer, value);
        }
        out.write_all(&buffer)?;
    }
    Ok(())
}
