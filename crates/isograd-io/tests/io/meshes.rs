//! OFF and GLB: content, and damaged or hostile files.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use isograd::Mesh;
use isograd_io::{Dtype, Format};

use crate::files::{self, SQUARE, geometry, parse_in_bounds, refused, source};

const OFF: &str = include_str!("../corpus/mesh.off");
const GLB: &[u8] = include_bytes!("../corpus/mesh.glb");

#[test]
fn off_is_read_with_comments_polygons_and_a_keyword_glued_to_the_counts() {
    let file = geometry(Format::Off, OFF);
    assert_eq!(file.points, SQUARE);
    assert_eq!(file.faces, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    for head in ["OFF4 2 0\n", "OFF 4 2 0\n", "4 2 0\n", "OFF\n4 2\n"] {
        let text = OFF.replace("OFF\n4 2 0\n", head);
        assert_eq!(geometry(Format::Off, text), file, "{head}");
    }
    assert!(geometry(Format::Off, "OFF\n0 0 0\n").points.is_empty());
}

#[test]
fn vertices_of_off_have_normals_and_colors_if_the_keyword_says_so() {
    let file = geometry(Format::Off, include_str!("../corpus/colors.off"));
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
    let names: Vec<&str> = file.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["red", "green", "blue", "alpha"]);
    assert_eq!(file.attributes[3].values, [255.0, 255.0, 128.0]);
    let file = geometry(Format::Off, "STCOFF\n1 0 0\n1 2 3 0.5 0.25 1 0 1\n");
    assert_eq!(
        (file.attributes.len(), file.attributes[2].values[0]),
        (3, 1.0)
    );
}

#[test]
fn normals_and_colors_of_off_may_have_either_order() {
    // Geomview has normals before colors, MeshLab colors before normals, whose length is not 1.
    let [colors, normals] = [[255.0, 255.0, 0.0, 255.0], [6.5, 0.0, -2.0, 0.0]];
    let geomview = "1 2 3 6.5 0 -2 255 255 0 255\n";
    let mesh_lab = "1 2 3 255 255 0 255 6.5 0 -2\n";
    let either = "1 2 3 0 0 1 1 0 0 1\n";
    for (keyword, rows) in [
        ("CNOFF", [geomview, either]),
        ("NCOFF", [geomview, either]),
        ("NCOFF", [either, geomview]),
        ("NCOFF", [mesh_lab, mesh_lab]),
    ] {
        let file = geometry(Format::Off, format!("{keyword}\n2 0 0\n{}", rows.concat()));
        let row = usize::from(rows[0] == either);
        let normal = file.normals.expect("normals")[row];
        assert_eq!(normal, normals[..3], "{keyword} {rows:?}");
        let found: Vec<f64> = file.attributes.iter().map(|a| a.values[row]).collect();
        assert_eq!(found, colors, "{keyword} {rows:?}");
        assert_eq!(file.attributes[0].name, "red");
    }
    let file = geometry(Format::Off, format!("NCOFF\n1 0 0\n{either}"));
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]]));
    let file = geometry(
        Format::Off,
        "NCSTOFF\n1 0 0\n1 2 3 255 9 8 0 0 1.5 0.5 0.5\n",
    );
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.5]]));
    refused(Format::Off, "NCNOFF\n1 0 0\n1 2 3\n", &["line 1", "NCOFF"]);
}

#[test]
fn damaged_off_files_are_refused_with_their_line() {
    let bad = |from: &str, to: &str, parts: &[&str]| {
        refused(Format::Off, OFF.replacen(from, to, 1), parts);
    };
    bad("OFF", "BALL", &["line 2", "'BALL'"]);
    bad("OFF\n", "OFF BINARY\n", &["line 2", "save it as text"]);
    bad("4 2 0", "4", &["line 3", "numbers of vertices"]);
    for count in ["4000000000", "18446744073709551615"] {
        bad("4 2 0", &format!("{count} 2 0"), &["line 3", "cut short"]);
        bad("4 2 0", &format!("4 {count} 0"), &["line 3", "cut short"]);
        bad(
            "3 0 1 2",
            &format!("{count} 0 1 2"),
            &["line 9", "more than the line holds"],
        );
    }
    bad("4 2 0", "5 2 0", &["line 9", "the vertex has 7 numbers"]);
    bad("4 2 0", "4 3 0", &["line 10", "2 of 3 faces", "cut short"]);
    bad("1 1 0", "1 inf 0", &["line 7", "not finite"]);
    bad("1 1 0", "1 one 0", &["line 7", "'one' is not a number"]);
    bad("0 0 0", "0 0 0 255 0 0", &["line 5", "6 numbers", "COFF"]);
    bad("3 0 1 2", "3 0 1 4", &["line 9", "'4'", "0 to 3"]);
    bad("3 0 1 2", "3 0 -1 2", &["line 9", "'-1'"]);
    bad("3 0 1 2 255 0 0", "4   0 1 2", &["line 9", "too few"]);
    bad("3 0 1 2", "2 0 1 2", &["line 9", "2 corners"]);
    refused(Format::Off, "OFF\n", &["cut short"]);
    refused(Format::Off, "# nothing\n", &["cut short"]);
}

#[test]
fn a_glb_is_read_in_the_frame_of_its_scene() {
    // Twice as large, turned by 90 degrees around z, and moved by 10.
    let file = geometry(Format::Glb, GLB);
    for (point, [x, y, z]) in file.points.iter().zip(SQUARE) {
        let expected = [10.0 - 2.0 * y, 2.0 * x, 2.0 * z];
        let error = point.iter().zip(expected).map(|(a, b)| (a - b).abs());
        // Roundings of a quaternion.
        assert!(error.fold(0.0, f64::max) < 1e-14, "{point:?}");
    }
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.attributes.len(), 3);
    assert_eq!(file.attributes[1].values, [0.0, 1.0, 0.0, 0.2]);
    assert_eq!(file.dtype, Dtype::F32);
}

/// The corpus file with other text in its JSON, whose length is adapted.
fn edited(from: &str, to: &str) -> Vec<u8> {
    let length = u32::from_le_bytes(*GLB[12..].first_chunk().expect("a length")) as usize;
    let json = std::str::from_utf8(&GLB[20..20 + length]).expect("text");
    assert!(json.contains(from), "{from}");
    glb(&json.replacen(from, to, 1), &GLB[28 + length..])
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let json = format!(
        "{json}{}",
        " ".repeat(json.len().next_multiple_of(4) - json.len())
    );
    let word = |n: usize| (n as u32).to_le_bytes();
    let total = word(28 + json.len() + binary.len());
    let head = [b"glTF", &word(2)[..], &total, &word(json.len()), b"JSON"].concat();
    [
        &head[..],
        json.as_bytes(),
        &word(binary.len()),
        b"BIN\0",
        binary,
    ]
    .concat()
}

#[test]
fn mirrored_nodes_strips_and_fans_keep_the_orientation() {
    let rotation = r#""rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,2,2]"#;
    let file = geometry(Format::Glb, edited(rotation, r#""scale":[1,1,-1]"#));
    assert_eq!(file.faces, [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(file.normals, Some(vec![[0.0, 0.0, -1.0]; 4]));
    let matrix = r#""matrix":[1,0,0,0,0,2,0,0,0,0,1,0,5,6,7,1]"#;
    let file = geometry(Format::Glb, edited(rotation, matrix));
    assert_eq!(file.points[2], [16.0, 8.0, 7.0]);
    let file = geometry(Format::Glb, edited(r#""indices":3"#, r#""mode":5"#));
    assert_eq!(file.faces, [[0, 1, 2], [1, 3, 2]]);
    let file = geometry(Format::Glb, edited(r#""indices":3"#, r#""mode":6"#));
    assert_eq!(file.faces, [[0, 1, 2], [0, 2, 3]]);
    let file = geometry(Format::Glb, edited(r#""indices":3"#, r#""mode":0"#));
    assert_eq!((file.points.len(), file.faces.len()), (4, 0));
}

#[test]
fn nodes_share_meshes_and_parts_share_vertices() {
    let file = geometry(
        Format::Glb,
        edited(r#""children":[1]"#, r#""children":[1],"mesh":0"#),
    );
    assert_eq!((file.points.len(), file.faces.len()), (8, 4));
    assert_eq!(file.points[4 - 4], [10.0, 0.0, 0.0]);
    let part = r#"{"attributes":{"POSITION":0,"NORMAL":1,"COLOR_0":2},"indices":3}"#;
    let file = geometry(Format::Glb, edited(part, &format!("{part},{part}")));
    assert_eq!((file.points.len(), file.faces.len()), (4, 4));
    // Without scenes, the nodes without a parent are shown; without nodes, all meshes.
    let file = geometry(Format::Glb, GLB);
    let scenes = r#""scene":0,"scenes":[{"nodes":[0]}],"#;
    assert_eq!(geometry(Format::Glb, edited(scenes, "")), file);
    let nodes = r#""scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[1],"translation":[10,0,0]},{"mesh":0,"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,2,2]}],"#;
    assert_eq!(geometry(Format::Glb, edited(nodes, "")).points, SQUARE);
    // A part without normals: there are none for the mesh.
    let plain = r#"{"attributes":{"POSITION":0},"indices":3}"#;
    let file = geometry(Format::Glb, edited(part, &format!("{part},{plain}")));
    assert_eq!((file.points.len(), file.normals), (8, None));
    assert!(file.attributes.is_empty());
}

#[test]
fn damaged_glb_files_are_refused() {
    let bad = |from: &str, to: &str, parts: &[&str]| refused(Format::Glb, edited(from, to), parts);
    for count in ["4000000000", "18446744073709551615"] {
        bad(
            r#""count":4"#,
            &format!(r#""count":{count}"#),
            &["accessor 0", "cut short"],
        );
        bad(
            r#""count":6"#,
            &format!(r#""count":{count}"#),
            &["accessor 3", "cut short"],
        );
        bad(
            r#""byteLength":48"#,
            &format!(r#""byteLength":{count}"#),
            &["accessor 0"],
        );
        bad(
            r#""byteOffset":48"#,
            &format!(r#""byteOffset":{count}"#),
            &["accessor 1"],
        );
        bad(
            r#""buffer":0"#,
            &format!(r#""byteStride":{count},"buffer":0"#),
            &["accessor 0"],
        );
        bad(
            r#""indices":3"#,
            &format!(r#""indices":{count}"#),
            &["only 4 accessors"],
        );
        bad(
            r#""nodes":[0]"#,
            &format!(r#""nodes":[{count}]"#),
            &["node", "missing"],
        );
        bad(
            r#""mesh":0"#,
            &format!(r#""mesh":{count}"#),
            &["mesh", "missing"],
        );
    }
    bad(
        r#""children":[1]"#,
        r#""children":[0]"#,
        &["node 0", "two parents"],
    );
    bad(
        r#""children":[1]"#,
        r#""children":[1,1]"#,
        &["node 1", "two parents"],
    );
    bad(
        r#""scene":0"#,
        r#""scene":7"#,
        &["default scene is missing"],
    );
    bad(
        r#""count":6"#,
        r#""count":-6"#,
        &["JSON part is damaged", "line 1"],
    );
    bad(
        r#""count":4"#,
        r#""count":3"#,
        &["accessor 1", "4 values for 3 vertices"],
    );
    bad(
        r#""type":"VEC3""#,
        r#""type":"VEC2""#,
        &["accessor 0", "'VEC2'"],
    );
    bad("5123", "5130", &["accessor 3", "5130"]);
    bad(
        r#""byteLength":124"#,
        r#""byteLength":124,"uri":"a.bin""#,
        &["another file"],
    );
    bad(
        r#""componentType":5126"#,
        r#""sparse":{},"componentType":5126"#,
        &["sparse"],
    );
    let draco = r#""extensionsRequired":["KHR_draco_mesh_compression"],"scene":0"#;
    bad(
        r#""scene":0"#,
        draco,
        &["KHR_draco_mesh_compression", "without compression"],
    );
    refused(Format::Glb, &GLB[..GLB.len() - 1], &["cut short"]);
    refused(Format::Glb, &GLB[..100], &["byte 12", "cut short"]);
    refused(Format::Glb, &GLB[..12], &["JSON part is missing"]);
    let at = |at: usize, bytes: &[u8]| {
        let mut file = GLB.to_vec();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    refused(Format::Glb, at(4, &[1]), &["byte 4", "version 1"]);
    let data = GLB.len() - 124;
    refused(
        Format::Glb,
        at(data + 12, &f32::NAN.to_le_bytes()),
        &["accessor 0", "row 1", "not finite"],
    );
    refused(
        Format::Glb,
        at(data + 112, &[9, 0]),
        &["accessor 3", "row 0", "vertex 9", "there are 4"],
    );
}

/// The corpus file with its numbers in the JSON, in an address with this beginning.
fn with_data(beginning: &str, data: impl Fn(&str) -> String) -> Vec<u8> {
    let length = "\"byteLength\":124";
    let text = data(&STANDARD.encode(&GLB[GLB.len() - 124..]));
    let edited = edited(length, &format!("{length},\"uri\":\"{beginning}{text}\""));
    edited[..edited.len() - 132].to_vec()
}

#[test]
fn a_glb_may_have_its_numbers_in_the_document() {
    let same = |text: &str| text.to_string();
    for beginning in ["application/octet-stream", "application/gltf-buffer", ""] {
        let beginning = format!("data:{beginning};base64,");
        for data in [
            same,
            |text: &str| text.trim_end_matches('=').into(),
            |text: &str| text.replace('/', "\\/"),
        ] {
            let mut file = with_data(&beginning, data);
            let size = file.len() as u32;
            file[8..12].copy_from_slice(&size.to_le_bytes());
            assert_eq!(geometry(Format::Glb, file), geometry(Format::Glb, GLB));
        }
    }
    let base64 = "data:application/octet-stream;base64,";
    let bad = |file: Vec<u8>, parts: &[&str]| refused(Format::Glb, file, parts);
    bad(
        with_data(base64, |text| text.replacen('A', "!", 1)),
        &["buffer 0", "not base64", "damaged"],
    );
    bad(
        with_data(base64, |text| text[..60].into()),
        &["accessor 0", "cut short"],
    );
    bad(with_data("data:", same), &["buffer 0", "not base64"]);
    bad(
        with_data("data:text/plain,", same),
        &["buffer 0", "binary part"],
    );
    bad(with_data("", same), &["another file"]);
}

#[test]
fn documents_that_ask_for_much_memory_or_work_are_refused() {
    // Many nodes with one mesh of many empty parts.
    let nodes = r#"{"mesh":0},"#.repeat(20_000);
    let parts = r#"{"attributes":{},"mode":1},"#.repeat(20_000);
    let all: Vec<String> = (0..20_000).map(|i| i.to_string()).collect();
    let json = format!(
        r#"{{"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{}]}}]}}"#,
        all.join(","),
        nodes.trim_end_matches(','),
        parts.trim_end_matches(',')
    );
    refused(Format::Glb, glb(&json, &[]), &["--max-memory"]);
    for unit in ["{},", "{\"matrix\":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]},"] {
        let nodes = unit.repeat((4 << 20) / unit.len());
        let json = format!(r#"{{"nodes":[{}]}}"#, nodes.trim_end_matches(','));
        // Refused or not, the memory is bounded.
        drop(parse_in_bounds(
            &source("nodes.glb", glb(&json, &[])),
            Format::Glb,
        ));
    }
}

#[test]
fn meshes_come_back_from_glb_in_single_precision() {
    let mesh = files::tetrahedron::<f32>();
    let bytes = files::mesh_file::<f32>("m.glb");
    assert_eq!(bytes.len() % 4, 0);
    let back = geometry(Format::Glb, bytes).mesh::<f32>().expect("valid");
    assert_eq!(back, mesh);
    let doubles = geometry(Format::Glb, files::mesh_file::<f64>("m.glb"));
    assert_eq!(doubles.mesh::<f32>().expect("valid").faces(), mesh.faces());
    let write = |vertices: Vec<[f64; 3]>, faces: Vec<[u32; 3]>| {
        let mesh = Mesh::new(vertices, faces).expect("valid");
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("m.glb");
        isograd_io::write_mesh(&path, &mesh).map(|()| std::fs::read(path).expect("is there"))
    };
    let huge = write(vec![[1e300; 3]; 3], vec![[0, 1, 2]]).expect_err("refused");
    assert!(huge.to_string().contains("single precision"), "{huge}");
    let empty = write(vec![[1.0; 3]], vec![]).expect("writes");
    assert!(geometry(Format::Glb, empty).points.is_empty());
}
