//! What can go wrong with a file, and where in it.

use std::fmt;
use std::io;

/// Why a file could not be read or written. The message names the file, the place in it where there is
/// one, what is wrong, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read it.
    #[error("{file}: {source}; {}", read_remedy(source))]
    Read {
        /// The file.
        file: String,
        /// What the operating system said.
        source: io::Error,
    },
    /// A folder was named where a file is needed.
    #[error("{file} is a folder; name a file")]
    Folder {
        /// The folder.
        file: String,
    },
    /// There is nothing in it.
    #[error("{file} is empty (0 bytes); write the data again")]
    Empty {
        /// The file.
        file: String,
    },
    /// The format is unknown, or not one that can hold what is asked for.
    #[error("{file}: {problem}")]
    Format {
        /// The file.
        file: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The content is wrong.
    #[error("{file}{place}: {problem}")]
    Content {
        /// The file.
        file: String,
        /// Where in the file.
        place: Place,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The operating system refused to write it.
    #[error("cannot write {file}: {source}; {}", write_remedy(source))]
    Write {
        /// The file.
        file: String,
        /// What the operating system said.
        source: io::Error,
    },
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, from 1.
    Line(usize),
    /// A byte, from 0.
    Byte(usize),
    /// An element of a binary file, from 0, and the byte at which it begins.
    Element {
        /// What it is: vertex, face, triangle.
        name: String,
        /// Its index, from 0.
        index: usize,
        /// Where it begins, in bytes from the start of the file.
        byte: usize,
    },
    /// An array or a member with a name, and an index in it.
    Row {
        /// Its name.
        name: String,
        /// The row, from 0.
        index: usize,
    },
    /// An array or a member with a name.
    Member(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
            Self::Element { name, index, byte } => write!(f, ", {name} {index} (byte {byte})"),
            Self::Row { name, index } => write!(f, ", array '{name}', row {index}"),
            Self::Member(name) => write!(f, ", array '{name}'"),
        }
    }
}

fn read_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the path",
        io::ErrorKind::PermissionDenied => "check who may read it",
        io::ErrorKind::OutOfMemory => "it is larger than the memory; thin it",
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
        io::ErrorKind::Interrupted => "run it again",
        _ => "check the folder and the disk",
    }
}
