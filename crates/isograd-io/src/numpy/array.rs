//! One array in NumPy's own format (`.npy`, versions 1 to 3).

use std::io::{self, Read, Write};

use isograd::Real;

use crate::bytes::{scalar_name, write_reals};
use crate::number::{Dtype, Endian, Number};

/// First bytes of an array file.
const MAGIC: &[u8] = b"\x93NUMPY";

/// Largest header; NumPy's own limit is 10,000 bytes.
const MAX_HEADER: usize = 1 << 16;

/// Header of an array.
#[derive(Debug)]
pub(super) struct Header {
    pub shape: Vec<usize>,
    number: Number,
    endian: Endian,
    fortran_order: bool,
    /// Number of bytes before the values.
    bytes: usize,
}

/// An error and its byte offset in the array's file.
#[derive(Debug)]
pub(super) struct ArrayError {
    pub byte: usize,
    pub problem: String,
    /// Whether the data are no array, or one of another type than numbers.
    pub is_other: bool,
}

impl ArrayError {
    pub(super) fn new(byte: usize, problem: impl Into<String>) -> Self {
        Self {
            byte,
            problem: problem.into(),
            is_other: false,
        }
    }

    fn other(byte: usize, problem: impl Into<String>) -> Self {
        Self {
            is_other: true,
            ..Self::new(byte, problem)
        }
    }
}

impl Header {
    /// Reads the header from the beginning of an array's file.
    pub fn read(data: &mut impl Read) -> Result<Self, ArrayError> {
        let mut begin = [0; 12];
        let cut_short = |e: io::Error| match e.kind() {
            io::ErrorKind::UnexpectedEof => ArrayError::new(0, "the header is cut short"),
            _ => ArrayError::new(0, format!("the array is damaged: {e}; write it again")),
        };
        let no_array = || ArrayError::other(0, "not a NumPy array: the first bytes are wrong");
        match data.read_exact(&mut begin[..MAGIC.len()]) {
            Ok(()) if begin.starts_with(MAGIC) => {}
            Err(e) if e.kind() != io::ErrorKind::UnexpectedEof => return Err(cut_short(e)),
            _ => return Err(no_array()),
        }
        data.read_exact(&mut begin[6..10]).map_err(cut_short)?;
        // The length of the header takes 2 bytes in version 1, 4 bytes later.
        let start = match begin[6] {
            1 => 10,
            2 | 3 => 12,
            _ => return Err(ArrayError::new(6, "unknown version of the array format")),
        };
        data.read_exact(&mut begin[10..start]).map_err(cut_short)?;
        let length = begin[8..start].iter().rev();
        let length = length.fold(0, |n, &b| n << 8 | usize::from(b));
        if length > MAX_HEADER {
            let problem = format!("a header of {length} bytes, more than {MAX_HEADER}");
            return Err(ArrayError::new(8, problem));
        }
        let mut text = vec![0; length];
        data.read_exact(&mut text).map_err(cut_short)?;
        let mut header = Self::parse(&text, start)?;
        header.bytes = start + length;
        Ok(header)
    }

    /// Parses a Python dictionary such as
    /// `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`, which begins at byte `start`.
    fn parse(text: &[u8], start: usize) -> Result<Self, ArrayError> {
        let text = String::from_utf8_lossy(text);
        let value = |key: &str| {
            let after = text.split_once(&format!("'{key}'"))?.1;
            Some(after.trim_start().strip_prefix(':')?.trim_start())
        };
        let damaged = || ArrayError::new(start, "the header is damaged");
        let other = |problem: &str| ArrayError::other(start, problem);
        let descr = value("descr").ok_or_else(damaged)?;
        if descr.starts_with('[') {
            return Err(other(
                "an array of records; save the columns as plain numbers",
            ));
        }
        let name = descr.split('\'').nth(1).ok_or_else(damaged)?;
        let (number, endian) = parse_type(name).ok_or_else(|| {
            let problem = "is not supported; save it as float32 or float64";
            other(&format!("the type '{name}' {problem}"))
        })?;
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
            return Err(other("the array has more than 8 axes"));
        }
        Ok(Self {
            shape,
            number,
            endian,
            fortran_order: order.starts_with("True"),
            bytes: 0,
        })
    }

    pub fn dtype(&self) -> Dtype {
        self.number.dtype()
    }

    /// Number of values, checked against the `size` of the array's file in bytes.
    pub fn count(&self, size: u64) -> Result<usize, ArrayError> {
        let count = self.shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
        let available = size.saturating_sub(self.bytes as u64);
        let fits = |&n: &usize| {
            n.checked_mul(self.number.size())
                .is_some_and(|needed| needed as u64 <= available)
        };
        count.filter(fits).ok_or_else(|| {
            ArrayError::new(
                self.bytes,
                format!(
                    "the header declares the shape {:?} with {} bytes per value, but only {available} bytes follow; the file is cut short or the header is wrong",
                    self.shape,
                    self.number.size()
                ),
            )
        })
    }

    /// Reads the values behind the header into `values`, in C order (last axis fastest).
    pub fn values(&self, data: &mut impl Read, values: &mut [f64]) -> Result<(), ArrayError> {
        let mut buffer = [0; 8192];
        let mut place = Place::new(self);
        let size = self.number.size();
        let mut left = values.len();
        while left > 0 {
            let count = left.min(buffer.len() / size);
            let bytes = &mut buffer[..count * size];
            data.read_exact(bytes).map_err(|e| {
                ArrayError::new(
                    self.bytes,
                    format!("the array is damaged: {e}; write it again"),
                )
            })?;
            for value in self.number.read_all(bytes, self.endian) {
                values[place.at] = value;
                place.advance();
            }
            left -= count;
        }
        Ok(())
    }
}

/// Place in C order of the values of a file, one after another.
struct Place<'a> {
    at: usize,
    /// Empty in C order.
    shape: &'a [usize],
    index: [usize; 8],
    strides: [usize; 8],
}

impl<'a> Place<'a> {
    fn new(header: &'a Header) -> Self {
        let shape = match header.fortran_order {
            true => header.shape.as_slice(),
            false => &[],
        };
        let mut strides = [1usize; 8];
        for axis in (1..shape.len()).rev() {
            strides[axis - 1] = strides[axis].saturating_mul(shape[axis]);
        }
        Self {
            at: 0,
            shape,
            index: [0; 8],
            strides,
        }
    }

    /// Moves to the next value: along the first axis first in Fortran order.
    #[inline]
    fn advance(&mut self) {
        if self.shape.is_empty() {
            self.at += 1;
            return;
        }
        for (axis, &length) in self.shape.iter().enumerate() {
            self.index[axis] += 1;
            self.at += self.strides[axis];
            if self.index[axis] < length {
                return;
            }
            self.at -= length * self.strides[axis];
            self.index[axis] = 0;
        }
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
