//! File formats, detected by the name of the file and checked against its content.

use std::path::Path;

use crate::error::Error;

/// File format.
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
    /// Point Cloud Library: points.
    Pcd,
    /// Text of scanners, under a line with the number of points: points with intensity and color.
    Pts,
    /// Text of points and normals.
    Xyzn,
    /// Text of points and colors.
    Xyzrgb,
    /// Object file format (also `COFF` and `NOFF`): points or a mesh.
    Off,
    /// glTF 2.0 in one binary file: points or a mesh.
    Glb,
    /// ASPRS laser scans, not compressed: points.
    Las,
}

/// Name and file extensions of each format.
const FORMATS: [(Format, &str, &[&str]); 15] = [
    (Format::Ply, "PLY", &["ply"]),
    (Format::Text, "text", &["xyz", "csv", "txt"]),
    (Format::Obj, "OBJ", &["obj"]),
    (Format::Stl, "STL", &["stl"]),
    (Format::Npy, "NPY", &["npy"]),
    (Format::Npz, "NPZ", &["npz"]),
    (Format::Vtp, "VTP", &["vtp"]),
    (Format::Vti, "VTI", &["vti"]),
    (Format::Pcd, "PCD", &["pcd"]),
    (Format::Pts, "PTS", &["pts"]),
    (Format::Xyzn, "XYZN", &["xyzn"]),
    (Format::Xyzrgb, "XYZRGB", &["xyzrgb"]),
    (Format::Off, "OFF", &["off"]),
    (Format::Glb, "GLB", &["glb"]),
    (Format::Las, "LAS", &["las", "laz"]),
];

impl Format {
    /// Format of a file extension.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        let has_extension = |f: &&(_, _, &[&str])| f.2.contains(&extension.as_str());
        FORMATS.iter().find(has_extension).map(|f| f.0)
    }

    /// Format of the first bytes, if they are distinctive.
    pub fn from_content(bytes: &[u8]) -> Option<Self> {
        let head = &bytes[..bytes.len().min(512)];
        let holds = |word: &[u8]| memchr::memmem::find(head, word).is_some();
        if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
            Some(Self::Ply)
        } else if head.starts_with(b"\x93NUMPY") {
            Some(Self::Npy)
        } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") {
            Some(Self::Npz)
        } else if head.starts_with(b"# .PCD") {
            Some(Self::Pcd)
        } else if head.starts_with(b"glTF") {
            Some(Self::Glb)
        } else if head.starts_with(b"LASF") {
            Some(Self::Las)
        } else if holds(b"<VTKFile") && holds(b"PolyData") {
            Some(Self::Vtp)
        } else if holds(b"<VTKFile") && holds(b"ImageData") {
            Some(Self::Vti)
        } else {
            None
        }
    }

    /// Usual name.
    pub fn name(self) -> &'static str {
        FORMATS[self as usize].1
    }

    /// Whether the file has rows of numbers as text.
    pub(crate) fn is_table(self) -> bool {
        matches!(self, Self::Text | Self::Pts | Self::Xyzn | Self::Xyzrgb)
    }

    fn extension(self) -> &'static str {
        FORMATS[self as usize].2[0]
    }
}

/// Determines the format of a file. A name that contradicts the content is refused: a guess could read
/// wrong data without an error.
pub(crate) fn detect(path: &Path, name: &str, bytes: &[u8]) -> Result<Format, Error> {
    let refuse = |problem: String| Error::Format {
        file: name.to_string(),
        problem,
    };
    let content = Format::from_content(bytes);
    if let (None, Some(problem)) = (content, encoding(bytes)) {
        return Err(refuse(problem));
    }
    if path == Path::new("-") {
        return Ok(content.unwrap_or(Format::Text));
    }
    match (Format::from_path(path), content) {
        (Some(named), Some(content)) if named != content => Err(refuse(format!(
            "the name says {}, but the content is {}; rename it to end in .{}",
            named.name(),
            content.name(),
            content.extension()
        ))),
        // The others have no signature, or may begin with comments.
        (
            Some(named @ (Format::Ply | Format::Npy | Format::Npz | Format::Glb | Format::Las)),
            None,
        ) => Err(refuse(format!(
            "the content does not begin as {} does; check the file, or rename it to its real format",
            named.name()
        ))),
        (Some(named), _) => Ok(named),
        (None, Some(content)) => Err(refuse(format!(
            "the extension is unknown, and the content is {}; rename it to end in .{}",
            content.name(),
            content.extension()
        ))),
        (None, None) => Err(refuse(format!("the format is unknown; {KNOWN}"))),
    }
}

/// Beginnings of compressed files, and the program that unpacks each.
const COMPRESSED: [(&[u8], &str); 4] = [
    (&[0x1f, 0x8b, 8], "gunzip"),
    (b"BZh", "bunzip2"),
    (&[0xfd, b'7', b'z', b'X', b'Z', 0], "unxz"),
    (&[0x28, 0xb5, 0x2f, 0xfd], "unzstd"),
];

/// Names an encoding in which no format is read, if these bytes begin as one.
fn encoding(bytes: &[u8]) -> Option<String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Some("the text is in UTF-16; save it as UTF-8".into());
    }
    let (_, program) = COMPRESSED
        .into_iter()
        .find(|(begin, _)| bytes.starts_with(begin))?;
    Some(format!(
        "the file is compressed; unpack it with {program} first"
    ))
}

/// Readable formats, for messages.
pub(crate) const KNOWN: &str = "the name must end in .ply, .xyz, .csv, .txt, .pts, .xyzn, .xyzrgb, .pcd, .las, .obj, .stl, .off, .glb, .npy, .npz, .vtp or .vti";
