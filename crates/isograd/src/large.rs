//! Clouds so large that memory matters more than the time to take it.

/// Samples up to which scratch memory is kept, for the next stage or the next call. Where none is kept, large clouds need
/// two thirds of the memory, and half of it with the pullback; taking it again costs about a twentieth of the time of a second
/// call, and none of the first.
///
/// Unit tests have clouds on both sides of a smaller number.
const MOST: usize = if cfg!(test) { 3000 } else { 1 << 20 };

/// Whether scratch memory for a cloud of this size is freed as soon as it has been used.
pub(crate) fn is_large(samples: usize) -> bool {
    samples > MOST
}
