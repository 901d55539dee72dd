//! Valid files give what stands in them.

mod common;

use common::{npy, npz, source};
use isograd_io::{Content, Dtype, Error, Format, Geometry, parse_field, parse_geometry};

fn geometry(format: Format, bytes: impl Into<Vec<u8>>) -> Geometry {
    parse_geometry(&source("file", bytes), format).expect("valid")
}

const SQUARE: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

#[test]
fn every_valid_file_is_read() {
    for (name, format, bytes) in common::valid_files() {
        let source = source(name, bytes);
        if name.starts_with("sdf") {
            let file = parse_field(&source, format).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(file.field.grid().shape(), [3, 4, 5], "{name}");
        } else {
            let file = parse_geometry(&source, format).unwrap_or_else(|e| panic!("{e}"));
            assert!(file.points.len() >= 3, "{name}: {file:?}");
        }
    }
}

#[test]
fn ascii_ply_keeps_attributes_skips_lists_and_cuts_polygons() {
    let file = geometry(Format::Ply, common::ASCII_PLY);
    assert_eq!(file.points[3], [0.0, 1.5, 0.0]);
    assert_eq!(file.attributes.len(), 1);
    assert_eq!(file.attributes[0].name, "red");
    assert_eq!(file.attributes[0].values, [255.0, 0.0, 12.0, 3.0]);
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
    assert_eq!(file.dtype, Dtype::Text);
    // The last line may lack its end.
    assert_eq!(geometry(Format::Ply, common::ASCII_PLY.trim_end()), file);
}

#[test]
fn big_endian_ply_with_carriage_returns_is_read() {
    let file = geometry(Format::Ply, common::big_endian_ply());
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
    let file = geometry(Format::Text, common::CSV);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
    assert_eq!(file.attributes[0].name, "temperature");
}

#[test]
fn obj_counts_from_one_and_back_from_the_last() {
    let file = geometry(Format::Obj, common::OBJ);
    assert_eq!(file.points, SQUARE);
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    let other = common::OBJ.replace("2//2", "2//1");
    assert_eq!(geometry(Format::Obj, other).normals, None);
}

#[test]
fn stl_corners_are_merged_where_they_are_equal() {
    let file = geometry(Format::Stl, common::ASCII_STL);
    assert_eq!(file.points, [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]]);
    assert_eq!(file.faces, [[0, 1, 2], [1, 3, 2]]);
}

#[test]
fn binary_stl_may_begin_with_solid() {
    let mesh = common::tetrahedron::<f32>();
    let mut bytes = common::written("m.stl", |p| isograd_io::write_mesh(p, &mesh));
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
    let c: Vec<u8> = (0..6).flat_map(|i: i16| i.to_le_bytes()).collect();
    let file = geometry(
        Format::Npy,
        npy(
            "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 3), }\n",
            &c,
        ),
    );
    assert_eq!(file.points, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
    let fortran: Vec<u8> = [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]
        .iter()
        .flat_map(|x: &f64| x.to_be_bytes())
        .collect();
    let file = geometry(
        Format::Npy,
        npy(
            "{'descr': '>f8', 'fortran_order': True, 'shape': (2, 3), }\n",
            &fortran,
        ),
    );
    assert_eq!(file.points, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
    assert_eq!(file.dtype, Dtype::F64);
    let file = geometry(
        Format::Npy,
        npy(
            "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 6), }\n",
            &[1, 2, 3, 0, 0, 1],
        ),
    );
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]]));
}

#[test]
fn an_archive_gives_points_normals_and_attributes() {
    let header =
        |shape: &str| format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}\n");
    let array = |shape: &str, data: &[u8]| npy(&header(shape), data);
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
    // One array alone needs no name.
    let file = geometry(
        Format::Npz,
        npz(&[("xyz.npy", array("(1, 3)", &[1, 2, 3]))], false),
    );
    assert_eq!(file.points, [[1.0, 2.0, 3.0]]);
}

#[test]
fn vtp_strips_turn_every_second_triangle() {
    let file = geometry(Format::Vtp, common::ASCII_VTP);
    assert_eq!(file.faces, [[0, 1, 2], [0, 1, 2], [2, 1, 3]]);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    assert_eq!(file.attributes[0].name, "heat");
}

#[test]
fn vtp_written_by_vtk_is_read_packed_or_not() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.25]];
    for text in [common::BINARY_VTP, common::ZLIB_VTP] {
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

#[test]
fn the_kind_of_content_is_found() {
    let folder = tempfile::tempdir().expect("temporary folder");
    for (name, _, bytes) in common::valid_files() {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("writes");
        let content = isograd_io::read(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            matches!(content, Content::Field(_)),
            name.starts_with("sdf"),
            "{name}"
        );
    }
}

#[test]
fn a_name_that_the_content_contradicts_is_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let refused = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("writes");
        let error = isograd_io::read_geometry(&path).expect_err("refused");
        assert!(matches!(error, Error::Format { .. }), "{error:?}");
        error.to_string()
    };
    assert!(refused("a.xyz", common::ASCII_PLY.as_bytes()).contains("rename it to end in .ply"));
    assert!(refused("a.npy", b"1 2 3\n").contains("does not begin as NPY does"));
    assert!(refused("a.dat", common::ASCII_PLY.as_bytes()).contains("content is PLY"));
    assert!(refused("a.dat", b"1 2 3\n").contains(".ply, .xyz"));
    assert!(refused("a", b"1 2 3\n").contains("format is unknown"));
    assert!(refused("a.vti", common::ASCII_VTP.as_bytes()).contains("content is VTP"));
}
