//! Clouds and fields as NumPy arrays.

use std::io::{self, Cursor, Read, Write};

use isograd::data::Attribute;
use isograd::{Field, PointCloud, Real};
use zip::ZipArchive;

use super::archive::Archive;
use super::array::{Array, write};
use crate::error::{Error, Place};
use crate::field::{FieldFile, field};
use crate::format::Format;
use crate::geometry::{Geometry, refuse_not_finite};
use crate::source::Source;

/// The widest array that is kept as an attribute.
const MOST_COMPONENTS: usize = 64;

/// Deflate makes nothing more than 1032 times smaller; an archive that gives more repeats itself.
const MOST_EXPANSION: u64 = 1032;

/// Reads one `(N, 3)` or `(N, 6)` array; six columns are points and normals.
pub(crate) fn read_npy(source: &Source) -> Result<Geometry, Error> {
    let array = Array::parse(&source.bytes)
        .map_err(|bad| source.error(Place::Byte(bad.byte), bad.problem))?;
    let (points, normals) = if array.shape.len() == 2 && array.shape[1] == 6 {
        let half = |from: usize| {
            let rows = array.values.chunks_exact(6);
            rows.map(|r| [r[from], r[from + 1], r[from + 2]]).collect()
        };
        (half(0), Some(half(3)))
    } else {
        let rows = array.rows_of_three().ok_or_else(|| {
            let problem = format!(
                "the array's shape is {:?}, not (N, 3) or (N, 6)",
                array.shape
            );
            source.error(Place::Whole, problem)
        })?;
        (rows, None)
    };
    let geometry = Geometry {
        points,
        normals,
        attributes: Vec::new(),
        faces: Vec::new(),
        dtype: array.dtype,
        format: Format::Npy,
    };
    checked(source, geometry, "points", "normals")
}

/// Reads an archive with the array `points`, or with one array alone; `normals` and any other array
/// with a row per point are kept.
pub(crate) fn read_npz(source: &Source) -> Result<Geometry, Error> {
    let mut members = read_members(source)?;
    let main = match members.iter().position(|(name, _)| name == "points") {
        Some(main) => main,
        None if members.len() == 1 => 0,
        None => {
            let names: Vec<&str> = members.iter().map(|(name, _)| name.as_str()).collect();
            let problem = format!(
                "no array is called 'points', and there is more than one: {names:?}; rename one"
            );
            return Err(source.error(Place::Whole, problem));
        }
    };
    let (points_name, array) = members.remove(main);
    let three = |name: &str, array: &Array| {
        array.rows_of_three().ok_or_else(|| {
            let problem = format!("the shape is {:?}, not (N, 3)", array.shape);
            source.error(Place::Member(name.into()), problem)
        })
    };
    let points = three(&points_name, &array)?;
    let mut normals = None;
    let mut attributes = Vec::new();
    for (name, member) in members {
        if name == "normals" {
            let rows = three(&name, &member)?;
            if rows.len() != points.len() {
                let problem = format!("{} normals for {} points", rows.len(), points.len());
                return Err(source.error(Place::Member(name), problem));
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
        points,
        normals,
        attributes,
        faces: Vec::new(),
        dtype: array.dtype,
        format: Format::Npz,
    };
    checked(source, geometry, &points_name, "normals")
}

/// How many values an array has for each of `rows` points, if it has any.
fn components_per_row(array: &Array, rows: usize) -> Option<usize> {
    match array.shape[..] {
        [n] if n == rows => Some(1),
        [n, components] if n == rows && (1..=MOST_COMPONENTS).contains(&components) => {
            Some(components)
        }
        _ => None,
    }
}

fn checked(
    source: &Source,
    geometry: Geometry,
    points: &str,
    normals: &str,
) -> Result<Geometry, Error> {
    let check = |name: &str, what: &str, rows: &[[f64; 3]]| {
        rows.iter().enumerate().try_for_each(|(index, &row)| {
            let place = Place::Row {
                name: name.into(),
                index,
            };
            refuse_not_finite(what, row).map_err(|problem| source.error(place, problem))
        })
    };
    check(points, "point", &geometry.points)?;
    check(
        normals,
        "normal",
        geometry.normals.as_deref().unwrap_or_default(),
    )?;
    Ok(geometry)
}

/// Reads a field: `sdf` `(nx, ny, nz)`, `origin` `(3,)` and `spacing`.
pub(crate) fn read_field(source: &Source) -> Result<FieldFile, Error> {
    let mut members = read_members(source)?;
    let mut get = |name: &str| {
        let at = members.iter().position(|(n, _)| n == name).ok_or_else(|| {
            let problem =
                format!("no array is called '{name}'; a field is 'sdf', 'origin' and 'spacing'");
            source.error(Place::Whole, problem)
        })?;
        Ok(members.swap_remove(at).1)
    };
    let (sdf, origin, spacing) = (get("sdf")?, get("origin")?, get("spacing")?);
    let shape_error = |name: &str, array: &Array, wanted: &str| {
        let problem = format!("the shape is {:?}, not {wanted}", array.shape);
        source.error(Place::Member(name.into()), problem)
    };
    let [nx, ny, nz] = sdf.shape[..] else {
        return Err(shape_error("sdf", &sdf, "(nx, ny, nz)"));
    };
    let [x, y, z] = origin.values[..] else {
        return Err(shape_error("origin", &origin, "(3,)"));
    };
    let [h] = spacing.values[..] else {
        return Err(shape_error("spacing", &spacing, "one number"));
    };
    field(
        [x, y, z],
        h,
        [nx, ny, nz],
        sdf.values,
        sdf.dtype,
        Format::Npz,
    )
    .map_err(|problem| source.error(Place::Member("sdf".into()), problem))
}

/// Every array of an archive, by its name without `.npy`.
fn read_members(source: &Source) -> Result<Vec<(String, Array)>, Error> {
    let broken = |problem: String| source.error(Place::Whole, problem);
    let mut archive = ZipArchive::new(Cursor::new(source.bytes.as_slice()))
        .map_err(|e| broken(format!("the archive is damaged: {e}; write it again")))?;
    let mut members = Vec::new();
    let mut room = MOST_EXPANSION * source.bytes.len() as u64;
    for index in 0..archive.len() {
        let member = archive
            .by_index(index)
            .map_err(|e| broken(format!("member {index} of the archive is damaged: {e}")))?;
        let name = member
            .name()
            .map_err(|e| broken(format!("a name is damaged: {e}")))?;
        let name = name.trim_end_matches(".npy").to_string();
        let place = || Place::Member(name.clone());
        // Grows with what really comes out, not with what the archive says.
        let mut bytes = Vec::new();
        member
            .take(room)
            .read_to_end(&mut bytes)
            .map_err(|e| source.error(place(), format!("it is damaged: {e}; write it again")))?;
        room -= bytes.len() as u64;
        if room == 0 {
            return Err(broken(
                "the archive unpacks to more than its size allows".into(),
            ));
        }
        match Array::parse(&bytes) {
            Ok(array) => members.push((name, array)),
            // An archive may hold other things, such as text; only numbers are looked at.
            Err(bad) if bytes.starts_with(b"\x93NUMPY") && !bad.problem.contains("is not read") => {
                let problem = format!("byte {}: {}", bad.byte, bad.problem);
                return Err(source.error(place(), problem));
            }
            Err(_) => {}
        }
    }
    Ok(members)
}

/// Writes `points`, `normals` where there are any, and one array per attribute.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    let mut archive = Archive::new(out);
    let n = cloud.len();
    let points = cloud.points().as_flattened();
    archive.add("points.npy", |out| write(out, &[n, 3], points))?;
    if let Some(normals) = cloud.normals() {
        archive.add("normals.npy", |out| {
            write(out, &[n, 3], normals.as_flattened())
        })?;
    }
    let mut names = vec!["points".to_string(), "normals".to_string()];
    for attribute in cloud.attributes() {
        let shape = [n, attribute.components];
        let shape = if attribute.components == 1 {
            &shape[..1]
        } else {
            &shape[..]
        };
        let mut name = attribute.name.clone();
        while names.contains(&name) {
            name.push('_');
        }
        archive.add(&format!("{name}.npy"), |out| {
            write(out, shape, &attribute.values)
        })?;
        names.push(name);
    }
    archive.finish()
}

/// Writes `sdf`, `origin` (the position of sample `[0, 0, 0]`) and `spacing`.
pub(crate) fn write_field<T: Real>(out: &mut impl Write, field: &Field<T>) -> io::Result<()> {
    let grid = field.grid();
    let (origin, spacing) = (grid.center_f64([0; 3]), grid.spacing().f64());
    let mut archive = Archive::new(out);
    archive.add("sdf.npy", |out| write(out, &grid.shape(), field.values()))?;
    archive.add("origin.npy", |out| write(out, &[3], &origin))?;
    archive.add("spacing.npy", |out| write(out, &[], &[spacing]))?;
    archive.finish()
}
