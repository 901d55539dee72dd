//! The JSON part of a GLB: the fields that meshes need.

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::buffers::{self, Buffers};
use super::{BINARY, JSON, MAGIC};
use crate::error::{Error, Location};
use crate::source::Input;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<MeshEntry>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<View>,
    pub buffers: Vec<Buffer>,
    pub extensions_required: Vec<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Scene {
    pub nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub mesh: Option<usize>,
    pub children: Vec<usize>,
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<Box<[f64; 3]>>,
    pub rotation: Option<Box<[f64; 4]>>,
    pub scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct MeshEntry {
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: Attributes,
    pub indices: Option<usize>,
    /// Kind of the cells; 4, the default, is triangles.
    #[serde(default = "triangles")]
    pub mode: u32,
}

fn triangles() -> u32 {
    4
}

/// Accessors of the values of vertices.
#[derive(Clone, Copy, Deserialize, Default, PartialEq, Eq, Hash)]
#[serde(rename_all = "UPPERCASE", default)]
pub(super) struct Attributes {
    pub position: Option<usize>,
    pub normal: Option<usize>,
    #[serde(rename = "COLOR_0")]
    pub color: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Buffer {
    pub uri: Option<String>,
}

/// Splits a file into its document and its buffers.
pub(super) fn parse<'a>(input: &Input<'a>) -> Result<(Document, Buffers<'a>), Error> {
    let bad = |byte: usize, problem: String| input.error(Location::Byte(byte), problem);
    let word = |at: usize| {
        let bytes = input.bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes) as usize)
    };
    match word(4) {
        Some(2) if input.bytes.starts_with(MAGIC) => {}
        Some(version) if input.bytes.starts_with(MAGIC) => {
            return Err(bad(
                4,
                format!("version {version} of glTF is not supported; save it as glTF 2.0"),
            ));
        }
        _ => {
            return Err(bad(
                0,
                "the file does not begin as glTF 2.0 in binary form does".into(),
            ));
        }
    }
    // Parts begin with their length and type.
    let part = |at: usize, kind: &[u8]| {
        if input.bytes.get(at + 4..at + 8) != Some(kind) {
            return Ok(None);
        }
        let length = word(at).unwrap_or_default();
        let rest = &input.bytes[at + 8..];
        let problem = || {
            format!(
                "a part of {length} bytes is declared, but only {} are left; the file is cut short",
                rest.len()
            )
        };
        rest.get(..length)
            .map(Some)
            .ok_or_else(|| bad(at, problem()))
    };
    let json = part(12, JSON)?.ok_or_else(|| bad(12, "the JSON part is missing".into()))?;
    let next = (20 + json.len()).next_multiple_of(4);
    let binary = part(next, BINARY)?.unwrap_or_default();
    let memory = memory_of(json);
    input
        .memory
        .reserve(memory)
        .map_err(|problem| bad(20, problem))?;
    let mut document: Document = serde_json::from_slice(json)
        .map_err(|error| bad(20, format!("the JSON part is damaged: {error}")))?;
    let compressed = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];
    let mut required = document.extensions_required.iter();
    if let Some(name) = required.find(|name| compressed.contains(&name.as_str())) {
        return Err(bad(
            20,
            format!("the meshes are compressed ({name}); save the file without compression"),
        ));
    }
    let buffers = buffers::read(input, &mut document, binary)?;
    Ok((document, buffers))
}

/// Upper bound for the memory of the document: every value follows one of these characters, and takes up to 100 bytes in a
/// vector whose capacity doubles while the old one is still there. Data in the document are copied, up to three times more if they
/// have escaped characters.
fn memory_of(json: &[u8]) -> usize {
    const EACH: usize = 300;
    let text = memchr::memmem::find(json, b"\"uri\"").map_or(0, |_| 4 * json.len());
    memchr::memchr3_iter(b'{', b'[', b',', json).count() * EACH + text
}
