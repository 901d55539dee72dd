//! ASPRS LAS 1.0 to 1.4, point formats 0 to 10: positions, intensity, classification and colors.
//!
//! The reader is our own: the fields that it needs have fixed places. The crate `las` keeps 100 bytes and more per point.
//! Compressed files (LAZ) are refused: the crate `laz` allocates buffers of the sizes that a file declares.

use crate::columns::PointTable;
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::number::{Dtype, Endian, Number};
use crate::source::Input;

/// Smallest record of each point format, and the offset of its colors.
const RECORDS: [(usize, Option<usize>); 11] = [
    (20, None),
    (28, None),
    (26, Some(20)),
    (34, Some(28)),
    (57, None),
    (63, Some(28)),
    (30, None),
    (36, Some(30)),
    (38, Some(30)),
    (59, None),
    (67, Some(30)),
];

/// The header of a file.
struct Header {
    points: usize,
    /// Byte offset of the points.
    start: usize,
    /// Point format.
    kind: usize,
    /// Bytes of a point.
    record: usize,
    scale: [f64; 3],
    offset: [f64; 3],
}

impl Header {
    fn parse(input: &Input) -> Result<Self, Error> {
        let short = || input.error(Location::Byte(0), "the header is cut short");
        let get = |at: usize, number: Number| {
            let rest = input.bytes.get(at..).unwrap_or_default();
            number.read(rest, Endian::Little).ok_or_else(short)
        };
        let vector = |at: usize, what: &str| {
            let v = [
                get(at, Number::F64)?,
                get(at + 8, Number::F64)?,
                get(at + 16, Number::F64)?,
            ];
            match v.iter().all(|x| x.is_finite()) {
                true => Ok(v),
                false => Err(input.error(Location::Byte(at), format!("the {what} is not finite"))),
            }
        };
        if !input.bytes.starts_with(b"LASF") {
            let problem = "the file does not begin with 'LASF'; it is not LAS";
            return Err(input.error(Location::Byte(0), problem));
        }
        let kind = get(104, Number::U8)? as usize;
        if kind & 0xc0 != 0 {
            let problem = "the points are compressed (LAZ); convert the file to LAS, for example with laszip or 'pdal translate'";
            return Err(input.error(Location::Byte(104), problem));
        }
        let record = get(105, Number::U16)? as usize;
        match RECORDS.get(kind) {
            None => {
                let problem =
                    format!("point format {kind} is not supported; convert it to one of 0 to 10");
                return Err(input.error(Location::Byte(104), problem));
            }
            Some((least, _)) if record < *least => {
                let problem = format!(
                    "a point has {record} bytes, but point format {kind} takes {least}; the header is damaged"
                );
                return Err(input.error(Location::Byte(105), problem));
            }
            _ => {}
        }
        let mut points = get(107, Number::U32)?;
        // Version 1.4 has a number of 64 bits as well.
        if get(25, Number::U8)? >= 4.0 && get(94, Number::U16)? >= 375.0 {
            points = points.max(get(247, Number::U64)?);
        }
        Ok(Self {
            points: points as usize,
            start: get(96, Number::U32)? as usize,
            kind,
            record,
            scale: vector(131, "scale")?,
            offset: vector(155, "offset")?,
        })
    }
}

/// Reads a LAS file. Coordinates are scaled in double precision.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let header = Header::parse(input)?;
    let left = input.bytes.len().saturating_sub(header.start);
    if header
        .points
        .checked_mul(header.record)
        .is_none_or(|needed| needed > left)
    {
        let problem = format!(
            "the header declares {} points of {} bytes, but only {left} bytes are left; the file is cut short or the count is wrong",
            header.points, header.record
        );
        return Err(input.error(Location::Byte(107), problem));
    }
    // Classes of the first formats share their byte with flags.
    let (class, mask) = if header.kind < 6 {
        (15, 0x1f)
    } else {
        (16, 0xff)
    };
    let colors = RECORDS[header.kind].1;
    let names = [
        "x",
        "y",
        "z",
        "intensity",
        "classification",
        "red",
        "green",
        "blue",
    ]
    .map(Some);
    let names = &names[..if colors.is_some() { 8 } else { 5 }];
    let table = PointTable::new(input, names, [0, 1, 2], None, header.points);
    let mut table = table.map_err(|problem| input.error(Location::Whole, problem))?;
    let mut row = vec![0.0; names.len()];
    let records = input.bytes.get(header.start..).unwrap_or_default();
    let records = records.chunks_exact(header.record);
    for (index, bytes) in records.take(header.points).enumerate() {
        let get = |at: usize, number: Number| {
            number
                .read(&bytes[at..], Endian::Little)
                .unwrap_or_default()
        };
        for axis in 0..3 {
            row[axis] = get(4 * axis, Number::I32) * header.scale[axis] + header.offset[axis];
        }
        row[3] = get(12, Number::U16);
        row[4] = f64::from(bytes[class] & mask);
        if let Some(at) = colors {
            for channel in 0..3 {
                row[5 + channel] = get(at + 2 * channel, Number::U16);
            }
        }
        table.push(&input.memory, &row).map_err(|problem| {
            let byte = header.start + index * header.record;
            input.error(
                Location::Element {
                    name: "point".into(),
                    index,
                    byte,
                },
                problem,
            )
        })?;
    }
    Ok(table.into_geometry(Dtype::F64, Format::Las))
}
