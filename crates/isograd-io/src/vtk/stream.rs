//! Bytes of an array: raw or base64, compressed by zlib or not.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::limits::Memory;
use crate::number::{Endian, Number, as_index};

/// Error of truncated data.
pub(super) const CUT: &str = "the data are cut short";

/// Encoding of the binary arrays of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding {
    pub endian: Endian,
    /// Type of the lengths before the data.
    pub header: Number,
    pub compressed: bool,
    /// Size of the file, which no length in it exceeds.
    pub file_size: usize,
}

impl Encoding {
    /// Reads the bytes of an array. All that is unpacked counts as memory for good, so that the limit bounds the work
    /// too where arrays share their data.
    pub fn read<'a>(&self, stream: Stream<'a>, memory: &Memory) -> Result<Cow<'a, [u8]>, String> {
        match self.compressed {
            true => self.unpack(stream, memory).map(Cow::Owned),
            false => self.plain(stream, memory),
        }
    }

    /// Reads `length, data`.
    fn plain<'a>(&self, mut stream: Stream<'a>, memory: &Memory) -> Result<Cow<'a, [u8]>, String> {
        let header = self.header.size();
        let length = self.word(&stream.peek(header, memory)?)?;
        if stream.is_raw() || stream.is_padded_after(header, memory)? {
            stream.take(header, memory)?;
            return stream.take(length, memory);
        }
        let total = length.checked_add(header).ok_or(CUT)?;
        let mut bytes = stream.take(total, memory)?.into_owned();
        bytes.drain(..header);
        Ok(Cow::Owned(bytes))
    }

    /// Reads `blocks, block size, last block size, compressed sizes…`, then the blocks.
    fn unpack(&self, mut stream: Stream, memory: &Memory) -> Result<Vec<u8>, String> {
        let word = self.header.size();
        let blocks = self.word(&stream.peek(word, memory)?)?;
        let header = blocks
            .checked_add(3)
            .and_then(|n| n.checked_mul(word))
            .ok_or(CUT)?;
        let sizes = stream.take(header, memory)?;
        // Raw data are not copied; where arrays share them, they count all the same.
        memory.reserve(sizes.len())?;
        let sizes = sizes[3 * word..].chunks_exact(word);
        let mut total = 0usize;
        for size in sizes.clone() {
            total = total.checked_add(self.word(size)?).ok_or(CUT)?;
        }
        let packed = stream.take(total, memory)?;
        memory.reserve(packed.len())?;
        let mut rest = &packed[..];
        let mut bytes = Vec::new();
        for size in sizes {
            let (block, after) = rest.split_at(self.word(size)?);
            inflate(block, &mut bytes, memory)?;
            rest = after;
        }
        Ok(bytes)
    }

    /// Parses a word of a binary header: a count that does not exceed the size of the file.
    fn word(&self, bytes: &[u8]) -> Result<usize, String> {
        let value = self.header.read(bytes, self.endian).ok_or(CUT)?;
        as_index(value, self.file_size)
            .ok_or_else(|| format!("a length of {value} bytes exceeds the file; it is damaged"))
    }
}

/// Appends the unpacked bytes of a block.
fn inflate(block: &[u8], bytes: &mut Vec<u8>, memory: &Memory) -> Result<(), String> {
    let mut decoder = ZlibDecoder::new(block);
    let mut buffer = [0; 1 << 14];
    loop {
        let count = decoder
            .read(&mut buffer)
            .map_err(|e| format!("a compressed block is damaged: {e}"))?;
        if count == 0 {
            return Ok(());
        }
        memory.make_room(bytes, count)?;
        bytes.extend_from_slice(&buffer[..count]);
    }
}

/// Encoded bytes: raw, or base64 with white space anywhere.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stream<'a> {
    Raw(&'a [u8]),
    Base64(&'a [u8]),
}

impl<'a> Stream<'a> {
    /// Reads the next `n` bytes, which are encoded on their own.
    fn take(&mut self, n: usize, memory: &Memory) -> Result<Cow<'a, [u8]>, String> {
        match self {
            Self::Raw(rest) => {
                let (bytes, after) = rest.split_at_checked(n).ok_or(CUT)?;
                *rest = after;
                Ok(Cow::Borrowed(bytes))
            }
            Self::Base64(text) => {
                let (letters, after) = letters(text, encoded_length(n), memory)?;
                memory.reserve(letters.len())?;
                let mut bytes = STANDARD
                    .decode(letters)
                    .map_err(|e| format!("broken base64: {e}"))?;
                if bytes.len() < n {
                    return Err(CUT.into());
                }
                bytes.truncate(n);
                *text = after;
                Ok(Cow::Owned(bytes))
            }
        }
    }

    fn peek(mut self, n: usize, memory: &Memory) -> Result<Cow<'a, [u8]>, String> {
        self.take(n, memory)
    }

    fn is_raw(&self) -> bool {
        matches!(self, Self::Raw(_))
    }

    /// Whether the next `n` bytes of base64 end in padding, so that a new stream follows them.
    fn is_padded_after(&self, n: usize, memory: &Memory) -> Result<bool, String> {
        let Self::Base64(text) = self else {
            return Ok(false);
        };
        let (letters, _) = letters(text, encoded_length(n), memory)?;
        // One byte of three leaves two letters of padding, two bytes leave one.
        let padding = (3 - n % 3) % 3;
        Ok(padding > 0
            && letters[letters.len() - padding..]
                .iter()
                .all(|&b| b == b'='))
    }
}

/// The next `count` letters, and what follows them.
fn letters<'a>(
    text: &'a [u8],
    count: usize,
    memory: &Memory,
) -> Result<(Cow<'a, [u8]>, &'a [u8]), String> {
    let (head, after) = text.split_at_checked(count).ok_or(CUT)?;
    if !head.iter().any(u8::is_ascii_whitespace) {
        return Ok((Cow::Borrowed(head), after));
    }
    let mut letters = memory.with_capacity(count)?;
    for (at, &letter) in text.iter().enumerate() {
        if letters.len() == count {
            return Ok((Cow::Owned(letters), &text[at..]));
        }
        if !letter.is_ascii_whitespace() {
            letters.push(letter);
        } else if at % 64 == 0 {
            // White space is work as well; lines of letters are free.
            memory.reserve(64)?;
        }
    }
    match letters.len() == count {
        true => Ok((Cow::Owned(letters), &[])),
        false => Err(CUT.into()),
    }
}

/// Letters of base64 for `n` bytes, padding included.
fn encoded_length(n: usize) -> usize {
    n.div_ceil(3).saturating_mul(4)
}
