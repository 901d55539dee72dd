//! Content of valid files.

use isograd_io::{Content, Dtype, Error, Format, Geometry, parse_field, parse_geometry};

use crate::files::{self, SQUARE, npy, npz, refused, source};

fn geometry(format: Format, bytes: impl Into<Vec<u8>>) -> Geometry {
    parse_geometry(&source("file", bytes), format).expect("valid")
}

#[test]
fn every_valid_file_is_read() {
    for (name, format, bytes) in files::valid_files() {
        let source = source(&name, bytes);
        if name.starts_with("sdf") {
            let file = parse_field(&source, format).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(file.field.grid().shape(), [6, 7, 8], "{name}");
        } else {
            let file = parse_geometry(&source, format).unwrap_or_else(|e| panic!("{e}"));
            assert!(file.points.len() >= 3, "{name}: {file:?}");
        }
    }
}

#[test]
fn ascii_ply_keeps_attributes_skips_lists_and_cuts_polygons() {
    let file = geometry(Format::Ply, files::ASCII_PLY);
    assert_eq!(file.points[3], [0.0, 1.5, 0.0]);
    assert_eq!(file.attributes.len(), 1);
    assert_eq!(file.attributes[0].name, "red");
    assert_eq!(file.attributes[0].values, [255.0, 0.0, 12.0, 3.0]);
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
    assert_eq!(file.dtype, Dtype::Text);
    // The last line may lack its end.
    assert_eq!(geometry(Format::Ply, files::ASCII_PLY.trim_end()), file);
}

#[test]
fn big_endian_ply_with_carriage_returns_is_read() {
    let file = geometry(Format::Ply, files::BIG_ENDIAN_PLY);
    assert_eq!(file.points, SQUARE);
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.dtype, Dtype::F64);
}

#[test]
fn a_ply_without_points_is_an_empty_cloud() {
    let text = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert!(geometry(Format::Ply, text).points.is_empty());
}

#[test]
fn text_is_read_with_any_delimiter_and_header() {
    let points = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]];
    for text in [
        "1 2 3\n4 5 6.5",
        "1\t2\t3\r\n4\t5\t6.5\r\n",
        "1,2,3\n4, 5, 6.5\n",
        "1;2;3;\n4;5;6.5;\n",
        "\u{feff}x,y,z\n1,2,3\n4,5,6.5\n",
        "\"X\";\"Y\";\"Z\"\n1;2;3\n4;5;6.5\n",
        "# comment\n\n// another\n1 2 3\n# between\n4 5 6.5\n",
        "2\n1 2 3\n4 5 6.5\n",
        "z,x,y\n3,1,2\n6.5,4,5\n",
        "# z x y\n3 1 2\n6.5 4 5\n",
        "1e0 2.0 +3\n4 5 0.65e1\n",
    ] {
        let file = geometry(Format::Text, text);
        assert_eq!(file.points, points, "{text:?}");
        assert_eq!(file.normals, None, "{text:?}");
    }
}

#[test]
fn six_columns_are_normals_unless_they_are_colors() {
    let file = geometry(Format::Text, "0 0 0 0 0 1\n1 0 0 0 0.6 0.8\n");
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]));
    let file = geometry(Format::Text, "0 0 0 255 0 1\n1 0 0 0 6 8\n");
    assert_eq!(file.normals, None);
    assert_eq!(file.attributes[0].name, "red");
    assert_eq!(file.attributes[2].values, [1.0, 8.0]);
    let file = geometry(Format::Text, files::CSV);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
    assert_eq!(file.attributes[0].name, "temperature");
}

#[test]
fn obj_counts_from_one_and_back_from_the_last() {
    let file = geometry(Format::Obj, files::OBJ);
    assert_eq!(file.points, SQUARE);
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    let other = files::OBJ.replace("2//2", "2//1");
    assert_eq!(geometry(Format::Obj, other).normals, None);
}

#[test]
fn stl_corners_are_merged_where_they_are_equal() {
    let file = geometry(Format::Stl, files::ASCII_STL);
    assert_eq!(file.points, [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]]);
    assert_eq!(file.faces, [[0, 1, 2], [1, 3, 2]]);
}

#[test]
fn binary_stl_may_begin_with_solid() {
    let mut bytes = files::mesh_file::<f32>("m.stl");
    let header = b"solid facet vertex";
    bytes[..header.len()].copy_from_slice(header);
    let file = geometry(Format::Stl, bytes.clone());
    assert_eq!((file.points.len(), file.faces.len()), (4, 4));
    assert_eq!(file.dtype, Dtype::F32);
    // Some programs add bytes behind the triangles.
    bytes[..header.len()].copy_from_slice(b"exported by a tool");
    bytes.extend([0; 7]);
    assert_eq!(geometry(Format::Stl, bytes), file);
}

#[test]
fn arrays_are_read_in_either_order_and_of_any_number_type() {
    let rows = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]];
    let c: Vec<u8> = (0..6).flat_map(|i: i16| i.to_le_bytes()).collect();
    let file = geometry(Format::Npy, npy("<i2", false, "(2, 3)", &c));
    assert_eq!(file.points, rows);
    let fortran = [0.0, 3.0, 1.0, 4.0, 2.0, 5.0];
    let fortran: Vec<u8> = fortran.iter().flat_map(|x: &f64| x.to_be_bytes()).collect();
    let file = geometry(Format::Npy, npy(">f8", true, "(2, 3)", &fortran));
    assert_eq!(
        (file.points.as_slice(), file.dtype),
        (&rows[..], Dtype::F64)
    );
    let file = geometry(
        Format::Npy,
        npy("|u1", false, "(1, 6)", &[1, 2, 3, 0, 0, 1]),
    );
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]]));
}

#[test]
fn an_archive_gives_points_normals_and_attributes() {
    let array = |shape: &str, data: &[u8]| npy("|u1", false, shape, data);
    let members = [
        ("points.npy", array("(2, 3)", &[0, 0, 0, 1, 0, 0])),
        ("normals.npy", array("(2, 3)", &[0, 0, 1, 0, 0, 1])),
        ("heat.npy", array("(2,)", &[7, 9])),
        ("other.npy", array("(5,)", &[0; 5])),
        ("note.txt", b"not an array".to_vec()),
    ];
    let file = geometry(Format::Npz, npz(&members, true));
    assert_eq!(file.points.len(), 2);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 2]));
    assert_eq!(file.attributes.len(), 1);
    assert_eq!(file.attributes[0].values, [7.0, 9.0]);
    // A single array may have any name.
    let single = [("xyz.npy", array("(1, 3)", &[1, 2, 3]))];
    assert_eq!(
        geometry(Format::Npz, npz(&single, false)).points,
        [[1.0, 2.0, 3.0]]
    );
}

#[test]
fn vtp_strips_turn_every_second_triangle() {
    let file = geometry(Format::Vtp, files::ASCII_VTP);
    assert_eq!(file.faces, [[0, 1, 2], [0, 1, 2], [2, 1, 3]]);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    assert_eq!(file.attributes[0].name, "heat");
}

#[test]
fn vtp_written_by_vtk_is_read_packed_or_not() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.25]];
    for text in [files::BINARY_VTP, files::ZLIB_VTP] {
        let file = geometry(Format::Vtp, text);
        assert_eq!(file.points, points);
        assert_eq!(file.faces, [[0, 1, 2]]);
        assert_eq!(file.dtype, Dtype::F32);
    }
}

#[test]
fn cell_data_of_an_image_sit_half_a_cell_in() {
    let text = r#"<VTKFile type="ImageData"><ImageData WholeExtent="0 2 0 2 0 2" Origin="1 2 3" Spacing="2 2 2">
<Piece Extent="0 2 0 2 0 2"><CellData><DataArray type="Float32" Name="d" format="ascii">0 1 2 3 4 5 6 7</DataArray>
</CellData></Piece></ImageData></VTKFile>"#;
    let file = parse_field(&source("file", text), Format::Vti).expect("valid");
    assert_eq!(file.field.grid().origin(), [2.0, 3.0, 4.0]);
    assert_eq!(file.field.at([1, 0, 0]), 1.0);
    assert_eq!(file.field.at([0, 0, 1]), 4.0);
}

/// Writes a file to a temporary folder and reads it.
fn read_file<R>(name: &str, bytes: &[u8], read: impl FnOnce(&std::path::Path) -> R) -> R {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("writes");
    read(&path)
}

#[test]
fn the_kind_of_content_is_detected() {
    for (name, _, bytes) in files::valid_files() {
        let content = read_file(&name, &bytes, isograd_io::read).unwrap_or_else(|e| panic!("{e}"));
        let is_field = matches!(content, Content::Field(_));
        assert_eq!(is_field, name.starts_with("sdf"), "{name}");
    }
}

#[test]
fn a_name_that_contradicts_the_content_is_refused() {
    for (name, bytes, part) in [
        ("a.xyz", files::ASCII_PLY, "rename it to end in .ply"),
        ("a.npy", "1 2 3\n", "does not begin as NPY does"),
        ("a.dat", files::ASCII_PLY, "content is PLY"),
        ("a.dat", "1 2 3\n", ".ply, .xyz"),
        ("a", "1 2 3\n", "format is unknown"),
        ("a.vti", files::ASCII_VTP, "content is VTP"),
    ] {
        let error = read_file(name, bytes.as_bytes(), isograd_io::read_geometry);
        let error = error.expect_err("refused");
        assert!(matches!(error, Error::Format { .. }), "{error:?}");
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn compressed_files_and_utf_16_are_refused_with_a_remedy() {
    let gzip = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0];
    let utf_16 = [0xff, 0xfe, b'1', 0, b' ', 0];
    for (name, bytes, part) in [
        ("a.csv.gz", &gzip[..], "gunzip"),
        ("a.ply", &gzip, "gunzip"),
        ("a.xyz", b"BZh91AY&SY", "bunzip2"),
        ("a.csv", &utf_16, "UTF-8"),
        ("a.obj", &utf_16, "UTF-8"),
    ] {
        let error = read_file(name, bytes, isograd_io::read_geometry).expect_err("refused");
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn keywords_of_stl_may_have_upper_case() {
    let text = include_str!("../corpus/mesh_ascii.stl");
    let upper = geometry(Format::Stl, text.to_uppercase());
    assert_eq!(upper, geometry(Format::Stl, text));
}

#[test]
fn properties_of_ply_may_have_the_names_that_columns_of_text_have() {
    let file = |names: [&str; 6]| {
        let properties = names.map(|name| format!("property double {name}\n"));
        let head = "ply\nformat ascii 1.0\nelement vertex 1\n";
        let text = format!("{head}{}end_header\n1 2 3 4 5 6\n", properties.concat());
        geometry(Format::Ply, text)
    };
    for names in [
        ["X", "Y", "Z", "NX", "NY", "NZ"],
        [
            "pos_x", "pos_y", "pos_z", "normal_x", "normal_y", "normal_z",
        ],
    ] {
        let file = file(names);
        assert_eq!(file.points, [[1.0, 2.0, 3.0]]);
        assert_eq!(file.normals, Some(vec![[4.0, 5.0, 6.0]]));
    }
    let file = file(["X", "Y", "Z", "x", "y", "z"]);
    assert_eq!(file.points, [[4.0, 5.0, 6.0]]);
    assert_eq!(file.attributes.len(), 3);
}

#[test]
fn strips_of_ply_are_cut_into_triangles() {
    let file = |strips: &str| {
        let head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty int x\nproperty int y\nproperty int z\n";
        let points = "0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n";
        let list = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
        format!("{head}{list}{points}{strips}\n")
    };
    // Two equal corners lead from one part to the next; −1 ends a strip.
    let mesh = geometry(Format::Ply, file("14 0 2 1 3 3 2 2 4 3 -1 0 2 1 -1"));
    assert_eq!(mesh.faces, [[0, 2, 1], [1, 2, 3], [2, 4, 3], [0, 2, 1]]);
    refused(
        Format::Ply,
        file("4 0 2 1 5"),
        &["line 15", "vertex 5", "0 to 4"],
    );
    refused(Format::Ply, file("4 0 2 1 -2"), &["line 15", "vertex -2"]);
}
