//! Damaged and hostile files: an error that names the location, and bounded memory.

use std::path::Path;

use isograd_io::{
    Error, Format, NotFinite, ReadOptions, check_output, parse_field, parse_geometry,
};

use crate::files::{self, ASCII_PLY, assert_says, npy, npz, refused, source};

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
            refused(
                Format::Ply,
                ply(format, count, 0, b"0 0 0"),
                &["line 3", "declares", "cut short"],
            );
        }
    }
    refused(
        Format::Ply,
        ply("ascii", 1, 1 << 40, b"0 0 0\n"),
        &["line 7", "'face'"],
    );
    let mut stl = vec![0; 80];
    stl.extend(u32::MAX.to_le_bytes());
    stl.extend([0; 50]);
    refused(Format::Stl, stl, &["byte 80", "4294967295 triangles"]);
    let array = npy("<f4", false, "(4611686018427387904, 3)", &[0; 24]);
    refused(Format::Npy, array.clone(), &["cut short"]);
    refused(
        Format::Npz,
        npz(&[("points.npy", array)], false),
        &["array 'points'", "cut short"],
    );
    let vtp = files::ASCII_VTP.replace("NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000\"");
    refused(Format::Vtp, vtp, &["12 values for 4000000000 points"]);
    let vti = String::from_utf8_lossy(&vti_header("0 99999 0 99999 0 99999")).into_owned();
    refused(Format::Vti, vti, &["array 'sdf'", "cut short"]);
    refused(
        Format::Text,
        "5\n0 0 0\n1 1 1\n",
        &["line 1", "declares 5 rows"],
    );
}

fn vti_header(extent: &str) -> Vec<u8> {
    let bytes = files::VTI;
    // The data are not text: only the head is changed.
    let head = bytes
        .windows(2)
        .position(|w| w == b"\n_")
        .expect("appended data")
        + 1;
    let mut text = String::from_utf8_lossy(&bytes[..=head])
        .replace("0 5 0 6 0 7", extent)
        .into_bytes();
    text.extend(8u64.to_le_bytes());
    text.extend([0; 8]);
    text
}

#[test]
fn list_counts_of_the_largest_number() {
    let mut data = vec![0; 12];
    data.extend(u32::MAX.to_le_bytes());
    refused(
        Format::Ply,
        ply("binary_little_endian", 1, 1, &data),
        &["face 0", "4294967295 items", "at most 0"],
    );
    refused(
        Format::Ply,
        ply("ascii", 1, 1, b"0 0 0\n4294967295 0 0 0\n"),
        &["line 11", "4294967295 items"],
    );
    refused(
        Format::Ply,
        ply("ascii", 1, 1, b"0 0 0\n-1 0 0 0\n"),
        &["line 11", "-1 items"],
    );
}

#[test]
fn coordinates_that_are_not_finite() {
    for bad in ["nan", "NaN", "inf", "-inf", "1e999"] {
        let data = format!("0 0 0\n0 {bad} 0\n");
        refused(
            Format::Ply,
            ply("ascii", 2, 0, data.as_bytes()),
            &["line 11", "not finite", "isograd clean", "drop_not_finite"],
        );
        refused(Format::Text, data.clone(), &["line 2", "not finite"]);
        refused(Format::Obj, format!("v 0 0 0\nv 1 {bad} 0\n"), &["line 2"]);
        let stl = files::ASCII_STL.replacen("vertex 1 0 0", &format!("vertex 1 {bad} 0"), 1);
        refused(Format::Stl, stl, &["line 5", "not finite"]);
        let vtp = files::ASCII_VTP.replace("1 0 0 0 1 0 1 1 0", &format!("1 0 0 0 {bad} 0 1 1 0"));
        refused(Format::Vtp, vtp, &["row 2", "not finite"]);
    }
    let mut data = vec![0; 12];
    data.extend([f32::NAN, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    refused(
        Format::Ply,
        ply("binary_little_endian", 2, 0, &data),
        &["vertex 1", "byte ", "not finite"],
    );
    refused(
        Format::Npy,
        npy("<f4", false, "(2, 3)", &data),
        &["row 1", "not finite"],
    );
    let normals = "0 0 0 0 0 1\n1 0 0 nan 0 1\n";
    refused(Format::Text, normals, &["line 2", "normal"]);
}

#[test]
fn numbers_that_are_not_finite_are_kept_on_request() {
    let read = |format: Format, text: &str, not_finite: NotFinite| {
        let options = ReadOptions {
            not_finite,
            ..ReadOptions::default()
        };
        options.parse_geometry(&source("file", text), format)
    };
    let vtp = files::ASCII_VTP.replace("1 0 0 0 1 0 1 1 0", "1 0 0 0 nan 0 1 1 0");
    let stl = files::ASCII_STL.replacen("vertex 1 0 0", "vertex 1 nan 0", 1);
    for (format, text) in [
        (Format::Text, "0 0 0\n0 nan 0\n"),
        (Format::Off, "OFF\n2 0 0\n0 0 0\n0 nan 0\n"),
        (Format::Obj, "v 0 0 0\nv 1 nan 0\nv 1 1 1\nf 1 2 3\n"),
        (Format::Stl, &stl),
        (Format::Vtp, &vtp),
    ] {
        assert!(
            read(format, text, NotFinite::KeepNormals).is_err(),
            "{format:?}"
        );
        let mut file = read(format, text, NotFinite::Keep).expect("kept");
        assert_eq!(file.drop_not_finite(), 1, "{format:?}");
        assert!(file.points.iter().flatten().all(|x| x.is_finite()));
        file.mesh::<f64>()
            .expect("its faces name points that are there");
    }
    for (format, text) in [
        (Format::Text, "0 0 0 0 0 1\n1 0 0 nan 0 1\n"),
        (Format::Off, "NOFF\n2 0 0\n0 0 0 0 0 1\n1 0 0 nan 0 1\n"),
        (Format::Obj, "v 0 0 0\nv 1 0 0\nvn 0 0 1\nvn nan 0 1\n"),
    ] {
        for not_finite in [NotFinite::KeepNormals, NotFinite::Keep] {
            let mut file = read(format, text, not_finite).expect("kept");
            assert!(!file.has_finite_normals(), "{format:?}");
            assert_eq!(
                (file.drop_not_finite(), file.points.len()),
                (1, 1),
                "{format:?}"
            );
        }
    }
}

#[test]
fn files_with_few_or_no_points_are_read() {
    for n in 0..=3u64 {
        let rows = "1 2 3\n".repeat(n as usize);
        let source_of = |bytes: Vec<u8>| source("few", bytes);
        let file = parse_geometry(&source_of(ply("ascii", n, 0, rows.as_bytes())), Format::Ply);
        assert_eq!(file.expect("valid").points.len(), n as usize);
        let text = format!("# nothing else\n{rows}").into_bytes();
        let file = parse_geometry(&source_of(text), Format::Text).expect("valid");
        // The file is valid; the reconstruction refuses it if it must.
        assert_eq!(file.points, vec![[1.0, 2.0, 3.0]; n as usize]);
    }
    let zero = parse_geometry(&source("zero", "1 2 3 0 0 0\n4 5 6 0 0 0\n"), Format::Text);
    assert_eq!(zero.expect("valid").normals, Some(vec![[0.0; 3]; 2]));
}

#[test]
fn obj_indices_out_of_range() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (face, parts) in [
        ("f 0 1 2", ["line 4", "counts from 1"]),
        ("f 1 2 4", ["line 4", "only 3"]),
        ("f -4 -2 -1", ["line 4", "out of range"]),
        ("f 1 2 99999999999", ["line 4", "out of range"]),
        ("f 1 2 x", ["line 4", "'x' is not an index"]),
        ("f 1 2", ["line 4", "2 corners"]),
    ] {
        refused(Format::Obj, format!("{vertices}{face}"), &parts);
    }
    refused(Format::Obj, "hello\n", &["'v'"]);
}

#[test]
fn faces_with_missing_vertices() {
    refused(
        Format::Ply,
        ply("ascii", 1, 1, b"0 0 0\n3 0 0 7\n"),
        &["line 11", "vertex 7"],
    );
    let vtp = files::ASCII_VTP.replace("ascii\">0 1 2<", "ascii\">0 1 9<");
    refused(Format::Vtp, vtp, &["cell 0", "point 9"]);
}

#[test]
fn rows_of_wrong_length_or_content() {
    refused(Format::Text, "0 0 0\n1 1\n", &["line 2", "2 numbers"]);
    refused(Format::Text, "0 0 0\n1 1 1 1\n", &["line 2", "4 numbers"]);
    refused(Format::Text, "0 0\n", &["line 1", "x, y and z"]);
    refused(Format::Text, "x,y,z\n1,,3\n", &["line 2", "''"]);
    refused(Format::Text, "1,5;2,5;3,5\n", &["line 1", "decimal point"]);
    refused(Format::Text, "once upon\na time\n", &["line 1", "'once'"]);
    refused(Format::Text, [0xff, 0xfe, 0x00], &["line 1"]);
    let long = ASCII_PLY.replace("1 0 0 0 0\n", "1 0 0 0 0 5\n");
    refused(Format::Ply, long, &["line 15", "more numbers"]);
    let short = ASCII_PLY.replace("1 0 0 0 0\n", "1 0 0\n");
    refused(Format::Ply, short, &["line 15", "too few"]);
    let word = ASCII_PLY.replace("1 0 0 0 0\n", "1 zero 0 0 0\n");
    refused(Format::Ply, word, &["line 15", "'zero' is not a number"]);
}

#[test]
fn broken_headers() {
    refused(
        Format::Ply,
        "ply\nformat ascii 1.0\n",
        &["line 2", "end_header"],
    );
    refused(
        Format::Ply,
        "ply\nformat utf8 1.0\nend_header\n",
        &["line 2"],
    );
    refused(Format::Ply, "ply\nend_header\n", &["no 'format'"]);
    let no_z = ASCII_PLY.replace("property float z", "property float w");
    refused(Format::Ply, no_z, &["x, y, z"]);
    let twice = ASCII_PLY.replace("property double y", "property double x");
    refused(Format::Ply, twice, &["line 6", "twice"]);
    refused(Format::Npy, "\u{93}NUMPY", &["byte 0"]);
    refused(
        Format::Npy,
        npy("<f4", false, "(4,)", &[0; 16]),
        &["[4]", "(N, 3)"],
    );
    refused(
        Format::Npy,
        npy("<c16", false, "(4,)", &[0; 64]),
        &["'<c16'", "float32"],
    );
    refused(Format::Stl, "solid, but short", &["neither"]);
    refused(Format::Vtp, "<VTKFile type=\"PolyData\">", &["cut short"]);
    refused(Format::Vtp, "<VTKFile".repeat(3), &["XML"]);
    refused(Format::Vtp, "<a>".repeat(5000), &["nested"]);
    let lzma = files::ZLIB_VTP.replace("ZLib", "LZMA");
    refused(Format::Vtp, lzma, &["LZMA", "zlib"]);
    let flat =
        String::from_utf8_lossy(&vti_header("0 5 0 6 0 7")).replace("\"0.5 0.5", "\"0.25 0.5");
    refused(Format::Vti, flat, &["cubes"]);
}

#[test]
fn damaged_archives() {
    let member = npy("<f4", false, "(2, 3)", &[0; 24]);
    let good = npz(&[("points.npy", member.clone())], false);
    refused(Format::Npz, &good[..good.len() - 30], &["damaged"]);
    let mut flipped = good.clone();
    flipped[60] ^= 0xff;
    refused(Format::Npz, flipped, &["array 'points'"]);
    // A byte of the values.
    let mut flipped = good.clone();
    let values = memchr::memmem::rfind(&good, &[0; 24]).expect("the values");
    flipped[values] ^= 1;
    refused(Format::Npz, flipped, &["array 'points'", "damaged"]);
    let two = npz(&[("a.npy", member.clone()), ("b.npy", member)], true);
    refused(Format::Npz, two, &["'points'", "[\"a\", \"b\"]"]);
}

#[test]
fn no_truncated_file_causes_a_panic() {
    for (name, format, bytes) in files::valid_files() {
        for end in 0..bytes.len() {
            let source = source(&name, &bytes[..end]);
            let _ = parse_geometry(&source, format);
            let _ = parse_field(&source, format);
        }
    }
}

#[test]
fn empty_file_folder_and_missing_file() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let error = |path: &Path| isograd_io::read_geometry(path).expect_err("refused");
    for name in [
        "a.ply", "a.xyz", "a.obj", "a.stl", "a.npy", "a.npz", "a.vtp", "a.pcd", "a.pts", "a.off",
        "a.glb", "a.las",
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
fn outputs_that_cannot_be_written_are_refused_early() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let check = |name: &str| {
        let path = folder.path().join(name);
        check_output(&path, isograd_io::MESH_EXTENSIONS).map_err(|e| e.to_string())
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
        check_output(Path::new("m.ply"), &["ply"]).map_err(drop),
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
    let (mesh, cloud, field) = (
        files::tetrahedron::<f32>(),
        files::cloud::<f32>(),
        files::field::<f64>(),
    );
    let meshes = ["m.ply", "m.obj", "m.stl", "m.off", "m.glb", "m.vtp"]
        .map(|name| isograd_io::write_mesh(&full(name), &mesh));
    let clouds = ["c.ply", "c.npz", "c.xyz", "c.pcd"]
        .map(|name| isograd_io::write_cloud(&full(name), &cloud));
    let fields = ["f.vti", "f.npz"].map(|name| isograd_io::write_field(&full(name), &field));
    for result in meshes.into_iter().chain(clouds).chain(fields) {
        let message = result.expect_err("full").to_string();
        assert_says(&message, &["cannot write", "free some space"]);
    }
}
