//! The data of a PCD file.

use super::header::{Column, Encoding, Header};
use super::lzf;
use crate::columns::PointTable;
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::lines::{Lines, number, quoted, words};
use crate::number::{Endian, Number};
use crate::source::Input;

/// Reads a PCD file. Points whose coordinates are all NaN are missing ones of an organized cloud, and are skipped.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let header = Header::parse(input)?;
    let bad = |problem: String| input.error(Location::Whole, problem);
    let (xyz, normal) = header.vectors().map_err(bad)?;
    let table = PointTable::new(input, &header.names(), xyz, normal, header.points);
    let mut rows = Rows {
        input,
        xyz,
        table: table.map_err(bad)?,
        row: vec![0.0; header.columns.len()],
    };
    match header.encoding {
        Encoding::Ascii => rows.read_text(&header)?,
        Encoding::Binary => rows.read_binary(&header, &input.bytes[header.body..], header.body)?,
        Encoding::Compressed => {
            let unpacked = unpack(&header, input)
                .map_err(|problem| input.error(Location::Byte(header.body), problem))?;
            rows.read_binary(&header, &unpacked, header.body)?;
        }
    }
    Ok(rows.table.into_geometry(header.dtype(xyz), Format::Pcd))
}

/// Points read so far.
struct Rows<'a> {
    input: &'a Input<'a>,
    xyz: [usize; 3],
    table: PointTable,
    /// Values of a point.
    row: Vec<f64>,
}

impl Rows<'_> {
    fn push(&mut self) -> Result<(), String> {
        if self.xyz.iter().all(|&column| self.row[column].is_nan()) {
            return Ok(());
        }
        self.table.push(&self.input.memory, &self.row)
    }

    fn read_text(&mut self, header: &Header) -> Result<(), Error> {
        let mut lines = Lines::from(self.input.bytes, header.body, header.lines);
        for index in 0..header.points {
            let Some((line_number, line)) = lines.next_filled() else {
                let problem = format!(
                    "the file ends after {index} of {} points; it is cut short",
                    header.points
                );
                return Err(self.input.error(Location::Line(lines.number), problem));
            };
            self.read_line(header, line)
                .and_then(|()| self.push())
                .map_err(|problem| self.input.error(Location::Line(line_number), problem))?;
        }
        Ok(())
    }

    /// Reads the numbers of a line.
    fn read_line(&mut self, header: &Header, line: &[u8]) -> Result<(), String> {
        let mut columns = self.row.iter_mut().zip(&header.columns).peekable();
        let mut count = 0;
        for (index, word) in words(line).enumerate() {
            if index == header.words {
                let word = quoted(word);
                return Err(format!(
                    "the line has more numbers than the header lists: {word}"
                ));
            }
            count += 1;
            let mut value = None;
            while let Some((place, column)) = columns.next_if(|(_, c)| c.word == index) {
                let value = match value {
                    Some(value) => value,
                    None => *value.insert(number(word)?),
                };
                *place = match column.shift {
                    Some(shift) => channel(packed(column.number, value), shift),
                    None => value,
                };
            }
        }
        match count == header.words {
            true => Ok(()),
            false => Err("the line has too few numbers".into()),
        }
    }

    /// Reads points from binary data, which begin at byte `offset` of the file.
    fn read_binary(&mut self, header: &Header, data: &[u8], offset: usize) -> Result<(), Error> {
        for index in 0..header.points {
            for (place, column) in self.row.iter_mut().zip(&header.columns) {
                // The header's counts were checked against the size of the data.
                *place = value(column, data, index).unwrap_or(f64::NAN);
            }
            self.push().map_err(|problem| {
                let byte = match header.encoding {
                    Encoding::Compressed => offset,
                    _ => offset + index * header.row,
                };
                let name = "point".into();
                self.input
                    .error(Location::Element { name, index, byte }, problem)
            })?;
        }
        Ok(())
    }
}

fn value(column: &Column, data: &[u8], index: usize) -> Option<f64> {
    let bytes = data.get(column.base + index * column.stride..)?;
    match column.shift {
        // As single precision it may be a NaN, whose bits need not last.
        Some(shift) => {
            let bits = Number::U32.read(bytes, Endian::Little)?;
            Some(channel(bits as u32, shift))
        }
        None => column.number.read(bytes, Endian::Little),
    }
}

fn channel(bits: u32, shift: u32) -> f64 {
    f64::from(bits >> shift & 0xff)
}

/// Bits of a packed color in text, written in this type.
fn packed(number: Number, value: f64) -> u32 {
    match number {
        Number::F32 => (value as f32).to_bits(),
        _ => value as i64 as u32,
    }
}

/// Unpacks the data: one field after the other. Their sizes were checked with the header.
fn unpack(header: &Header, input: &Input) -> Result<Vec<u8>, String> {
    let data = &input.bytes[header.body..];
    let packed = data
        .first_chunk()
        .map_or(0, |size| u32::from_le_bytes(*size)) as usize;
    let rest = data.get(8..).unwrap_or_default();
    let packed = rest.get(..packed).ok_or_else(|| {
        format!(
            "{packed} bytes of compressed data are declared, but only {} are left; the file is cut short",
            rest.len()
        )
    })?;
    let mut out = input.memory.filled(header.row * header.points)?;
    lzf::decompress(packed, &mut out)?;
    Ok(out)
}
