//! Morton codes: the bits of three coordinates in turn.

use cubecl::prelude::*;

/// The lowest ten bits, each followed by two zeros.
#[cube]
pub(crate) fn spread_bits(bits: u32) -> u32 {
    let mut x = bits & 1023u32;
    x = (x | (x << 16u32)) & 0x0300_00ffu32;
    x = (x | (x << 8u32)) & 0x0300_f00fu32;
    x = (x | (x << 4u32)) & 0x030c_30c3u32;
    (x | (x << 2u32)) & 0x0924_9249u32
}
