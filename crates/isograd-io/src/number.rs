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

/// How a file stored the coordinates (all are handed out as `f64`).
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
    /// Its name as reports show it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Integer => "integer",
            Self::Text => "text",
        }
    }
}

impl Number {
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
    pub fn read_all(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        bytes
            .chunks_exact(self.size())
            .filter_map(|chunk| self.read(chunk, endian))
            .collect()
    }
}

/// The first `N` bytes, turned to little-endian order.
#[inline(always)]
fn take<const N: usize>(bytes: &[u8], endian: Endian) -> Option<[u8; N]> {
    let mut taken = *bytes.first_chunk::<N>()?;
    if endian == Endian::Big {
        taken.reverse();
    }
    Some(taken)
}

/// `value` as a whole number in `0..limit`, or `None`.
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
