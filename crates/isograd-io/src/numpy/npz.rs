//! Clouds and fields as NumPy arrays.

use std::io::{self, Cursor, Read, Write};

use isograd::data::Attribute;
use isograd::{Field, PointCloud, Real};
use zip::read::ZipFile;
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::array::{ArrayError, Header, write};
use crate::bytes::size;
use crate::error::{Error, Location};
use crate::field::{FieldFile, field_file};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::names::UniqueNames;
use crate::source::Input;

/// Largest number of arrays of an archive.
const MAX_MEMBERS: usize = 4096;

/// Names of arrays with a meaning.
const RESERVED: [&str; 5] = ["points", "normals", "sdf", "origin", "spacing"];

/// Reads one `(N, 3)` or `(N, 6)` array; six columns are points and normals.
pub(crate) fn read_npy(input: &Input) -> Result<Geometry, Error> {
    let at = |error: ArrayError| input.error(Location::Byte(error.byte), error.problem);
    let mut data = input.bytes;
    let header = Header::read(&mut data).map_err(at)?;
    header.count(input.bytes.len() as u64).map_err(at)?;
    let full = |problem| input.error(Location::Whole, problem);
    let (points, normals) = match header.shape[..] {
        [n, 3] => {
            let mut rows = input.memory.filled::<[f64; 3]>(n).map_err(full)?;
            header
                .values(&mut data, rows.as_flattened_mut())
                .map_err(at)?;
            (rows, None)
        }
        [n, 6] => {
            let mut rows = input.memory.filled::<[[f64; 3]; 2]>(n).map_err(full)?;
            let values = rows.as_flattened_mut().as_flattened_mut();
            header.values(&mut data, values).map_err(at)?;
            input
                .memory
                .reserve(rows.len() * size_of::<[[f64; 3]; 2]>())
                .map_err(full)?;
            let (points, normals) = rows
                .into_iter()
                .map(|[point, normal]| (point, normal))
                .unzip();
            (points, Some(normals))
        }
        ref shape => {
            return Err(full(format!(
                "the array's shape is {shape:?}, not (N, 3) or (N, 6)"
            )));
        }
    };
    let geometry = Geometry {
        normals,
        ..Geometry::from_points(points, header.dtype(), Format::Npy)
    };
    checked(input, geometry, "points")
}

/// Reads an archive with the array `points`, or with a single array. The array `normals` becomes the
/// normals, and any other array with a row per point an attribute.
pub(crate) fn read_npz(input: &Input) -> Result<Geometry, Error> {
    let mut archive = Archive::open(input)?;
    let main = match archive.find("points") {
        Some(main) => main,
        None if archive.members.len() == 1 => 0,
        None => {
            let names = archive.members.iter().map(|member| &member.name);
            let names: Vec<&String> = names.take(24).collect();
            let problem = format!("none of the arrays {names:?} is called 'points'; rename one");
            return Err(input.error(Location::Whole, problem));
        }
    };
    let points = archive.rows(main)?;
    let mut normals = None;
    let mut attributes = Vec::new();
    for at in (0..archive.members.len()).filter(|&at| at != main) {
        let Member { name, header, .. } = &archive.members[at];
        if name == "normals" {
            let rows = archive.rows(at)?;
            if rows.len() != points.len() {
                let problem = format!("{} normals for {} points", rows.len(), points.len());
                return Err(input.error(Location::Array("normals".into()), problem));
            }
            normals = Some(rows);
        } else if let Some(components) = components_per_row(&header.shape, points.len())
            && input.options.keeps(name)
        {
            attributes.push(Attribute {
                name: name.clone(),
                components,
                values: archive.values(at)?,
            });
        }
    }
    let Member { name, header, .. } = &archive.members[main];
    let geometry = Geometry {
        normals,
        attributes,
        ..Geometry::from_points(points, header.dtype(), Format::Npz)
    };
    checked(input, geometry, name)
}

/// Number of values per row of an array of `shape` with `rows` rows.
fn components_per_row(shape: &[usize], rows: usize) -> Option<usize> {
    match *shape {
        [n] if n == rows => Some(1),
        [n, components] if n == rows && components > 0 => Some(components),
        _ => None,
    }
}

/// Refuses points, from the array `name`, and normals that are not finite.
fn checked(input: &Input, geometry: Geometry, name: &str) -> Result<Geometry, Error> {
    let normals = geometry.normals.as_deref().unwrap_or_default();
    input.check_rows(name, "point", &geometry.points)?;
    input.check_rows("normals", "normal", normals)?;
    Ok(geometry)
}

/// Whether an archive holds a field: an array `sdf` of three axes, or `sdf` and no points.
pub(crate) fn holds_field(input: &Input) -> Result<bool, Error> {
    let archive = Archive::open(input)?;
    let sdf = archive.find("sdf").map(|at| &archive.members[at].header);
    Ok(sdf.is_some_and(|sdf| sdf.shape.len() == 3 || archive.find("points").is_none()))
}

/// Reads a field: `sdf` `(nx, ny, nz)`, `origin` `(3,)` and `spacing`.
pub(crate) fn read_field(input: &Input) -> Result<FieldFile, Error> {
    let mut archive = Archive::open(input)?;
    let find = |name: &str| {
        archive.find(name).ok_or_else(|| {
            let problem =
                format!("the array '{name}' is missing; a field has 'sdf', 'origin' and 'spacing'");
            input.error(Location::Whole, problem)
        })
    };
    let (sdf, origin, spacing) = (find("sdf")?, find("origin")?, find("spacing")?);
    let [nx, ny, nz] = archive.members[sdf].header.shape[..] else {
        return Err(archive.shape_error(sdf, "(nx, ny, nz)"));
    };
    let [x, y, z] = archive.values(origin)?[..] else {
        return Err(archive.shape_error(origin, "(3,)"));
    };
    let [h] = archive.values(spacing)?[..] else {
        return Err(archive.shape_error(spacing, "one number"));
    };
    let values = archive.values(sdf)?;
    let dtype = archive.members[sdf].header.dtype();
    field_file([x, y, z], h, [nx, ny, nz], values, dtype, Format::Npz)
        .map_err(|problem| input.error(Location::Array("sdf".into()), problem))
}

/// An archive whose arrays are unpacked when they are needed.
struct Archive<'a> {
    input: &'a Input<'a>,
    zip: ZipArchive<Cursor<&'a [u8]>>,
    members: Vec<Member>,
}

/// An array of an archive.
struct Member {
    /// Name without `.npy`.
    name: String,
    /// Index in the archive.
    index: usize,
    header: Header,
}

impl<'a> Archive<'a> {
    /// Reads the headers of all arrays.
    fn open(input: &'a Input<'a>) -> Result<Self, Error> {
        let broken = |problem: String| input.error(Location::Whole, problem);
        let zip = ZipArchive::new(Cursor::new(input.bytes))
            .map_err(|e| broken(format!("the archive is damaged: {e}; write it again")))?;
        let count = zip.len();
        if count > MAX_MEMBERS {
            return Err(broken(format!(
                "more than {MAX_MEMBERS} arrays; save fewer in one file"
            )));
        }
        let mut archive = Self {
            input,
            zip,
            members: Vec::new(),
        };
        for index in 0..count {
            let (name, header) =
                archive.unpack(index, |data, name, _| match Header::read(data) {
                    // An archive may hold other members, such as text; they are skipped.
                    Err(error) if error.is_other && !RESERVED.contains(&name) => Ok(None),
                    header => header.map(Some),
                })?;
            if let Some(header) = header {
                archive.members.push(Member {
                    name,
                    index,
                    header,
                });
            }
        }
        Ok(archive)
    }

    fn find(&self, name: &str) -> Option<usize> {
        self.members.iter().position(|member| member.name == name)
    }

    /// Calls `read` with the unpacked data of a member, its name, and the size of the data in bytes. Returns the name and
    /// the result.
    fn unpack<R>(
        &mut self,
        index: usize,
        read: impl FnOnce(&mut ZipFile<Cursor<&'a [u8]>>, &str, u64) -> Result<R, ArrayError>,
    ) -> Result<(String, R), Error> {
        let input = self.input;
        let broken = |problem: String| input.error(Location::Whole, problem);
        let mut member = self
            .zip
            .by_index(index)
            .map_err(|e| broken(format!("member {index} of the archive is damaged: {e}")))?;
        let name = member
            .name()
            .map_err(|e| broken(format!("a name is damaged: {e}")))?;
        let name = name.strip_suffix(".npy").unwrap_or(&name).to_string();
        let size = member.size();
        match read(&mut member, &name, size) {
            Ok(value) => Ok((name, value)),
            Err(ArrayError { byte, problem, .. }) => {
                let problem = match byte {
                    0 => problem,
                    byte => format!("byte {byte}: {problem}"),
                };
                Err(input.error(Location::Array(name), problem))
            }
        }
    }

    /// Values of an array in C order.
    fn values(&mut self, at: usize) -> Result<Vec<f64>, Error> {
        let input = self.input;
        self.read(
            at,
            |header, size| {
                let count = header.count(size)?;
                input
                    .memory
                    .filled(count)
                    .map_err(|e| ArrayError::new(0, e))
            },
            Vec::as_mut_slice,
        )
    }

    /// Rows of an `(N, 3)` array.
    fn rows(&mut self, at: usize) -> Result<Vec<[f64; 3]>, Error> {
        let [rows, 3] = self.members[at].header.shape[..] else {
            return Err(self.shape_error(at, "(N, 3)"));
        };
        let input = self.input;
        self.read(
            at,
            |header, size| {
                header.count(size)?;
                input.memory.filled(rows).map_err(|e| ArrayError::new(0, e))
            },
            |rows| rows.as_flattened_mut(),
        )
    }

    /// Reads an array into what `allocate` returns, flattened.
    fn read<V>(
        &mut self,
        at: usize,
        allocate: impl FnOnce(&Header, u64) -> Result<V, ArrayError>,
        flatten: impl FnOnce(&mut V) -> &mut [f64],
    ) -> Result<V, Error> {
        let (_, values) = self.unpack(self.members[at].index, |data, _, size| {
            let header = Header::read(data)?;
            let mut values = allocate(&header, size)?;
            header.values(data, flatten(&mut values))?;
            // The checksum is compared at the end of the data.
            let end = data.read(&mut [0]);
            end.map_err(|e| {
                ArrayError::new(0, format!("the array is damaged: {e}; write it again"))
            })?;
            Ok(values)
        })?;
        Ok(values)
    }

    fn shape_error(&self, at: usize, wanted: &str) -> Error {
        let Member { name, header, .. } = &self.members[at];
        let problem = format!("the shape is {:?}, not {wanted}", header.shape);
        self.input.error(Location::Array(name.clone()), problem)
    }
}

/// Writes `points`, `normals` if there are any, and one array per attribute.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    write_archive(out, |archive| {
        let n = cloud.len();
        archive.add("points", &[n, 3], cloud.points().as_flattened())?;
        if let Some(normals) = cloud.normals() {
            archive.add("normals", &[n, 3], normals.as_flattened())?;
        }
        let mut names = UniqueNames::default();
        for name in ["points", "normals"] {
            names.add(name, |_| true);
        }
        for attribute in cloud.attributes() {
            let shape = [n, attribute.components];
            let axes = if attribute.components == 1 { 1 } else { 2 };
            let name = names.add(&attribute.name, |_| true);
            archive.add(&name, &shape[..axes], &attribute.values)?;
        }
        Ok(())
    })
}

/// Writes `sdf`, `origin` (the position of sample `[0, 0, 0]`) and `spacing`.
pub(crate) fn write_field<T: Real>(out: &mut impl Write, field: &Field<T>) -> io::Result<()> {
    let grid = field.grid();
    write_archive(out, |archive| {
        archive.add("sdf", &grid.shape(), field.values())?;
        archive.add("origin", &[3], &grid.center_f64([0; 3]))?;
        archive.add("spacing", &[], &[grid.spacing().f64()])
    })
}

/// An archive of uncompressed arrays, written without seeking.
struct ArchiveWriter<'a, W: Write>(ZipWriter<StreamWriter<FirstError<'a, W>>>);

impl<W: Write> ArchiveWriter<'_, W> {
    fn add<T: Real>(&mut self, name: &str, shape: &[usize], values: &[T]) -> io::Result<()> {
        // 4 GiB, less some room for the header of the array: larger members need ZIP64.
        const LARGE: usize = (u32::MAX - (1 << 16)) as usize;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(values.len() * size::<T>() >= LARGE);
        self.0.start_file(format!("{name}.npy"), options)?;
        write(&mut self.0, shape, values)
    }
}

/// Writes an archive with the arrays that `content` adds.
fn write_archive<W: Write>(
    out: &mut W,
    content: impl FnOnce(&mut ArchiveWriter<W>) -> io::Result<()>,
) -> io::Result<()> {
    let mut error = None;
    {
        let error = &mut error;
        let mut archive = ArchiveWriter(ZipWriter::new_stream(FirstError { out, error }));
        content(&mut archive)?;
        archive.0.finish()?;
    }
    error.map_or(Ok(()), Err)
}

/// Keeps the first error and discards all later bytes: a `ZipWriter` that is dropped after an error
/// would print to standard error.
struct FirstError<'a, W> {
    out: &'a mut W,
    error: &'a mut Option<io::Error>,
}

impl<W: Write> Write for FirstError<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.error.is_none() {
            *self.error = self.out.write_all(bytes).err();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
