//! The bytes of a file with its name, and the lines in them.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Place};

/// The whole content of a file, and the name that errors show.
///
/// What a reader allocates is bounded by a small multiple of `bytes.len()`, whatever a header says.
#[derive(Clone, Debug)]
pub struct Source {
    /// The name that errors show.
    pub name: String,
    /// The whole content.
    pub bytes: Vec<u8>,
}

impl Source {
    /// Reads a whole file; `-` is standard input.
    ///
    /// # Errors
    /// A file that can't be read, a folder, and a file without a byte in it.
    pub fn open(path: &Path) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Self::read("standard input".into(), io::stdin().lock());
        }
        let name = path.display().to_string();
        if path.is_dir() {
            return Err(Error::Folder { file: name });
        }
        match File::open(path) {
            Ok(file) => Self::read(name, file),
            Err(source) => Err(Error::Read { file: name, source }),
        }
    }

    fn read(name: String, mut reader: impl Read) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        match reader.read_to_end(&mut bytes) {
            Ok(0) => Err(Error::Empty { file: name }),
            Ok(_) => Ok(Self { name, bytes }),
            Err(source) => Err(Error::Read { file: name, source }),
        }
    }

    /// An error at a place in this file.
    pub(crate) fn error(&self, place: Place, problem: impl Into<String>) -> Error {
        Error::Content {
            file: self.name.clone(),
            place,
            problem: problem.into(),
        }
    }
}

/// The lines of a text, numbered from 1, without their ends and outer white space.
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    /// Where the next line begins.
    pub offset: usize,
    /// Number of the line given last.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self {
            text,
            offset: 0,
            number: 0,
        }
    }

    /// Lines from byte `offset` on, the first of which follows line `number`.
    pub fn from(text: &'a [u8], offset: usize, number: usize) -> Self {
        Self {
            text,
            offset: offset.min(text.len()),
            number,
        }
    }

    /// The next line that is not blank.
    pub fn next_filled(&mut self) -> Option<(usize, &'a [u8])> {
        self.find(|(_, line)| !line.is_empty())
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.offset >= self.text.len() {
            return None;
        }
        let rest = &self.text[self.offset..];
        let length = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
        self.offset += length + 1;
        self.number += 1;
        Some((self.number, rest[..length].trim_ascii()))
    }
}

/// The words of a line, parted by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// A number in decimal text; `nan` and `inf` count as numbers.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word as it can be shown in a message: cut short, without control characters.
pub(crate) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)])
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .take(LONGEST)
        .collect();
    format!("'{text}'")
}
