//! Which format a file is in: by its name, checked against its content.

use std::path::Path;

use crate::error::Error;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford polygon file: points or a mesh.
    Ply,
    /// Columns of numbers as text (`.xyz`, `.csv`, `.txt`): points.
    Text,
    /// Wavefront: points or a mesh.
    Obj,
    /// Stereolithography: a mesh.
    Stl,
    /// One NumPy array: points.
    Npy,
    /// Several NumPy arrays: points, or a field.
    Npz,
    /// VTK XML PolyData: points or a mesh.
    Vtp,
    /// VTK XML ImageData: a field.
    Vti,
}

impl Format {
    /// The format that a file name stands for.
    pub fn of_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "ply" => Self::Ply,
            "xyz" | "csv" | "txt" => Self::Text,
            "obj" => Self::Obj,
            "stl" => Self::Stl,
            "npy" => Self::Npy,
            "npz" => Self::Npz,
            "vtp" => Self::Vtp,
            "vti" => Self::Vti,
            _ => return None,
        })
    }

    /// The format that the first bytes betray, where they do.
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        let head = &bytes[..bytes.len().min(512)];
        let holds = |word: &[u8]| memchr::memmem::find(head, word).is_some();
        if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
            Some(Self::Ply)
        } else if head.starts_with(b"\x93NUMPY") {
            Some(Self::Npy)
        } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") {
            Some(Self::Npz)
        } else if holds(b"<VTKFile") && holds(b"PolyData") {
            Some(Self::Vtp)
        } else if holds(b"<VTKFile") && holds(b"ImageData") {
            Some(Self::Vti)
        } else {
            None
        }
    }

    /// Its usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Text => "text",
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Npy => "NPY",
            Self::Npz => "NPZ",
            Self::Vtp => "VTP",
            Self::Vti => "VTI",
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Text => "xyz",
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Npy => "npy",
            Self::Npz => "npz",
            Self::Vtp => "vtp",
            Self::Vti => "vti",
        }
    }
}

/// The format to read a file in. A name that the content contradicts is refused: guessing either way
/// would read garbage from somebody's file.
pub(crate) fn choose(path: &Path, name: &str, bytes: &[u8]) -> Result<Format, Error> {
    let refuse = |problem: String| Error::Format {
        file: name.to_string(),
        problem,
    };
    let betrayed = Format::of_content(bytes);
    if path == Path::new("-") {
        return Ok(betrayed.unwrap_or(Format::Text));
    }
    match (Format::of_name(path), betrayed) {
        (Some(named), Some(content)) if named != content => Err(refuse(format!(
            "the name says {}, but the content is {}; rename it to end in .{}",
            named.name(),
            content.name(),
            content.extension()
        ))),
        // STL and OBJ have no sure mark: only formats that always have one can miss it.
        (Some(named @ (Format::Ply | Format::Npy | Format::Npz)), None) => Err(refuse(format!(
            "the content does not begin as {} does; check the file, or rename it after its real format",
            named.name()
        ))),
        (Some(named), _) => Ok(named),
        (None, Some(content)) => Err(refuse(format!(
            "the name has no known ending, and the content is {}; rename it to end in .{}",
            content.name(),
            content.extension()
        ))),
        (None, None) => Err(refuse(format!("the format is unknown; {KNOWN}"))),
    }
}

/// The formats that can be read, for messages.
pub(crate) const KNOWN: &str =
    "the name must end in .ply, .xyz, .csv, .txt, .obj, .stl, .npy, .npz, .vtp or .vti";
