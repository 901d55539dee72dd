//! Valid files that unpack to much more than their size: arrays of bytes, which become numbers of eight bytes, compressed
//! or shared by many names.

use std::fmt::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use isograd_io::Format;

use crate::files::{archive, blocks};
use crate::random::Random;

/// Largest total of the values in a file, as bytes.
const MOST: usize = 1 << 26;

/// Draws a number of points and of arrays beside them.
fn counts(random: &mut Random) -> (usize, usize) {
    let points = random.power(0.0, 6.5) as usize;
    let most = (MOST / points).min(5000);
    (points, random.below(most + 1))
}

/// A file and its format.
pub fn bomb(random: &mut Random) -> (Format, Vec<u8>) {
    let (points, arrays) = counts(random);
    match random.one_in(2) {
        true => (Format::Npz, npz(points, arrays, random)),
        false => (Format::Vtp, vtp(points, arrays, random.one_in(2))),
    }
}

/// Arrays of bytes: points at 0, and attributes.
fn npz(points: usize, arrays: usize, random: &mut Random) -> Vec<u8> {
    let array = |shape: &str, length: usize| {
        let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.resize(bytes.len() + length, 0);
        bytes
    };
    let mut members = vec![(
        "points.npy".into(),
        array(&format!("({points}, 3)"), 3 * points),
    )];
    for number in 0..arrays {
        members.push((
            format!("a{number}.npy"),
            array(&format!("({points},)"), points),
        ));
    }
    archive(&members, random).unwrap_or_default()
}

/// Points at 0, and attributes that share the block of the points.
fn vtp(points: usize, arrays: usize, compressed: bool) -> Vec<u8> {
    let mut data = String::new();
    for number in 0..arrays {
        let _ = writeln!(
            data,
            r#"<DataArray type="UInt8" Name="a{number}" NumberOfComponents="3" format="appended" offset="0"/>"#
        );
    }
    let zeros = vec![0; 3 * points];
    let (compressor, block) = match compressed {
        true => (
            r#" compressor="vtkZLibDataCompressor""#,
            blocks(&zeros, 1 << 20).unwrap_or_default(),
        ),
        false => (
            "",
            STANDARD.encode([&(zeros.len() as u32).to_le_bytes(), zeros.as_slice()].concat()),
        ),
    };
    format!(
        r#"<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"{compressor}>
<PolyData><Piece NumberOfPoints="{points}">
<PointData>{data}</PointData>
<Points><DataArray type="UInt8" NumberOfComponents="3" format="appended" offset="0"/></Points>
</Piece></PolyData><AppendedData encoding="base64">_{block}</AppendedData></VTKFile>"#
    )
    .into_bytes()
}

#[cfg(test)]
mod tests {
    use isograd_io::{Source, parse_geometry};

    use super::*;

    #[test]
    fn small_bombs_are_valid_files() {
        let random = &mut Random::new(1, 0, 0);
        let (npz, vtp, packed) = (npz(20, 3, random), vtp(20, 3, false), vtp(20, 3, true));
        for (format, bytes) in [
            (Format::Npz, npz),
            (Format::Vtp, vtp),
            (Format::Vtp, packed),
        ] {
            let name = format.name().into();
            let geometry = parse_geometry(&Source { name, bytes }, format).expect("valid");
            assert_eq!((geometry.points.len(), geometry.attributes.len()), (20, 3));
        }
    }
}
