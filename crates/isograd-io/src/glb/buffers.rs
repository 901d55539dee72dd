//! Buffers of a GLB: the binary part, and data in the document.

use std::borrow::Cow;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::document::Document;
use crate::error::{Error, Location};
use crate::source::Input;

/// Bytes of each buffer; `None` where they are in another file.
pub(super) type Buffers<'a> = Vec<Option<Cow<'a, [u8]>>>;

/// Unpacks the buffers; their text is taken out of the document.
pub(super) fn read<'a>(
    input: &Input<'a>,
    document: &mut Document,
    binary: &'a [u8],
) -> Result<Buffers<'a>, Error> {
    let buffers = &mut document.buffers;
    let bad = |index: usize| {
        move |problem| input.error(Location::Array(format!("buffer {index}")), problem)
    };
    let mut all = input.memory.with_capacity(buffers.len()).map_err(bad(0))?;
    for (index, buffer) in buffers.iter_mut().enumerate() {
        all.push(match buffer.uri.take() {
            // Only the first one may be the binary part.
            None => (index == 0).then_some(Cow::Borrowed(binary)),
            Some(uri) => decode(input, &uri).map_err(bad(index))?.map(Cow::Owned),
        });
    }
    Ok(all)
}

/// Bytes of an address that begins with `data:`; `None` for that of a file.
fn decode(input: &Input, uri: &str) -> Result<Option<Vec<u8>>, String> {
    let Some(data) = uri.strip_prefix("data:") else {
        return Ok(None);
    };
    let (kind, letters) = data.split_once(',').unwrap_or((data, ""));
    if !kind.ends_with(";base64") {
        return Err("its data in the file are not base64; save them in the binary part".into());
    }
    let options =
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let size = base64::decoded_len_estimate(letters.len());
    input.memory.reserve(size)?;
    let bytes = GeneralPurpose::new(&STANDARD, options).decode(letters);
    bytes
        .map(Some)
        .map_err(|error| format!("its data are not base64 ({error}); the file is damaged"))
}
