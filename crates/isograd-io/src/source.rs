//! The bytes and the name of a file.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Location};
use crate::limits::{Limits, Memory, exceeded};
use crate::options::ReadOptions;

/// The whole content of a file, and its name in errors.
///
/// Readers allocate no more than [`Limits`] allow, whatever the file declares or unpacks to.
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
        Self::open_within(path, &Limits::default())
    }

    /// Like [`Self::open`]; refuses a file that is larger than the memory of `limits`.
    pub(crate) fn open_within(path: &Path, limits: &Limits) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Self::read("standard input".into(), io::stdin().lock(), limits);
        }
        let name = path.display().to_string();
        if path.is_dir() {
            return Err(Error::Folder { file: name });
        }
        match File::open(path) {
            Ok(file) => Self::read(name, file, limits),
            Err(source) => Err(Error::Read { file: name, source }),
        }
    }

    fn read(name: String, mut reader: impl Read, limits: &Limits) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        let read = match limits.memory {
            // A file knows its size, and its bytes are read into a block of that size.
            None => reader.read_to_end(&mut bytes),
            Some(limit) => reader.take(limit.saturating_add(1)).read_to_end(&mut bytes),
        };
        match read {
            Ok(0) => Err(Error::Empty { file: name }),
            Ok(size) if limits.memory.is_some_and(|limit| size as u64 > limit) => {
                Err(Error::Content {
                    file: name,
                    location: Location::Whole,
                    problem: exceeded(size as u64, limits.memory_for(size)),
                })
            }
            Ok(_) => Ok(Self { name, bytes }),
            Err(source) => Err(Error::Read { file: name, source }),
        }
    }
}

/// A source as readers see it: with options, and with the memory that is left.
#[derive(Debug)]
pub(crate) struct Input<'a> {
    pub name: &'a str,
    pub bytes: &'a [u8],
    pub options: &'a ReadOptions,
    pub memory: Memory,
}

impl<'a> Input<'a> {
    pub fn new(source: &'a Source, options: &'a ReadOptions) -> Self {
        Self {
            name: &source.name,
            bytes: &source.bytes,
            options,
            memory: Memory::new(&options.limits, source.bytes.len()),
        }
    }

    /// An error at a location in this file.
    pub fn error(&self, location: Location, problem: impl Into<String>) -> Error {
        Error::Content {
            file: self.name.into(),
            location,
            problem: problem.into(),
        }
    }

    /// Refuses rows of the array `name` that are not finite, unless they are to be kept.
    pub fn check_rows(&self, name: &str, what: &str, rows: &[[f64; 3]]) -> Result<(), Error> {
        rows.iter().enumerate().try_for_each(|(index, &row)| {
            self.options.not_finite.check(what, row).map_err(|problem| {
                let name = name.into();
                self.error(Location::Row { name, index }, problem)
            })
        })
    }
}
