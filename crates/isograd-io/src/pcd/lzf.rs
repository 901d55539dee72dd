//! Decompression of LZF.
//!
//! The crate `lzf` is deprecated, and allocates what the header declares.

/// Largest number of bytes that one byte of compressed data can become.
pub(super) const LARGEST_RATIO: usize = 88;

/// Decompresses `packed`, which must fill `out` exactly. An error is the problem.
pub(super) fn decompress(packed: &[u8], out: &mut [u8]) -> Result<(), &'static str> {
    const SHORT: &str = "the compressed data end early; the file is cut short or damaged";
    let (mut at, mut end) = (0, 0);
    let next = |at: &mut usize| {
        *at += 1;
        packed.get(*at - 1).map(|&byte| usize::from(byte))
    };
    while at < packed.len() {
        let control = next(&mut at).ok_or(SHORT)?;
        if control < 32 {
            let bytes = packed.get(at..at + control + 1).ok_or(SHORT)?;
            let room = out.get_mut(end..end + bytes.len()).ok_or(WRONG)?;
            room.copy_from_slice(bytes);
            (at, end) = (at + bytes.len(), end + bytes.len());
            continue;
        }
        let mut length = (control >> 5) + 2;
        if length == 9 {
            length += next(&mut at).ok_or(SHORT)?;
        }
        let back = ((control & 31) << 8) + next(&mut at).ok_or(SHORT)? + 1;
        if back > end || length > out.len() - end {
            return Err(WRONG);
        }
        // Byte by byte: the two ranges may overlap.
        for to in end..end + length {
            out[to] = out[to - back];
        }
        end += length;
    }
    if end == out.len() { Ok(()) } else { Err(SHORT) }
}

const WRONG: &str = "the compressed data are damaged; write the file again";

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &[u8], length: usize) -> Result<Vec<u8>, &'static str> {
        let mut out = vec![0; length];
        decompress(packed, &mut out).map(|()| out)
    }

    #[test]
    fn literals_and_references_give_back_the_bytes() {
        assert_eq!(unpacked(&[2, b'a', b'b', b'c'], 3), Ok(b"abc".to_vec()));
        // Three bytes back, length 5: the copy overlaps itself.
        assert_eq!(
            unpacked(&[2, 1, 2, 3, 3 << 5, 2], 8),
            Ok(vec![1, 2, 3, 1, 2, 3, 1, 2])
        );
        // A long reference: the largest ratio.
        let long = unpacked(&[0, 9, 7 << 5, 255, 0], 265).expect("valid");
        assert_eq!(long, [9; 265]);
        const { assert!(264 <= 3 * LARGEST_RATIO) };
    }

    #[test]
    fn damaged_data_are_refused() {
        for (packed, length) in [
            (&[5, 1, 2][..], 6),
            (&[0, 1, 1 << 5, 1], 4),
            (&[0, 1, 7 << 5], 300),
            (&[0, 1, 7 << 5, 255, 0], 200),
            (&[2, 1, 2, 3], 4),
            (&[2, 1, 2, 3], 2),
            (&[1 << 5], 3),
        ] {
            assert!(unpacked(packed, length).is_err(), "{packed:?}");
        }
    }
}
