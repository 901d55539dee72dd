//! Mutated files: no panic, memory and time bounded by the size of the file, and what was read can be written and read
//! again.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use isograd::data::Attribute;
use isograd_io::{
    Error, FieldFile, Format, Geometry, Source, parse_field, parse_geometry, read_field,
    read_geometry, write_cloud, write_field, write_mesh,
};

use crate::MEMORY;
use crate::case::{Inputs, Outcome, catch};
use crate::files::{Seed, any, corpus};
use crate::random::Random;

/// Live memory per byte of a file.
const MEMORY_RATIO: usize = 64;
/// Live memory that any file may take.
const LEAST_MEMORY: usize = 64 << 20;
/// Live memory beside the data: buffers of the unpacker, messages.
const CONSTANT_MEMORY: usize = 1 << 20;
/// Time that a file of at most 1 MiB may take.
const LONGEST: Duration = Duration::from_secs(10);
/// Smaller files are left out of the ratios: they would show constants, and what other processes do meanwhile.
const LEAST_BYTES: usize = 1 << 14;

/// Clouds with more columns of attributes, or with longer names, are not written again: formats have limits.
const MOST_COLUMNS: usize = 4000;
const LONGEST_NAME: usize = 1 << 15;

/// Readers and their corpus.
pub struct Readers {
    corpus: Vec<Seed>,
    folder: PathBuf,
    /// Largest time per byte so far; one above it is measured again.
    slowest: f64,
}

/// Content of a file.
enum Content {
    Geometry(Geometry),
    Field(FieldFile),
}

/// Measurement of one read.
struct Reading {
    result: Result<Result<Content, Error>, String>,
    memory: usize,
    time: Duration,
}

impl Readers {
    /// Reads the corpus. Copies of files for second reads are written to `folder`.
    pub fn new(folder: PathBuf) -> Result<Self, String> {
        Ok(Self {
            corpus: corpus()?,
            folder,
            slowest: 0.0,
        })
    }

    /// Failure of a reading, if there is one.
    fn judge(&self, reading: &Reading, bytes: usize, random: &mut Random) -> Option<String> {
        let allowed = (MEMORY_RATIO * bytes).max(LEAST_MEMORY) + CONSTANT_MEMORY;
        if reading.memory > allowed {
            let memory = reading.memory;
            return Some(format!(
                "{memory} bytes of memory for a file of {bytes}; {allowed} are allowed"
            ));
        }
        if reading.time > LONGEST {
            return Some(format!("took {:.1} s", reading.time.as_secs_f64()));
        }
        match &reading.result {
            Err(panic) => Some(panic.clone()),
            // The program shortens and escapes messages.
            Ok(Err(error)) => error
                .to_string()
                .is_empty()
                .then(|| "an error without a message".into()),
            Ok(Ok(_)) if !random.one_in(4) => None,
            Ok(Ok(content)) => catch(|| self.round_trip(content, random))
                .and_then(|r| r)
                .err(),
        }
    }

    /// Writes the content in a random format and reads it again.
    fn round_trip(&self, content: &Content, random: &mut Random) -> Result<(), String> {
        let path = |extension: &str| self.folder.join("copy").with_extension(extension);
        match content {
            Content::Field(file) => field_comes_back(file, &path(random.pick(&["vti", "npz"]))),
            Content::Geometry(geometry) if !geometry.faces.is_empty() && random.one_in(2) => {
                mesh_comes_back(geometry, &path(random.pick(&["ply", "obj", "off", "vtp"])))
            }
            Content::Geometry(geometry) => cloud_comes_back(
                geometry,
                &path(random.pick(&["ply", "npz", "csv", "xyz", "pcd"])),
            ),
        }
    }
}

impl Inputs for Readers {
    fn run(&mut self, mut random: Random, folder: &Path, name: &str) -> Outcome {
        let mutant = any(&self.corpus, &mut random);
        let (format, bytes) = (mutant.format, mutant.bytes.len());
        let as_field = format == Format::Vti || format == Format::Npz && random.one_in(2);
        let source = Source {
            name: format.name().into(),
            bytes: mutant.bytes,
        };
        let mut reading = measure(&source, format, as_field);
        let is_large = bytes >= LEAST_BYTES;
        let per_byte = |time: Duration| time.as_nanos() as f64 / bytes.max(1) as f64;
        if is_large && per_byte(reading.time) > self.slowest {
            // Other processes may have taken the time.
            for _ in 0..2 {
                let again = measure(&source, format, as_field);
                reading.time = reading.time.min(again.time);
            }
            self.slowest = self.slowest.max(per_byte(reading.time));
        }
        let failure = self.judge(&reading, bytes, &mut random);
        if failure.is_some() {
            let file = format!("{name}.{}", format.name().to_lowercase());
            // The command repeats the input where this fails.
            let _ = std::fs::write(folder.join(file), &source.bytes);
        }
        let row = match as_field && format == Format::Npz {
            true => "NPZ field",
            false => format.name(),
        };
        Outcome {
            row,
            accepted: matches!(reading.result, Ok(Ok(_))),
            memory_ratio: f64::from(is_large) * reading.memory as f64 / bytes.max(1) as f64,
            ns_per_byte: f64::from(is_large) * per_byte(reading.time),
            failure: failure.map(|failure| format!("{failure} [{}]", mutant.history)),
        }
    }
}

/// Reads a file and measures memory and time.
fn measure(source: &Source, format: Format, as_field: bool) -> Reading {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let result = catch(|| match as_field {
        true => parse_field(source, format).map(Content::Field),
        false => parse_geometry(source, format).map(Content::Geometry),
    });
    Reading {
        result,
        time: start.elapsed(),
        memory: MEMORY.peak_usage().saturating_sub(before),
    }
}

/// Compares the bits of numbers; NaN equals NaN.
fn compare<'a>(
    what: &str,
    a: impl IntoIterator<Item = &'a f64>,
    b: impl IntoIterator<Item = &'a f64>,
) -> Result<(), String> {
    let bits = |x: &f64| if x.is_nan() { u64::MAX } else { x.to_bits() };
    let (a, b) = (a.into_iter().map(bits), b.into_iter().map(bits));
    match a.eq(b) {
        true => Ok(()),
        false => Err(format!("{what} differ after writing and reading")),
    }
}

fn text(what: &str) -> impl Fn(Error) -> String {
    move |error| format!("{what}: {error}")
}

fn mesh_comes_back(geometry: &Geometry, path: &Path) -> Result<(), String> {
    // Attributes, and numbers that the mesh refuses, are no part of the promise.
    let Ok(mesh) = geometry.mesh::<f64>() else {
        return Ok(());
    };
    let format = path.extension().unwrap_or_default().display();
    write_mesh(path, &mesh).map_err(text("a mesh cannot be written"))?;
    let back = read_geometry(path).map_err(text("a written mesh cannot be read"))?;
    compare(
        &format!("vertices in {format}"),
        back.points.as_flattened(),
        mesh.vertices().as_flattened(),
    )?;
    match back.faces == mesh.faces() {
        true => Ok(()),
        false => Err(format!(
            "faces in {format} differ after writing and reading"
        )),
    }
}

fn cloud_comes_back(geometry: &Geometry, path: &Path) -> Result<(), String> {
    let Ok(cloud) = geometry.cloud::<f64>() else {
        return Ok(());
    };
    let components = cloud.attributes().iter().map(|a| a.components);
    let too_long = |a: &Attribute<f64>| a.name.len() > LONGEST_NAME;
    if components.sum::<usize>() > MOST_COLUMNS || cloud.attributes().iter().any(too_long) {
        return Ok(());
    }
    let format = path.extension().unwrap_or_default().display();
    write_cloud(path, &cloud).map_err(text("a cloud cannot be written"))?;
    let back = read_geometry(path).map_err(text("a written cloud cannot be read"))?;
    compare(
        &format!("points in {format}"),
        back.points.as_flattened(),
        cloud.points().as_flattened(),
    )?;
    let normals = [back.normals.as_deref(), cloud.normals()];
    let [a, b] = normals.map(|normals| normals.unwrap_or_default().as_flattened());
    compare(&format!("normals in {format}"), a, b)?;
    let (a, b) = (columns(&back.attributes), columns(cloud.attributes()));
    compare(&format!("attributes in {format}"), &a, &b)
}

/// Values of all attributes, one component after the other.
fn columns(attributes: &[Attribute<f64>]) -> Vec<f64> {
    let components = attributes.iter().flat_map(|attribute| {
        let count = attribute.components;
        (0..count).map(move |c| attribute.values.iter().skip(c).step_by(count))
    });
    components.flatten().copied().collect()
}

fn field_comes_back(file: &FieldFile, path: &Path) -> Result<(), String> {
    let field = &file.field;
    write_field(path, field).map_err(text("a field cannot be written"))?;
    let back = read_field(path)
        .map_err(text("a written field cannot be read"))?
        .field;
    let [a, b] = [field, &back].map(|field| field.grid());
    if (a.shape(), a.spacing().to_bits()) != (b.shape(), b.spacing().to_bits()) {
        return Err("the grid of a field differs after writing and reading".into());
    }
    compare("values of a field", field.values(), back.values())
}
