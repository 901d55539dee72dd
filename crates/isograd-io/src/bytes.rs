//! Numbers as little-endian bytes, in the type that they have.

use isograd::Real;

/// The first name for `f32`, the second for `f64`.
pub(crate) fn scalar_name<T: Real>(names: [&'static str; 2]) -> &'static str {
    names[usize::from(is_double::<T>())]
}

/// Whether `T` is `f64`.
pub(crate) fn is_double<T: Real>() -> bool {
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

#[inline]
pub(crate) fn push_vector<T: Real>(out: &mut Vec<u8>, v: [T; 3]) {
    for value in v {
        push_real(out, value);
    }
}
