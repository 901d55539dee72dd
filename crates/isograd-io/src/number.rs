//! The number types that binary files use.

/// A number type of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Byte order of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

/// Number type of the coordinates or values in a file (they are read as `f64`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
    /// Whole numbers.
    Integer,
    /// Decimal text.
    Text,
}

impl Dtype {
    /// Name for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Integer => "integer",
            Self::Text => "text",
        }
    }
}

/// Names of the number types in NumPy arrays, in VTK files, and (two each) in PLY files.
const NAMES: [(Number, [&str; 4]); 10] = [
    (Number::I8, ["i1", "Int8", "char", "int8"]),
    (Number::U8, ["u1", "UInt8", "uchar", "uint8"]),
    (Number::I16, ["i2", "Int16", "short", "int16"]),
    (Number::U16, ["u2", "UInt16", "ushort", "uint16"]),
    (Number::I32, ["i4", "Int32", "int", "int32"]),
    (Number::U32, ["u4", "UInt32", "uint", "uint32"]),
    (Number::I64, ["i8", "Int64", "int64", "int64"]),
    (Number::U64, ["u8", "UInt64", "uint64", "uint64"]),
    (Number::F32, ["f4", "Float32", "float", "float32"]),
    (Number::F64, ["f8", "Float64", "double", "float64"]),
];

impl Number {
    /// The type that a NumPy array calls `name`, without its byte order.
    pub fn from_numpy(name: &str) -> Option<Self> {
        Self::find(|names| names[0] == name || name == "b1" && names[0] == "u1")
    }

    /// The type that a VTK file calls `name`.
    pub fn from_vtk(name: &str) -> Option<Self> {
        Self::find(|names| names[1] == name)
    }

    /// The type that a PLY file calls `name`.
    pub fn from_ply(name: &[u8]) -> Option<Self> {
        Self::find(|names| names[2..].iter().any(|n| n.as_bytes() == name))
    }

    fn find(is_named: impl Fn(&[&str; 4]) -> bool) -> Option<Self> {
        let mut types = NAMES.iter();
        types
            .find(|(_, names)| is_named(names))
            .map(|(number, _)| *number)
    }

    /// Size in bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub fn dtype(self) -> Dtype {
        match self {
            Self::F32 => Dtype::F32,
            Self::F64 => Dtype::F64,
            _ => Dtype::Integer,
        }
    }

    /// The number at the start of `bytes`; `None` if they are too few.
    ///
    /// 64-bit integers above 2⁵³ are rounded.
    #[inline]
    pub fn read(self, bytes: &[u8], endian: Endian) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(take(bytes, endian)?)),
            Self::U8 => f64::from(u8::from_le_bytes(take(bytes, endian)?)),
            Self::I16 => f64::from(i16::from_le_bytes(take(bytes, endian)?)),
            Self::U16 => f64::from(u16::from_le_bytes(take(bytes, endian)?)),
            Self::I32 => f64::from(i32::from_le_bytes(take(bytes, endian)?)),
            Self::U32 => f64::from(u32::from_le_bytes(take(bytes, endian)?)),
            Self::I64 => i64::from_le_bytes(take(bytes, endian)?) as f64,
            Self::U64 => u64::from_le_bytes(take(bytes, endian)?) as f64,
            Self::F32 => f64::from(f32::from_le_bytes(take(bytes, endian)?)),
            Self::F64 => f64::from_le_bytes(take(bytes, endian)?),
        })
    }

    /// All the numbers in `bytes`, in order.
    pub fn read_all(self, bytes: &[u8], endian: Endian) -> impl Iterator<Item = f64> {
        bytes
            .chunks_exact(self.size())
            .filter_map(move |chunk| self.read(chunk, endian))
    }
}

/// The first `N` bytes, in little-endian order.
#[inline(always)]
fn take<const N: usize>(bytes: &[u8], endian: Endian) -> Option<[u8; N]> {
    let mut taken = *bytes.first_chunk::<N>()?;
    if endian == Endian::Big {
        taken.reverse();
    }
    Some(taken)
}

/// `value` as an integer in `0..limit`; `None` if it is not one.
pub(crate) fn as_index(value: f64, limit: usize) -> Option<usize> {
    (value >= 0.0 && value < limit as f64 && value.fract() == 0.0).then_some(value as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_read_the_same_number() {
        let little = 1234.5f32.to_le_bytes();
        let big = 1234.5f32.to_be_bytes();
        assert_eq!(Number::F32.read(&little, Endian::Little), Some(1234.5));
        assert_eq!(Number::F32.read(&big, Endian::Big), Some(1234.5));
        assert_eq!(Number::I16.read(&[0xff, 0xfe], Endian::Big), Some(-2.0));
        assert_eq!(Number::F64.read(&[0; 7], Endian::Little), None);
    }

    #[test]
    fn an_index_is_a_whole_number_below_its_limit() {
        assert_eq!(as_index(3.0, 4), Some(3));
        for bad in [4.0, -1.0, 0.5, f64::NAN, f64::INFINITY, 4294967295.0] {
            assert_eq!(as_index(bad, 4), None);
        }
    }
}
