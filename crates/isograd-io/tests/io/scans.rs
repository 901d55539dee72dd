//! PCD, PTS, XYZN, XYZRGB and LAS: content, and damaged or hostile files.

use isograd_io::{Dtype, Format, Geometry, parse_geometry};

use crate::files::{self, geometry, refused, source};

fn corpus(name: &str) -> (Format, Vec<u8>) {
    let mut files = files::valid_files().into_iter();
    let (_, format, bytes) = files.find(|file| file.0 == name).expect("in the corpus");
    (format, bytes)
}

fn read(name: &str) -> Geometry {
    let (format, bytes) = corpus(name);
    geometry(format, bytes)
}

fn values<'a>(file: &'a Geometry, name: &str) -> &'a [f64] {
    let mut attributes = file.attributes.iter();
    let found = attributes.find(|attribute| attribute.name == name);
    &found
        .unwrap_or_else(|| panic!("no attribute {name}"))
        .values
}

/// Replaces the first occurrence of a text in a file that need not be text.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = memchr::memmem::find(bytes, from.as_bytes()).expect("is there");
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn packed_colors_of_a_pcd_are_three_attributes() {
    // 4.2108e+06 is the single-precision number with the bits 0x4A808080, rounded to five digits.
    let file = read("ascii.pcd");
    assert_eq!(file.points.len(), 3, "the last point is NaN");
    assert_eq!(file.points[1], [0.90805, 0.35641, 0.0]);
    let bits = 4.2108e6f32.to_bits();
    assert_eq!(values(&file, "red"), [f64::from(bits >> 16 & 255); 3]);
    assert_eq!(values(&file, "blue"), [f64::from(bits & 255); 3]);
    // Colors whose bits are those of a NaN.
    for name in ["binary.pcd", "packed.pcd"] {
        let file = read(name);
        let red: Vec<f64> = (0..9).map(|i| f64::from(i * 20)).collect();
        let green: Vec<f64> = (0..9).map(|i| f64::from(255 - i * 10)).collect();
        assert_eq!(values(&file, "red"), red, "{name}");
        assert_eq!(values(&file, "green"), green, "{name}");
    }
    let whole =
        "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nPOINTS 1\nDATA ascii\n1 2 3 4278255360\n";
    let file = geometry(Format::Pcd, whole);
    assert_eq!(values(&file, "green"), [255.0]);
    assert_eq!(values(&file, "red"), [0.0]);
}

#[test]
fn fields_of_a_pcd_are_normals_attributes_and_padding() {
    let file = read("binary.pcd");
    assert_eq!(file.points.len(), 9);
    assert_eq!(file.points[2][2], 0.25);
    let normal = [0.0, f64::from(0.6f32), f64::from(0.8f32)];
    assert_eq!(file.normals, Some(vec![normal; 9]));
    assert_eq!(values(&file, "curvature")[3], 1.5);
    assert_eq!(values(&file, "alpha"), [255.0; 9]);
    assert_eq!(values(&file, "histogram_1")[4], -4.0);
    assert_eq!(values(&file, "histogram_2"), [7.0; 9]);
    assert_eq!(file.attributes.len(), 4 + 1 + 3);
    assert_eq!(file.dtype, Dtype::F32);
    let packed = read("packed.pcd");
    assert_eq!(packed.points, file.points);
    assert_eq!(values(&packed, "intensity"), [3.0; 9]);
}

#[test]
fn damaged_pcd_files_are_refused_with_their_place() {
    let (_, ascii) = corpus("ascii.pcd");
    let (_, binary) = corpus("binary.pcd");
    let (_, packed) = corpus("packed.pcd");
    let bad = |bytes: &[u8], from: &str, to: &str, parts: &[&str]| {
        refused(Format::Pcd, replaced(bytes, from, to), parts);
    };
    for count in ["4000000000", "18446744073709551615"] {
        let both = replaced(&ascii, "WIDTH 4", &format!("WIDTH {count}"));
        bad(
            &both,
            "POINTS 4",
            &format!("POINTS {count}"),
            &["line 10", "cut short"],
        );
        let both = replaced(&binary, "WIDTH 3\nHEIGHT 3", &format!("WIDTH {count}"));
        bad(
            &both,
            "POINTS 9",
            &format!("POINTS {count}"),
            &["line 9", "cut short"],
        );
        let both = replaced(&packed, "WIDTH 9", &format!("WIDTH {count}"));
        bad(&both, "POINTS 9", &format!("POINTS {count}"), &["bad.file"]);
        bad(&binary, "1 4 1", &format!("1 {count} 1"), &["bad.file"]);
        bad(&ascii, "COUNT 1", &format!("COUNT {count}"), &["bad.file"]);
    }
    bad(&ascii, "POINTS 4", "POINTS 5", &["WIDTH times HEIGHT"]);
    bad(
        &ascii,
        "POINTS 4",
        "POINTS four",
        &["line 10", "'four'", "not a count"],
    );
    bad(&ascii, "SIZE 4 4", "SIZE 4", &["differ in length"]);
    bad(&ascii, "TYPE F", "TYPE Q", &["field 'x'", "'Q'"]);
    bad(
        &ascii,
        "FIELDS x",
        "FIELDS w",
        &["lacks one of the fields x, y, z"],
    );
    bad(
        &ascii,
        "DATA ascii",
        "DATA zip",
        &["line 11", "binary_compressed"],
    );
    bad(
        &ascii,
        "VERSION",
        "WORD",
        &["line 2", "not a line of a PCD header"],
    );
    bad(&ascii, "0.93773", "inf", &["line 12", "not finite"]);
    bad(&ascii, "0.93773", "0 0", &["line 12", "more numbers"]);
    bad(&ascii, "0.93773 ", "", &["line 12", "too few"]);
    bad(
        &ascii,
        "0.93773",
        "zero",
        &["line 12", "'zero' is not a number"],
    );
    refused(Format::Pcd, &ascii[..96], &["no 'DATA' line"]);
    refused(
        Format::Pcd,
        &ascii[..229],
        &["line 13", "2 of 4 points", "cut short"],
    );
    refused(
        Format::Pcd,
        &binary[..binary.len() - 1],
        &["line 10", "9 points"],
    );
    refused(
        Format::Pcd,
        &packed[..packed.len() - 1],
        &["compressed data", "cut short"],
    );
    let data = memchr::memmem::find(&packed, b"compressed\n").expect("data") + 11;
    let mut sizes = packed.clone();
    sizes[data + 4..data + 8].fill(0xff);
    refused(Format::Pcd, sizes, &["4294967295 bytes", "9 points"]);
    let mut reference = packed.clone();
    reference[data + 8] = 0xff;
    refused(Format::Pcd, reference, &["damaged"]);
}

#[test]
fn a_pcd_that_unpacks_to_much_more_than_its_size_is_refused() {
    let points = 4_000_000u32;
    let header =
        format!("FIELDS x y z\nSIZE 1 1 1\nTYPE U U U\nPOINTS {points}\nDATA binary_compressed\n");
    let mut data = vec![0, 0];
    // References of 264 bytes in 3.
    for _ in 0..3 * points / 264 + 1 {
        data.extend([7 << 5, 255, 0]);
    }
    let mut bytes = header.into_bytes();
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend((3 * points).to_le_bytes());
    bytes.extend(data);
    let error = parse_geometry(&source("big.pcd", bytes), Format::Pcd).expect_err("too large");
    assert!(error.to_string().contains("--max-memory"), "{error}");
}

#[test]
fn texts_of_scanners_name_their_columns_by_the_suffix() {
    let file = read("scan.pts");
    assert_eq!(file.points.len(), 4, "two scans");
    assert_eq!(values(&file, "intensity"), [-1200.0, 0.0, 2047.0, 1.0]);
    assert_eq!(values(&file, "blue"), [30.0, 0.0, 255.0, 4.0]);
    let file = geometry(Format::Pts, "1\n1 2 3 9\n");
    assert_eq!(values(&file, "intensity"), [9.0]);
    let file = geometry(Format::Pts, "1 2 3 0 0 1\n");
    assert_eq!(
        (file.normals.as_ref(), values(&file, "blue")),
        (None, &[1.0][..])
    );
    assert_eq!(
        geometry(Format::Pts, "1\n1 2 3\n").points,
        [[1.0, 2.0, 3.0]]
    );
    // Components that could be colors are normals, and the other way round.
    let file = geometry(Format::Xyzn, "0 0 0 0 0 3\n");
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 3.0]]));
    let file = read("colors.xyzrgb");
    assert_eq!(
        (file.normals.as_ref(), values(&file, "red")[0]),
        (None, 0.5)
    );
    assert_eq!(read("normals.xyzn").normals, Some(vec![[0.0, 1.0, 0.0]; 4]));
}

#[test]
fn damaged_texts_of_scanners_are_refused() {
    refused(
        Format::Pts,
        "5\n0 0 0\n1 1 1\n",
        &["line 1", "declares 5 rows"],
    );
    refused(
        Format::Pts,
        "1\n0 0 0\n2\n1 1 1\n",
        &["declares 3 rows", "there are 2"],
    );
    refused(
        Format::Pts,
        "2\n0 0 0\n2\n1 1 1\n",
        &["line 3", "1 numbers"],
    );
    refused(Format::Pts, "1e300\n0 0 0\n", &["cut short"]);
    refused(Format::Pts, "1\n0 0 inf\n", &["line 2", "not finite"]);
    refused(Format::Xyzn, "0 0 0\n", &["line 1", "nx, ny and nz"]);
    refused(Format::Xyzn, "0 0 0 0 0 nan\n", &["line 1", "normal"]);
    refused(Format::Xyzrgb, "0 0 0 1\n", &["line 1", "r, g and b"]);
    refused(
        Format::Xyzrgb,
        "0 0 0 1 1 1\n0 0 0\n",
        &["line 2", "3 numbers"],
    );
}

#[test]
fn las_coordinates_are_scaled_in_double_precision() {
    for name in ["scan.las", "scan14.las"] {
        let file = read(name);
        let point = |i: f64| {
            let [x, y, z] = [i * 1000.0, -i * 7.0, i * i];
            [x * 0.001 + 1000.0, y * 0.001 + 2000.0, z * 0.01 - 5.0]
        };
        assert_eq!(file.points, [0.0, 1.0, 2.0, 3.0].map(point), "{name}");
        assert_eq!(values(&file, "intensity"), [100.0, 101.0, 102.0, 103.0]);
        assert_eq!(values(&file, "red"), [0.0, 256.0, 512.0, 768.0]);
        assert_eq!(values(&file, "blue"), [65535.0; 4]);
        let class = if name == "scan.las" { 2.0 } else { 64.0 };
        assert_eq!(values(&file, "classification"), [class; 4], "{name}");
        assert_eq!(file.dtype, Dtype::F64);
    }
}

#[test]
fn damaged_las_files_are_refused() {
    for name in ["scan.las", "scan14.las"] {
        let (_, good) = corpus(name);
        let bad = |at: usize, bytes: &[u8], parts: &[&str]| {
            let mut file = good.clone();
            file[at..at + bytes.len()].copy_from_slice(bytes);
            refused(Format::Las, file, parts);
        };
        bad(0, b"LAZF", &["byte 0", "'LASF'"]);
        bad(104, &[0x83], &["byte 104", "LAZ", "laszip"]);
        bad(104, &[11], &["byte 104", "format 11"]);
        bad(105, &[1, 0], &["byte 105", "1 bytes"]);
        bad(107, &[0xff; 4], &["4294967295 points", "cut short"]);
        bad(96, &[0xff; 4], &["only 0 bytes are left"]);
        bad(131, &f64::NAN.to_le_bytes(), &["byte 131", "scale"]);
        bad(155, &f64::INFINITY.to_le_bytes(), &["byte 155", "offset"]);
        bad(131, &f64::MAX.to_le_bytes(), &["point 1", "not finite"]);
        refused(Format::Las, &good[..good.len() - 1], &["4 points"]);
        refused(Format::Las, &good[..150], &["header is cut short"]);
    }
    let (_, mut good) = corpus("scan14.las");
    good[247..255].fill(0xff);
    refused(Format::Las, good, &["18446744073709551615 points"]);
}
