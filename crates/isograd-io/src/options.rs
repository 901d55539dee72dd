//! Options of the readers.

use crate::error::Error;
use crate::format::Format;
use crate::geometry::{check_finite, is_sensor};
use crate::limits::Limits;

/// Options of the readers; see [`crate::read_geometry`] and its siblings for the defaults.
///
/// ```no_run
/// use isograd_io::{Columns, Limits, ReadOptions};
///
/// let options = ReadOptions {
///     limits: Limits { memory: Some(4 << 30) },
///     columns: Columns { points: Some(["east", "north", "up"].map(String::from)), normals: None },
///     ..ReadOptions::default()
/// };
/// let file = options.read_geometry("survey.csv".as_ref())?;
/// # Ok::<(), isograd_io::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Limits on memory.
    pub limits: Limits,
    /// Columns of text files; other formats have fixed names.
    pub columns: Columns,
    /// Attributes to keep.
    pub attributes: Attributes,
    /// Points and normals with numbers that are not finite.
    pub not_finite: NotFinite,
}

/// Columns of a text file, each by its name in the header or by its number from 1. `None`: recognized by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Columns {
    /// Columns of x, y and z.
    pub points: Option<[String; 3]>,
    /// Columns of the components of the normals.
    pub normals: Option<[String; 3]>,
}

/// Attributes that a reader keeps. Others take no memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Attributes {
    /// All.
    #[default]
    All,
    /// Sensor positions only; see [`crate::Geometry::cloud`].
    Sensors,
}

/// Points and normals with numbers that are not finite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NotFinite {
    /// Refused.
    #[default]
    Refuse,
    /// Kept in normals, refused in points: for work that may not need the normals.
    KeepNormals,
    /// Kept; see [`crate::Geometry::drop_not_finite`].
    Keep,
}

impl NotFinite {
    /// Refuses a point, or a normal, that is not finite, unless it is to be kept.
    pub(crate) fn check(self, what: &str, row: [f64; 3]) -> Result<(), String> {
        match self {
            Self::Keep => Ok(()),
            Self::KeepNormals if what == "normal" => Ok(()),
            Self::KeepNormals | Self::Refuse => check_finite(what, row),
        }
    }
}

impl Columns {
    fn is_default(&self) -> bool {
        self.points.is_none() && self.normals.is_none()
    }
}

impl ReadOptions {
    /// Whether the attribute `name` is kept.
    pub(crate) fn keeps(&self, name: &str) -> bool {
        self.attributes == Attributes::All || is_sensor(name)
    }

    /// Refuses a choice of columns in a format without columns.
    pub(crate) fn check_columns(&self, name: &str, format: Format) -> Result<(), Error> {
        if format.is_table() || self.columns.is_default() {
            return Ok(());
        }
        Err(Error::Format {
            file: name.into(),
            problem: format!(
                "columns can be chosen in text files (.csv, .xyz, .txt, .pts, .xyzn, .xyzrgb), and this is {}; leave the columns out",
                format.name()
            ),
        })
    }
}
