//! Clouds and fields as NumPy arrays.

use std::io::{self, Cursor, Read, Write};

use isograd::data::Attribute;
use isograd::{Field, PointCloud, Real};
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::array::{Array, MAGIC, UNSUPPORTED, write};
use crate::bytes::size;
use crate::error::{Error, Location};
use crate::field::{FieldFile, field_file};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::source::Source;

/// Largest number of components of an attribute.
const MAX_COMPONENTS: usize = 64;

/// Largest ratio of Deflate; an archive that unpacks to more has members that overlap.
const MAX_EXPANSION: u64 = 1032;

/// Reads one `(N, 3)` or `(N, 6)` array; six columns are points and normals.
pub(crate) fn read_npy(source: &Source) -> Result<Geometry, Error> {
    let array = Array::parse(&source.bytes)
        .map_err(|error| source.error(Location::Byte(error.byte), error.problem))?;
    let (points, normals) = if let [_, 6] = array.shape[..] {
        let rows = array.values.as_chunks::<6>().0.iter();
        let split = |&[x, y, z, nx, ny, nz]: &[f64; 6]| ([x, y, z], [nx, ny, nz]);
        let (points, normals) = rows.map(split).unzip();
        (points, Some(normals))
    } else {
        let rows = array.rows_of_three().ok_or_else(|| {
            let shape = &array.shape;
            let problem = format!("the array's shape is {shape:?}, not (N, 3) or (N, 6)");
            source.error(Location::Whole, problem)
        })?;
        (rows, None)
    };
    let geometry = Geometry {
        normals,
        ..Geometry::from_points(points, array.dtype, Format::Npy)
    };
    checked(source, geometry, "points")
}

/// Reads an archive with the array `points`, or with a single array. The array `normals` becomes the
/// normals, and any other array with a row per point an attribute.
pub(crate) fn read_npz(source: &Source) -> Result<Geometry, Error> {
    let mut members = read_members(source)?;
    let main = match members.iter().position(|(name, _)| name == "points") {
        Some(main) => main,
        None if members.len() == 1 => 0,
        None => {
            let names: Vec<&str> = members.iter().map(|(name, _)| name.as_str()).collect();
            let problem = format!("none of the arrays {names:?} is called 'points'; rename one");
            return Err(source.error(Location::Whole, problem));
        }
    };
    let (points_name, array) = members.remove(main);
    let three = |name: &str, array: &Array| {
        let rows = array.rows_of_three();
        rows.ok_or_else(|| shape_error(source, name, array, "(N, 3)"))
    };
    let points = three(&points_name, &array)?;
    let mut normals = None;
    let mut attributes = Vec::new();
    for (name, member) in members {
        if name == "normals" {
            let rows = three(&name, &member)?;
            if rows.len() != points.len() {
                let problem = format!("{} normals for {} points", rows.len(), points.len());
                return Err(source.error(Location::Array(name), problem));
            }
            normals = Some(rows);
        } else if let Some(components) = components_per_row(&member, points.len()) {
            attributes.push(Attribute {
                name,
                components,
                values: member.values,
            });
        }
    }
    let geometry = Geometry {
        normals,
        attributes,
        ..Geometry::from_points(points, array.dtype, Format::Npz)
    };
    checked(source, geometry, &points_name)
}

/// Number of values per row of an array with `rows` rows.
fn components_per_row(array: &Array, rows: usize) -> Option<usize> {
    match array.shape[..] {
        [n] if n == rows => Some(1),
        [n, components] if n == rows && (1..=MAX_COMPONENTS).contains(&components) => {
            Some(components)
        }
        _ => None,
    }
}

/// Refuses points, from the array `name`, and normals that are not finite.
fn checked(source: &Source, geometry: Geometry, name: &str) -> Result<Geometry, Error> {
    let normals = geometry.normals.as_deref().unwrap_or_default();
    source.check_rows(name, "point", &geometry.points)?;
    source.check_rows("normals", "normal", normals)?;
    Ok(geometry)
}

fn shape_error(source: &Source, name: &str, array: &Array, wanted: &str) -> Error {
    let problem = format!("the shape is {:?}, not {wanted}", array.shape);
    source.error(Location::Array(name.into()), problem)
}

/// Reads a field: `sdf` `(nx, ny, nz)`, `origin` `(3,)` and `spacing`.
pub(crate) fn read_field(source: &Source) -> Result<FieldFile, Error> {
    let mut members = read_members(source)?;
    let mut get = |name: &str| {
        let at = members.iter().position(|(n, _)| n == name).ok_or_else(|| {
            let problem =
                format!("the array '{name}' is missing; a field has 'sdf', 'origin' and 'spacing'");
            source.error(Location::Whole, problem)
        })?;
        Ok(members.swap_remove(at).1)
    };
    let (sdf, origin, spacing) = (get("sdf")?, get("origin")?, get("spacing")?);
    let [nx, ny, nz] = sdf.shape[..] else {
        return Err(shape_error(source, "sdf", &sdf, "(nx, ny, nz)"));
    };
    let [x, y, z] = origin.values[..] else {
        return Err(shape_error(source, "origin", &origin, "(3,)"));
    };
    let [h] = spacing.values[..] else {
        return Err(shape_error(source, "spacing", &spacing, "one number"));
    };
    let (origin, shape) = ([x, y, z], [nx, ny, nz]);
    field_file(origin, h, shape, sdf.values, sdf.dtype, Format::Npz)
        .map_err(|problem| source.error(Location::Array("sdf".into()), problem))
}

/// Reads every array of an archive, by its name without `.npy`.
fn read_members(source: &Source) -> Result<Vec<(String, Array)>, Error> {
    let broken = |problem: String| source.error(Location::Whole, problem);
    let mut archive = ZipArchive::new(Cursor::new(source.bytes.as_slice()))
        .map_err(|e| broken(format!("the archive is damaged: {e}; write it again")))?;
    let mut members = Vec::new();
    let mut room = MAX_EXPANSION * source.bytes.len() as u64;
    for index in 0..archive.len() {
        let member = archive
            .by_index(index)
            .map_err(|e| broken(format!("member {index} of the archive is damaged: {e}")))?;
        let name = member
            .name()
            .map_err(|e| broken(format!("a name is damaged: {e}")))?;
        let name = name.trim_end_matches(".npy").to_string();
        let at_member = |problem| source.error(Location::Array(name.clone()), problem);
        // Grows with the unpacked data, not with the size that the archive declares.
        let mut bytes = Vec::new();
        member
            .take(room)
            .read_to_end(&mut bytes)
            .map_err(|e| at_member(format!("the array is damaged: {e}; write it again")))?;
        room -= bytes.len() as u64;
        if room == 0 {
            return Err(broken(
                "the archive unpacks to more than its size allows".into(),
            ));
        }
        match Array::parse(&bytes) {
            Ok(array) => members.push((name, array)),
            // An archive may hold other members, such as text; they are skipped.
            Err(error) if bytes.starts_with(MAGIC) && !error.problem.contains(UNSUPPORTED) => {
                return Err(at_member(format!("byte {}: {}", error.byte, error.problem)));
            }
            Err(_) => {}
        }
    }
    Ok(members)
}

/// Writes `points`, `normals` if there are any, and one array per attribute.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    write_archive(out, |archive| {
        let n = cloud.len();
        archive.add("points", &[n, 3], cloud.points().as_flattened())?;
        if let Some(normals) = cloud.normals() {
            archive.add("normals", &[n, 3], normals.as_flattened())?;
        }
        let mut names = vec!["points".to_string(), "normals".to_string()];
        for attribute in cloud.attributes() {
            let shape = [n, attribute.components];
            let axes = if attribute.components == 1 { 1 } else { 2 };
            let mut name = attribute.name.clone();
            while names.contains(&name) {
                name.push('_');
            }
            archive.add(&name, &shape[..axes], &attribute.values)?;
            names.push(name);
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
struct Archive<'a, W: Write>(ZipWriter<StreamWriter<FirstError<'a, W>>>);

impl<W: Write> Archive<'_, W> {
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
    content: impl FnOnce(&mut Archive<W>) -> io::Result<()>,
) -> io::Result<()> {
    let mut error = None;
    {
        let error = &mut error;
        let mut archive = Archive(ZipWriter::new_stream(FirstError { out, error }));
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
