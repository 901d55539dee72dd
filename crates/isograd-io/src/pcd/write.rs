//! Binary PCD.

use std::io::{self, Write};

use isograd::{PointCloud, Real};

use super::{NORMAL, PACKED, PADDING};
use crate::bytes::{size, write_reals};
use crate::columns::{column_names, row};

/// Writes a cloud in its own order: points, normals and attributes of type `T`. An attribute of several
/// components becomes the fields `name_0`, `name_1` and so on.
pub(crate) fn write_cloud<T: Real>(out: &mut impl Write, cloud: &PointCloud<T>) -> io::Result<()> {
    let reserved = [PACKED[0], PACKED[1], PADDING];
    let names = column_names(cloud, char::is_ascii_graphic, &NORMAL, &reserved)?;
    let each = |word: &str| vec![word; names.len()].join(" ");
    writeln!(
        out,
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7"
    )?;
    writeln!(out, "FIELDS {}", names.join(" "))?;
    writeln!(out, "SIZE {}", each(&size::<T>().to_string()))?;
    writeln!(out, "TYPE {}\nCOUNT {}", each("F"), each("1"))?;
    writeln!(
        out,
        "WIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0",
        cloud.len()
    )?;
    writeln!(out, "POINTS {}\nDATA binary", cloud.len())?;
    write_reals(out, (0..cloud.len()).flat_map(|i| row(cloud, i)))
}
