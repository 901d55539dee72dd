//! The corpus, and mutants of its files. Files with compressed parts are also mutated before compression.

use std::io::{Cursor, Read, Write};
use std::ops::Range;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use isograd_io::Format;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::bombs::bomb;
use crate::mutate::mutate;
use crate::random::Random;

/// Largest total of the members that are copied in an archive.
const MOST_UNPACKED: usize = 1 << 25;

/// A valid file.
pub struct Seed {
    /// File name.
    pub name: String,
    /// Format of its extension.
    pub format: Format,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Mutant of a file.
pub struct Mutant {
    /// Format of the file.
    pub format: Format,
    /// Mutated content.
    pub bytes: Vec<u8>,
    /// File it was made from, and what was done to it.
    pub history: String,
}

/// Reads the corpus: `crates/isograd-io/tests/corpus`, one or more files of every readable format.
pub fn corpus() -> Result<Vec<Seed>, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/isograd-io/tests/corpus");
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut seeds = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if let Some(format) = Format::from_path(&path) {
            seeds.push(Seed {
                name: path
                    .file_name()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into(),
                bytes: std::fs::read(&path).map_err(failed)?,
                format,
            });
        }
    }
    seeds.sort_by(|a, b| a.name.cmp(&b.name));
    match seeds.is_empty() {
        true => Err(format!("{} has no files", folder.display())),
        false => Ok(seeds),
    }
}

/// A mutant of a file of the corpus, or now and then a file that unpacks to much more than its size.
pub fn any(corpus: &[Seed], random: &mut Random) -> Mutant {
    if random.one_in(500) {
        let (format, bytes) = bomb(random);
        let history = "bomb".into();
        return Mutant {
            format,
            bytes,
            history,
        };
    }
    mutant(&corpus[random.below(corpus.len())], corpus, random)
}

/// Mutates a file, with parts of another file of its format.
pub fn mutant(seed: &Seed, corpus: &[Seed], random: &mut Random) -> Mutant {
    let donors: Vec<&Seed> = corpus.iter().filter(|s| s.format == seed.format).collect();
    let donor = random.pick(&donors);
    let mut names = vec![seed.name.as_str()];
    let deep = match random.below(4) {
        0 | 1 => mutant_within(seed, donor, &mut names, random),
        _ => None,
    };
    let mut bytes = deep.unwrap_or_else(|| seed.bytes.clone());
    // A mutant within is mutated on its surface as well, now and then.
    if names.len() == 1 || random.one_in(4) {
        names.extend(mutate(&mut bytes, &donor.bytes, random));
    }
    Mutant {
        format: seed.format,
        bytes,
        history: names.join(", "),
    }
}

/// Mutates an array before it is compressed; `None` for files that nothing is packed in.
fn mutant_within(
    seed: &Seed,
    donor: &Seed,
    names: &mut Vec<&str>,
    random: &mut Random,
) -> Option<Vec<u8>> {
    names.push("within");
    let result = match seed.format {
        Format::Npz => {
            let (mut members, others) = (members(&seed.bytes)?, members(&donor.bytes)?);
            for _ in 0..1 + random.below(3) {
                mutate_members(&mut members, &others, names, random);
            }
            archive(&members, random)
        }
        Format::Vtp | Format::Vti => {
            let text = std::str::from_utf8(&seed.bytes).ok();
            let arrays = text.map(packed_arrays).unwrap_or_default();
            if arrays.is_empty() {
                None
            } else {
                let (text, range) = (text?, &arrays[random.below(arrays.len())]);
                let mut bytes = unpack(text, range.clone())?;
                names.extend(mutate(&mut bytes, &donor.bytes, random));
                let packed = pack(text, &bytes, random)?;
                Some(
                    [&text[..range.start], &packed, &text[range.end..]]
                        .concat()
                        .into_bytes(),
                )
            }
        }
        _ => None,
    };
    if result.is_none() {
        names.truncate(1);
    }
    result
}

/// Names and unpacked contents of the members of an archive.
type Members = Vec<(String, Vec<u8>)>;

fn members(bytes: &[u8]) -> Option<Members> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).ok()?;
    let mut members = Vec::new();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).ok()?;
        let mut content = Vec::new();
        member.read_to_end(&mut content).ok()?;
        members.push((member.name().ok()?.to_string(), content));
    }
    Some(members)
}

fn mutate_members(
    members: &mut Members,
    others: &Members,
    names: &mut Vec<&str>,
    random: &mut Random,
) {
    let (at, other) = (
        random.below(members.len()),
        &others[random.below(others.len())],
    );
    match random.below(8) {
        0 if members.len() > 1 => drop(members.remove(at)),
        0 | 1 => members.push(other.clone()),
        2 => {
            let mut name = std::mem::take(&mut members[at].0).into_bytes();
            names.extend(mutate(&mut name, other.0.as_bytes(), random));
            name.truncate(1000);
            members[at].0 = String::from_utf8_lossy(&name).into_owned();
        }
        3 => {
            let (name, content) = members[at].clone();
            let copies = (1 + random.below(200)).min(MOST_UNPACKED / (content.len() + 1));
            let copy = |number| (format!("{number}{name}"), content.clone());
            members.extend((0..copies).map(copy));
        }
        _ => names.extend(mutate(&mut members[at].1, &other.1, random)),
    }
}

/// An archive of these members, compressed or not; `None` if names collide.
pub fn archive(members: &Members, random: &mut Random) -> Option<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let method = random.pick(&[CompressionMethod::Deflated, CompressionMethod::Stored]);
    let options = SimpleFileOptions::default().compression_method(method);
    for (name, bytes) in members {
        archive.start_file(name.as_str(), options).ok()?;
        archive.write_all(bytes).ok()?;
    }
    Some(archive.finish().ok()?.into_inner())
}

/// Ranges of the base64 texts of a VTK file.
fn packed_arrays(text: &str) -> Vec<Range<usize>> {
    let find = |(at, _): (usize, &str)| {
        let start = at + text[at..].find('>')? + 1;
        let end = start + text[start..].find('<')?;
        let trimmed = text[start..end].trim();
        let start = start + text[start..end].find(trimmed)?;
        Some(start..start + trimmed.len())
    };
    text.match_indices("format=\"binary\"")
        .filter_map(find)
        .collect()
}

fn is_compressed(text: &str) -> bool {
    text.contains("vtkZLibDataCompressor")
}

/// Unpacks an array of a VTK file whose headers are 32-bit little-endian words, as those of the corpus are.
fn unpack(text: &str, range: Range<usize>) -> Option<Vec<u8>> {
    let text_of_array = &text[range];
    if !is_compressed(text) {
        return Some(STANDARD.decode(text_of_array).ok()?.get(4..)?.to_vec());
    }
    let blocks = *STANDARD
        .decode(text_of_array.get(..8)?)
        .ok()?
        .first_chunk()?;
    let header = (12 + 4 * u32::from_le_bytes(blocks) as usize).div_ceil(3) * 4;
    let packed = STANDARD.decode(text_of_array.get(header..)?).ok()?;
    let (mut rest, mut bytes) = (packed.as_slice(), Vec::new());
    while !rest.is_empty() {
        ZlibDecoder::new(&mut rest).read_to_end(&mut bytes).ok()?;
    }
    Some(bytes)
}

/// Packs an array for a VTK file, in blocks of a random size where it is compressed.
fn pack(text: &str, bytes: &[u8], random: &mut Random) -> Option<String> {
    match is_compressed(text) {
        true => blocks(bytes, random.pick(&[64, 1 << 15, 1 << 20])),
        false => Some(STANDARD.encode([&(bytes.len() as u32).to_le_bytes(), bytes].concat())),
    }
}

/// Compressed blocks of this size, after their sizes, as VTK writes them.
pub fn blocks(bytes: &[u8], size: usize) -> Option<String> {
    let mut words = vec![bytes.len().div_ceil(size), size, bytes.len() % size];
    let mut packed = Vec::new();
    for block in bytes.chunks(size) {
        let before = packed.len();
        ZlibEncoder::new(block, Compression::default())
            .read_to_end(&mut packed)
            .ok()?;
        words.push(packed.len() - before);
    }
    let words = words.iter().flat_map(|&word| (word as u32).to_le_bytes());
    Some(STANDARD.encode(words.collect::<Vec<u8>>()) + &STANDARD.encode(packed))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use isograd_io::{Source, parse_field, parse_geometry};

    use super::*;

    fn reads(seed: &Seed, bytes: Vec<u8>) -> bool {
        let source = Source {
            name: seed.name.clone(),
            bytes,
        };
        parse_geometry(&source, seed.format).is_ok() || parse_field(&source, seed.format).is_ok()
    }

    #[test]
    fn the_corpus_covers_every_format_and_is_readable() {
        let corpus = corpus().expect("corpus");
        let formats: BTreeSet<&str> = corpus.iter().map(|seed| seed.format.name()).collect();
        assert_eq!(formats.len(), 15, "{formats:?}");
        for seed in &corpus {
            assert!(reads(seed, seed.bytes.clone()), "{}", seed.name);
        }
    }

    #[test]
    fn files_that_are_unpacked_and_packed_are_still_readable() {
        let mut repacked = 0;
        for seed in corpus().expect("corpus") {
            for number in 0..10 {
                let random = &mut Random::new(1, 0, number);
                let bytes = if let Some(members) = members(&seed.bytes) {
                    archive(&members, random)
                } else if let Ok(text) = std::str::from_utf8(&seed.bytes)
                    && let Some(range) = packed_arrays(text).first().cloned()
                {
                    let bytes = unpack(text, range.clone()).expect("an array");
                    let packed = pack(text, &bytes, random).expect("packs");
                    Some(
                        [&text[..range.start], &packed, &text[range.end..]]
                            .concat()
                            .into(),
                    )
                } else {
                    continue;
                };
                assert!(reads(&seed, bytes.expect("packs")), "{}", seed.name);
                repacked += 1;
            }
        }
        assert_eq!(repacked, 50, "three archives and two VTK files");
    }

    #[test]
    fn equal_seeds_give_equal_mutants_within_and_without() {
        let corpus = corpus().expect("corpus");
        let mut within = 0;
        for number in 0..200 {
            let mutant = || any(&corpus, &mut Random::new(7, 1, number));
            let (a, b) = (mutant(), mutant());
            assert_eq!((&a.bytes, &a.history), (&b.bytes, &b.history));
            within += usize::from(a.history.contains("within"));
        }
        assert!((10..100).contains(&within), "{within}");
    }
}
