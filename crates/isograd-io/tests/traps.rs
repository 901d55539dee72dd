//! Damaged and hostile files: a clear error that names the place, and no memory on the header's word.

mod common;

use std::path::Path;
use std::sync::Mutex;

use common::{ASCII_PLY, npy, npz, source};
use isograd_io::{Error, Format, parse_field, parse_geometry};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// One at a time, so that the allocator counts one reader alone.
static ALONE: Mutex<()> = Mutex::new(());

/// The error for a file, after a check that reading it took little memory.
fn refused(format: Format, bytes: impl Into<Vec<u8>>) -> String {
    let _alone = ALONE
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let source = source("bad.file", bytes);
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let result = match format {
        Format::Vti => parse_field(&source, format).map(drop),
        _ => parse_geometry(&source, format).map(drop),
    };
    let used = ALLOCATOR.peak_usage().saturating_sub(before);
    // A number is stored in 8 bytes and can be 1 byte in a file; a line reader and an unpacker have
    // buffers of their own.
    assert!(
        used < 64 * source.bytes.len() + (1 << 20),
        "{used} bytes were allocated"
    );
    let message = result.expect_err("must be refused").to_string();
    assert!(message.starts_with("bad.file"), "{message}");
    message
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in: {message}");
    }
}

fn ply(format: &str, vertices: u64, faces: u64, data: &[u8]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nelement face {faces}\nproperty list uint int vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.extend(data);
    bytes
}

#[test]
fn header_counts_beyond_the_end() {
    for count in [2, 4_000_000_000, u64::MAX] {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let message = refused(Format::Ply, ply(format, count, 0, b"0 0 0"));
            assert_says(&message, &["line 3", "promises", "cut short"]);
        }
    }
    let message = refused(Format::Ply, ply("ascii", 1, 1 << 40, b"0 0 0\n"));
    assert_says(&message, &["line 7", "'face'"]);
    let mut stl = vec![0; 80];
    stl.extend(u32::MAX.to_le_bytes());
    stl.extend([0; 50]);
    assert_says(
        &refused(Format::Stl, stl),
        &["byte 80", "4294967295 triangles"],
    );
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4611686018427387904, 3), }\n";
    assert_says(
        &refused(Format::Npy, npy(header, &[0; 24])),
        &["byte 10", "cut short"][1..],
    );
    let member = npy(header, &[0; 24]);
    let message = refused(Format::Npz, npz(&[("points.npy", member)], false));
    assert_says(&message, &["array 'points'", "cut short"]);
    let vtp = common::ASCII_VTP.replace("NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000\"");
    assert_says(
        &refused(Format::Vtp, vtp),
        &["12 values for 4000000000 points"],
    );
    let vti = String::from_utf8_lossy(&vti_header("0 99999 0 99999 0 99999")).into_owned();
    assert_says(&refused(Format::Vti, vti), &["array 'sdf'", "cut short"]);
    assert_says(
        &refused(Format::Text, "5\n0 0 0\n1 1 1\n"),
        &["line 1", "promises 5 rows"],
    );
}

fn vti_header(extent: &str) -> Vec<u8> {
    let bytes = common::valid_files()
        .pop()
        .expect("the last one is the VTI")
        .2;
    // The data are not text: only the head is changed.
    let head = bytes
        .windows(2)
        .position(|w| w == b"\n_")
        .expect("appended data")
        + 1;
    let mut text = String::from_utf8_lossy(&bytes[..=head])
        .replace("0 2 0 3 0 4", extent)
        .into_bytes();
    text.extend(8u64.to_le_bytes());
    text.extend([0; 8]);
    text
}

#[test]
fn list_counts_of_the_largest_number() {
    let mut data = vec![0; 12];
    data.extend(u32::MAX.to_le_bytes());
    let message = refused(Format::Ply, ply("binary_little_endian", 1, 1, &data));
    assert_says(&message, &["face 0", "4294967295 items", "at most 0"]);
    let message = refused(
        Format::Ply,
        ply("ascii", 1, 1, b"0 0 0\n4294967295 0 0 0\n"),
    );
    assert_says(&message, &["line 11", "4294967295 items"]);
    let message = refused(Format::Ply, ply("ascii", 1, 1, b"0 0 0\n-1 0 0 0\n"));
    assert_says(&message, &["line 11", "-1 items"]);
}

#[test]
fn coordinates_that_are_not_finite() {
    for bad in ["nan", "NaN", "inf", "-inf", "1e999"] {
        let data = format!("0 0 0\n0 {bad} 0\n");
        let message = refused(Format::Ply, ply("ascii", 2, 0, data.as_bytes()));
        assert_says(&message, &["line 11", "not finite", "remove the point"]);
        assert_says(
            &refused(Format::Text, data.clone()),
            &["line 2", "not finite"],
        );
        assert_says(
            &refused(Format::Obj, format!("v 0 0 0\nv 1 {bad} 0\n")),
            &["line 2"],
        );
        let stl = common::ASCII_STL.replacen("vertex 1 0 0", &format!("vertex 1 {bad} 0"), 1);
        assert_says(&refused(Format::Stl, stl), &["line 5", "not finite"]);
        let vtp = common::ASCII_VTP.replace("1 0 0 0 1 0 1 1 0", &format!("1 0 0 0 {bad} 0 1 1 0"));
        assert_says(&refused(Format::Vtp, vtp), &["row 2", "not finite"]);
    }
    let mut data = vec![0; 12];
    data.extend([f32::NAN, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    let message = refused(Format::Ply, ply("binary_little_endian", 2, 0, &data));
    assert_says(&message, &["vertex 1", "byte ", "not finite"]);
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
    assert_says(
        &refused(Format::Npy, npy(header, &data)),
        &["row 1", "not finite"],
    );
    let normals = "0 0 0 0 0 1\n1 0 0 nan 0 1\n";
    assert_says(&refused(Format::Text, normals), &["line 2", "normal"]);
}

#[test]
fn files_without_points_or_with_few_are_read_as_they_are() {
    for n in 0..=3u64 {
        let rows = "1 2 3\n".repeat(n as usize);
        let source_of = |bytes: Vec<u8>| source("few", bytes);
        let file = parse_geometry(&source_of(ply("ascii", n, 0, rows.as_bytes())), Format::Ply);
        assert_eq!(file.expect("valid").points.len(), n as usize);
        let text = format!("# nothing else\n{rows}").into_bytes();
        let file = parse_geometry(&source_of(text), Format::Text).expect("valid");
        // Equal points, zero normals: the file is sound, and the method has its own say.
        assert_eq!(file.points, vec![[1.0, 2.0, 3.0]; n as usize]);
    }
    let zero = parse_geometry(&source("zero", "1 2 3 0 0 0\n4 5 6 0 0 0\n"), Format::Text);
    assert_eq!(zero.expect("valid").normals, Some(vec![[0.0; 3]; 2]));
}

#[test]
fn obj_indices_of_nothing() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (face, parts) in [
        ("f 0 1 2", ["line 4", "counts from 1"]),
        ("f 1 2 4", ["line 4", "only 3"]),
        ("f -4 -2 -1", ["line 4", "out of range"]),
        ("f 1 2 99999999999", ["line 4", "out of range"]),
        ("f 1 2 x", ["line 4", "'x' is not an index"]),
        ("f 1 2", ["line 4", "2 corners"]),
    ] {
        assert_says(&refused(Format::Obj, format!("{vertices}{face}")), &parts);
    }
    assert_says(&refused(Format::Obj, "hello\n"), &["'v'"]);
}

#[test]
fn faces_that_name_vertices_that_are_not_there() {
    let message = refused(Format::Ply, ply("ascii", 1, 1, b"0 0 0\n3 0 0 7\n"));
    assert_says(&message, &["line 11", "vertex 7"]);
    let vtp = common::ASCII_VTP.replace("ascii\">0 1 2<", "ascii\">0 1 9<");
    assert_says(&refused(Format::Vtp, vtp), &["cell 0", "point 9"]);
}

#[test]
fn rows_that_do_not_fit() {
    assert_says(
        &refused(Format::Text, "0 0 0\n1 1\n"),
        &["line 2", "2 numbers"],
    );
    assert_says(
        &refused(Format::Text, "0 0 0\n1 1 1 1\n"),
        &["line 2", "4 numbers"],
    );
    assert_says(&refused(Format::Text, "0 0\n"), &["line 1", "x, y and z"]);
    assert_says(&refused(Format::Text, "x,y,z\n1,,3\n"), &["line 2", "''"]);
    assert_says(
        &refused(Format::Text, "1,5;2,5;3,5\n"),
        &["line 1", "decimal mark"],
    );
    assert_says(
        &refused(Format::Text, "once upon\na time\n"),
        &["line 1", "'once'"],
    );
    assert_says(&refused(Format::Text, [0xff, 0xfe, 0x00]), &["line 1"]);
    let long = ASCII_PLY.replace("1 0 0 0 0\n", "1 0 0 0 0 5\n");
    assert_says(&refused(Format::Ply, long), &["line 15", "more numbers"]);
    let short = ASCII_PLY.replace("1 0 0 0 0\n", "1 0 0\n");
    assert_says(&refused(Format::Ply, short), &["line 15", "too few"]);
    let word = ASCII_PLY.replace("1 0 0 0 0\n", "1 zero 0 0 0\n");
    assert_says(
        &refused(Format::Ply, word),
        &["line 15", "'zero' is not a number"],
    );
}

#[test]
fn broken_headers() {
    assert_says(
        &refused(Format::Ply, "ply\nformat ascii 1.0\n"),
        &["line 2", "end_header"],
    );
    assert_says(
        &refused(Format::Ply, "ply\nformat utf8 1.0\nend_header\n"),
        &["line 2"],
    );
    assert_says(&refused(Format::Ply, "ply\nend_header\n"), &["no 'format'"]);
    let no_z = ASCII_PLY.replace("property float z", "property float w");
    assert_says(&refused(Format::Ply, no_z), &["x, y, z"]);
    let twice = ASCII_PLY.replace("property double y", "property double x");
    assert_says(&refused(Format::Ply, twice), &["line 6", "twice"]);
    assert_says(&refused(Format::Npy, "\u{93}NUMPY"), &["byte 0"]);
    let shape = "{'descr': '<f4', 'fortran_order': False, 'shape': (4,), }\n";
    assert_says(
        &refused(Format::Npy, npy(shape, &[0; 16])),
        &["[4]", "(N, 3)"],
    );
    let kind = "{'descr': '<c16', 'fortran_order': False, 'shape': (4,), }\n";
    assert_says(
        &refused(Format::Npy, npy(kind, &[0; 64])),
        &["'<c16'", "float32"],
    );
    assert_says(&refused(Format::Stl, "solid, but short"), &["neither"]);
    assert_says(
        &refused(Format::Vtp, "<VTKFile type=\"PolyData\">"),
        &["cut short"],
    );
    assert_says(&refused(Format::Vtp, "<VTKFile".repeat(3)), &["XML"]);
    assert_says(&refused(Format::Vtp, "<a>".repeat(5000)), &["nested"]);
    let lzma = common::ZLIB_VTP.replace("ZLib", "LZMA");
    assert_says(&refused(Format::Vtp, lzma), &["LZMA", "zlib"]);
    let flat =
        String::from_utf8_lossy(&vti_header("0 2 0 3 0 4")).replace("\"0.25 0.25", "\"0.5 0.25");
    assert_says(&refused(Format::Vti, flat), &["cubes"]);
}

#[test]
fn archives_that_repeat_themselves_or_are_damaged() {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
    let member = npy(header, &[0; 24]);
    let good = npz(&[("points.npy", member.clone())], false);
    assert_says(
        &refused(Format::Npz, &good[..good.len() - 30]),
        &["damaged"],
    );
    let mut flipped = good.clone();
    flipped[60] ^= 0xff;
    assert_says(&refused(Format::Npz, flipped), &["damaged"]);
    let two = npz(&[("a.npy", member.clone()), ("b.npy", member)], true);
    assert_says(&refused(Format::Npz, two), &["'points'", "[\"a\", \"b\"]"]);
}

#[test]
fn every_shortened_file_is_refused_or_read_in_part_never_a_panic() {
    for (name, format, bytes) in common::valid_files() {
        for end in 0..bytes.len() {
            let source = source(name, &bytes[..end]);
            let _ = parse_geometry(&source, format);
            let _ = parse_field(&source, format);
        }
    }
}

#[test]
fn an_empty_file_a_folder_and_a_missing_file() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let error = |path: &Path| isograd_io::read_geometry(path).expect_err("refused");
    for name in [
        "a.ply", "a.xyz", "a.obj", "a.stl", "a.npy", "a.npz", "a.vtp",
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, b"").expect("writes");
        assert!(matches!(error(&path), Error::Empty { .. }), "{name}");
    }
    assert!(matches!(error(folder.path()), Error::Folder { .. }));
    let message = error(&folder.path().join("none.ply")).to_string();
    assert_says(&message, &["none.ply", "check the path"]);
}

#[test]
fn outputs_that_can_not_be_written_are_refused_before_the_work() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let check = |name: &str| {
        let path = folder.path().join(name);
        isograd_io::check_output(&path, isograd_io::MESH_ENDINGS).map_err(|e| e.to_string())
    };
    assert_eq!(check("mesh.ply"), Ok(()));
    assert_says(
        &check("missing/mesh.ply").expect_err("refused"),
        &["create its folder"],
    );
    assert_says(&check("mesh.doc").expect_err("refused"), &[".ply or .obj"]);
    std::fs::create_dir(folder.path().join("is.ply")).expect("creates");
    assert_says(&check("is.ply").expect_err("refused"), &["folder"]);
    assert_eq!(
        isograd_io::check_output(Path::new("m.ply"), &["ply"]).map_err(drop),
        Ok(())
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_by_every_writer() {
    // Names on a full device: links, since the ending decides the format.
    let folder = tempfile::tempdir().expect("temporary folder");
    let full = |name: &str| {
        let path = folder.path().join(name);
        std::os::unix::fs::symlink("/dev/full", &path).expect("links");
        path
    };
    let said = |result: Result<(), Error>| {
        assert_says(
            &result.expect_err("full").to_string(),
            &["cannot write", "free some space"],
        );
    };
    for name in ["m.ply", "m.obj", "m.stl", "m.vtp"] {
        said(isograd_io::write_mesh(
            &full(name),
            &common::tetrahedron::<f32>(),
        ));
    }
    for name in ["c.ply", "c.npz", "c.xyz"] {
        said(isograd_io::write_cloud(
            &full(name),
            &common::cloud::<f32>(),
        ));
    }
    for name in ["f.vti", "f.npz"] {
        said(isograd_io::write_field(
            &full(name),
            &common::field::<f64>(),
        ));
    }
}
