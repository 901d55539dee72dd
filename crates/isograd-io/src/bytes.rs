//! Numbers as little-endian bytes, in their own type.

use std::io::{self, Write};

use isograd::Real;

/// The first name for `f32`, the second for `f64`.
pub(crate) fn scalar_name<T: Real>(names: [&'static str; 2]) -> &'static str {
    names[usize::from(is_double::<T>())]
}

fn is_double<T: Real>() -> bool {
    T::NAME == f64::NAME
}

/// Size of `T` in bytes.
pub(crate) fn size<T: Real>() -> usize {
    if is_double::<T>() { 8 } else { 4 }
}

#[inline]
pub(crate) fn push_real<T: Real>(out: &mut Vec<u8>, value: T) {
    if is_double::<T>() {
        out.extend(value.f64().to_le_bytes());
    } else {
        // Exact: the value came from an f32.
        out.extend((value.f64() as f32).to_le_bytes());
    }
}

/// Writes numbers one after another.
pub(crate) fn write_reals<T: Real>(
    out: &mut impl Write,
    values: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    let mut buffer = Vec::new();
    for value in values {
        push_real(&mut buffer, value);
        if buffer.len() >= 1 << 16 {
            out.write_all(&buffer)?;
            buffer.clear();
        }
    }
    out.write_all(&buffer)
}
