//! The bytes and the name of a file; lines, words and numbers of text.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Location};
use crate::geometry::check_finite;

/// The whole content of a file, and its name in errors.
///
/// Readers allocate at most a small multiple of `bytes.len()`, whatever a header declares.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name in errors.
    pub name: String,
    /// The whole content.
    pub bytes: Vec<u8>,
}

impl Source {
    /// Reads a whole file; `-` is standard input.
    ///
    /// # Errors
    /// A file that cannot be read, a folder, or an empty file.
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

    /// An error at a location in this file.
    pub(crate) fn error(&self, location: Location, problem: impl Into<String>) -> Error {
        Error::Content {
            file: self.name.clone(),
            location,
            problem: problem.into(),
        }
    }

    /// Refuses rows of the array `name` that are not finite.
    pub(crate) fn check_rows(
        &self,
        name: &str,
        what: &str,
        rows: &[[f64; 3]],
    ) -> Result<(), Error> {
        rows.iter().enumerate().try_for_each(|(index, &row)| {
            let name = name.to_string();
            check_finite(what, row)
                .map_err(|problem| self.error(Location::Row { name, index }, problem))
        })
    }
}

/// Lines of a text, numbered from 1, without line ends and surrounding white space.
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    /// Byte offset of the next line.
    pub offset: usize,
    /// Number of the last line returned.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self::from(text, 0, 0)
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

/// Words of a line, separated by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Parses a decimal number; `nan` and `inf` count as numbers.
pub(crate) fn number(word: &[u8]) -> Result<f64, String> {
    let text = std::str::from_utf8(word).ok();
    text.and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("{} is not a number", quoted(word)))
}

/// The first three numbers of a line.
pub(crate) fn three_numbers<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
) -> Result<[f64; 3], String> {
    let mut v = [0.0; 3];
    for value in &mut v {
        *value = number(words.next().ok_or("the line has fewer than 3 numbers")?)?;
    }
    Ok(v)
}

/// A word in quotes for a message: shortened, without control characters.
pub(crate) fn quoted(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)])
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .take(LONGEST)
        .collect();
    format!("'{text}'")
}
