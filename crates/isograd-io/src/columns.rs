//! Point clouds as tables with named columns, shared by the PLY and text readers and writers.

use std::io;

use isograd::data::Attribute;
use isograd::{PointCloud, Real};

use crate::colors::{CHANNELS, byte_colors};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::limits::Memory;
use crate::names::{MAX_COLUMNS, UniqueNames, is_normal};
use crate::number::Dtype;
use crate::options::NotFinite;
use crate::source::Input;

/// Points, normals and attributes collected row by row.
pub(crate) struct PointTable {
    xyz: [usize; 3],
    normal: Option<[usize; 3]>,
    /// Column of each attribute.
    extra: Vec<usize>,
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    attributes: Vec<Attribute<f64>>,
    not_finite: NotFinite,
}

impl PointTable {
    /// `names` holds the name of every column, `None` for a column that is skipped; the columns of
    /// `xyz` and `normal` are those of the coordinates. Memory is reserved for `rows` rows.
    pub fn new(
        input: &Input,
        names: &[Option<&str>],
        xyz: [usize; 3],
        normal: Option<[usize; 3]>,
        rows: usize,
    ) -> Result<Self, String> {
        let memory = &input.memory;
        let is_vector = |c: usize| xyz.contains(&c) || normal.is_some_and(|n| n.contains(&c));
        let mut extra = Vec::new();
        let mut attributes = Vec::new();
        for (column, name) in names.iter().enumerate() {
            if let Some(name) = name.filter(|name| !is_vector(column) && input.options.keeps(name))
            {
                extra.push(column);
                attributes.push(attribute(name, memory.with_capacity(rows)?));
            }
        }
        Ok(Self {
            xyz,
            normal,
            extra,
            points: memory.with_capacity(rows)?,
            normals: memory.with_capacity(normal.map_or(0, |_| rows))?,
            attributes,
            not_finite: input.options.not_finite,
        })
    }

    /// Appends a row, which has a value for every column.
    pub fn push(&mut self, memory: &Memory, row: &[f64]) -> Result<(), String> {
        let point = self.xyz.map(|column| row[column]);
        self.not_finite.check("point", point)?;
        memory.make_room(&mut self.points, 1)?;
        self.points.push(point);
        if let Some(columns) = self.normal {
            let normal = columns.map(|column| row[column]);
            self.not_finite.check("normal", normal)?;
            memory.make_room(&mut self.normals, 1)?;
            self.normals.push(normal);
        }
        for (attribute, &column) in self.attributes.iter_mut().zip(&self.extra) {
            memory.make_room(&mut attribute.values, 1)?;
            attribute.values.push(row[column]);
        }
        Ok(())
    }

    /// `(N, 3)` points of the rows so far.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Makes the attributes `red`, `green` and `blue` of normals that are colors: whole numbers from 0
    /// to 255, some of them above 1.
    pub fn reinterpret_normals_as_colors(&mut self, memory: &Memory) -> Result<(), String> {
        let is_byte = |v: &f64| v.fract() == 0.0 && (0.0..=255.0).contains(v);
        let mut values = self.normals.iter().flatten();
        if values.clone().all(is_byte) && values.any(|v| *v > 1.0) {
            self.normal = None;
            for (axis, name) in ["red", "green", "blue"].into_iter().enumerate() {
                let mut values = memory.with_capacity(self.normals.len())?;
                values.extend(self.normals.iter().map(|normal| normal[axis]));
                self.attributes.push(attribute(name, values));
            }
        }
        Ok(())
    }

    pub fn into_geometry(self, dtype: Dtype, format: Format) -> Geometry {
        Geometry {
            normals: self.normal.map(|_| self.normals),
            attributes: self.attributes,
            ..Geometry::from_points(self.points, dtype, format)
        }
    }
}

fn attribute(name: &str, values: Vec<f64>) -> Attribute<f64> {
    Attribute {
        name: name.into(),
        components: 1,
        values,
    }
}

/// Names of the components of a normal in most formats.
pub(crate) const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// Columns of three names, if all are there.
pub(crate) fn find_columns(names: &[Option<&str>], wanted: [&str; 3]) -> Option<[usize; 3]> {
    let [x, y, z] = wanted.map(|name| names.iter().position(|n| *n == Some(name)));
    Some([x?, y?, z?])
}

/// Names of a cloud's columns in a file: unique, with `_` in place of characters that are not
/// `allowed`. An attribute of several components has the columns `name_0`, `name_1` and so on, a [color](byte_colors) has
/// `red`, `green` and `blue`. No name of an attribute is `reserved`, or one that readers take for normals.
///
/// # Errors
/// More columns than readers accept.
pub(crate) fn column_names<T: Real>(
    cloud: &PointCloud<T>,
    allowed: fn(&char) -> bool,
    normals: &[&str; 3],
    reserved: &[&str],
) -> io::Result<Vec<String>> {
    let has_normals = cloud.normals().is_some();
    let count: usize = cloud.attributes().iter().map(|a| a.components).sum();
    let count = 3 + if has_normals { 3 } else { 0 } + count;
    if count > MAX_COLUMNS {
        let problem =
            format!("{count} columns, more than the {MAX_COLUMNS} that this format holds");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let mut unique = UniqueNames::default();
    let mut names = Vec::with_capacity(count);
    let fixed = [&["x", "y", "z"], normals];
    for name in fixed
        .into_iter()
        .take(1 + usize::from(has_normals))
        .flatten()
    {
        names.push(unique.add(name, |_| true));
    }
    let is_allowed = |name: &str| (has_normals || !is_normal(name)) && !reserved.contains(&name);
    let attributes = cloud.attributes();
    for (attribute, is_color) in attributes.iter().zip(byte_colors(attributes)) {
        let plain = attribute.name.replace(|c| !allowed(&c), "_");
        for component in 0..attribute.components {
            let name = match (plain.as_str(), attribute.components) {
                (_, 2..) if is_color => CHANNELS[component].to_string(),
                ("", _) => format!("attribute_{component}"),
                (plain, 1) => plain.to_string(),
                (plain, _) => format!("{plain}_{component}"),
            };
            names.push(unique.add(&name, is_allowed));
        }
    }
    Ok(names)
}

/// Values of point `i`, in the order of [`column_names`].
pub(crate) fn row<T: Real>(cloud: &PointCloud<T>, i: usize) -> impl Iterator<Item = T> {
    let normal = cloud.normals().map(|normals| normals[i]);
    let attributes = cloud.attributes().iter().flat_map(move |attribute| {
        let n = attribute.components;
        attribute.values[i * n..(i + 1) * n].iter().copied()
    });
    let vectors = cloud.points()[i]
        .into_iter()
        .chain(normal.into_iter().flatten());
    vectors.chain(attributes)
}
