//! Errors of readers and writers, with the location in the file.

use std::fmt;
use std::io;

/// Error of a reader or writer. The message names the file, the location in it if there is one, the
/// problem, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file cannot be opened or read.
    #[error("{file}: {source}; {}", read_remedy(source))]
    Read {
        /// The file.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The path is a folder.
    #[error("{file} is a folder; name a file")]
    Folder {
        /// The folder.
        file: String,
    },
    /// The file has 0 bytes.
    #[error("{file} is empty (0 bytes); write the data again")]
    Empty {
        /// The file.
        file: String,
    },
    /// The format is unknown, or does not fit the content or the request.
    #[error("{file}: {problem}")]
    Format {
        /// The file.
        file: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// The content is invalid.
    #[error("{file}{location}: {problem}")]
    Content {
        /// The file.
        file: String,
        /// Location in the file.
        location: Location,
        /// The problem and its remedy.
        problem: String,
    },
    /// The file cannot be written.
    #[error("cannot write {file}: {source}; {}", write_remedy(source))]
    Write {
        /// The file.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// Location in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Location {
    /// The file as a whole.
    Whole,
    /// Line number, from 1.
    Line(usize),
    /// Byte offset, from 0.
    Byte(usize),
    /// Element of a binary file.
    Element {
        /// Kind of element: vertex, face, triangle.
        name: String,
        /// Index among its kind, from 0.
        index: usize,
        /// Byte offset of its start.
        byte: usize,
    },
    /// Row of a named array.
    Row {
        /// Name of the array.
        name: String,
        /// Row index, from 0.
        index: usize,
    },
    /// A named array.
    Array(String),
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
            Self::Element { name, index, byte } => write!(f, ", {name} {index} (byte {byte})"),
            Self::Row { name, index } => write!(f, ", array '{name}', row {index}"),
            Self::Array(name) => write!(f, ", array '{name}'"),
        }
    }
}

fn read_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the path",
        io::ErrorKind::PermissionDenied => "check its permissions",
        io::ErrorKind::OutOfMemory => "it is larger than the memory; reduce it",
        _ => "check the file and the disk",
    }
}

fn write_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "create its folder first, or choose another",
        io::ErrorKind::PermissionDenied => "choose a folder you may write to",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "free some space or choose another disk"
        }
        io::ErrorKind::IsADirectory => "name a file, not a folder",
        io::ErrorKind::InvalidInput => "choose another format",
        io::ErrorKind::Interrupted => "run it again",
        _ => "check the folder and the disk",
    }
}
