//! Small files that unpack to much: memory is bounded by the size of the file, and so is the work.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use isograd_io::{Error, Format, Source, parse_geometry};

use crate::files::{npy, npz, parse_within, source};

/// Default limit for a file of `bytes`.
fn limit(bytes: usize) -> u64 {
    (64 * bytes as u64).max(64 << 20)
}

/// Parses a file, and checks the memory that it takes against the limit.
fn parse(source: &Source, format: Format) -> Result<(), Error> {
    parse_within(source, format, limit(source.bytes.len()))
}

/// Checks that a file is refused for its memory, with a message that says how to go on.
fn refused(name: &str, format: Format, bytes: Vec<u8>) {
    let error = parse(&source(name, bytes), format).expect_err(name);
    let message = error.to_string();
    for part in [name, "64 MiB", "at least", "--max-memory", "max_memory"] {
        assert!(message.contains(part), "'{part}' is missing in: {message}");
    }
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).expect("packs");
    encoder.finish().expect("packs")
}

/// A VTP of `arrays` in its point data, of one component each, that share the appended block of its points.
fn shared_block(points: usize, arrays: usize, packed: bool) -> Vec<u8> {
    let block = vec![1; points];
    let compressor = match packed {
        true => r#" compressor="vtkZLibDataCompressor""#,
        false => "",
    };
    let mut file = format!(
        r#"<VTKFile type="PolyData" header_type="UInt32"{compressor}><PolyData><Piece NumberOfPoints="{}"><PointData>"#,
        points / 3
    );
    for array in 0..arrays {
        let name = format!(r#"<DataArray type="UInt8" Name="{array}" format="appended" "#);
        file.push_str(&name);
        file.push_str(r#"NumberOfComponents="3" offset="0"/>"#);
    }
    file.push_str(r#"</PointData><Points><DataArray type="UInt8" NumberOfComponents="3" "#);
    file.push_str(r#"format="appended" offset="0"/></Points></Piece></PolyData>"#);
    file.push_str(r#"<AppendedData encoding="raw">_"#);
    let mut file = file.into_bytes();
    let size = points as u32;
    if packed {
        let block = zlib(&block);
        for word in [1, size, size, block.len() as u32] {
            file.extend(word.to_le_bytes());
        }
        file.extend(block);
    } else {
        file.extend(size.to_le_bytes());
        file.extend(block);
    }
    file.extend(b"</AppendedData></VTKFile>");
    file
}

#[test]
fn arrays_that_share_a_block_count_each() {
    refused("raw.vtp", Format::Vtp, shared_block(30_000, 600, false));
    refused("packed.vtp", Format::Vtp, shared_block(300_000, 60, true));
    // A few of them are read.
    let few = source("few.vtp", shared_block(30_000, 60, true));
    let file = parse_geometry(&few, Format::Vtp).expect("valid");
    assert_eq!((file.points.len(), file.attributes.len()), (10_000, 60));
}

#[test]
fn one_block_that_unpacks_to_a_thousand_times_its_size() {
    refused("block.vtp", Format::Vtp, shared_block(12_000_000, 0, true));
    let values = vec![1; 12_000_000];
    let points = npy("|u1", false, "(4000000, 3)", &values);
    refused(
        "points.npz",
        Format::Npz,
        npz(&[("points.npy", points)], true),
    );
    let few = npy("|u1", false, "(1, 3)", &[1, 2, 3]);
    let heat = npy("|u1", false, "(1, 12000000)", &values);
    let members = [("points.npy", few), ("heat.npy", heat)];
    refused("heat.npz", Format::Npz, npz(&members, true));
}

#[test]
fn arrays_that_nobody_needs_are_not_unpacked() {
    let few = npy("|u1", false, "(2, 3)", &[1, 2, 3, 4, 5, 6]);
    let other = npy("|u1", false, "(20000000,)", &vec![1; 20_000_000]);
    let members = [("points.npy", few), ("other.npy", other)];
    let source = source("other.npz", npz(&members, true));
    let memory = allocation_counter::measure(|| {
        let file = parse_geometry(&source, Format::Npz).expect("valid");
        assert_eq!((file.points.len(), file.attributes.len()), (2, 0));
    });
    assert!(memory.bytes_total < 1 << 20, "{memory:?}");
}

/// Text of `unit`, repeated to about `size` bytes between a beginning and an end.
fn repeated(begin: &str, unit: &str, end: &str, size: usize) -> Vec<u8> {
    [begin, &unit.repeat(size / unit.len()), end]
        .concat()
        .into()
}

#[test]
fn text_that_takes_the_most_memory_per_byte_stays_in_bounds() {
    const SIZE: usize = 4 << 20;
    let vtp = r#"<VTKFile type="PolyData"><PolyData>"#;
    let array = r#"<Piece NumberOfPoints="0"><PointData><DataArray type="Int8" format="ascii">"#;
    let vtp_end = "</PolyData></VTKFile>";
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n0 0 0\n";
    let corners = SIZE / 2;
    let files: [(&str, Format, Vec<u8>); 9] = [
        (
            "nodes.vtp",
            Format::Vtp,
            repeated(vtp, "<a/>", vtp_end, SIZE),
        ),
        (
            "array.vtp",
            Format::Vtp,
            repeated(
                &format!("{vtp}{array}"),
                "1 ",
                "</DataArray></PointData></Piece></PolyData></VTKFile>",
                SIZE,
            ),
        ),
        (
            "face.ply",
            Format::Ply,
            repeated(&format!("{ply}{corners} "), "0 ", "\n", SIZE),
        ),
        (
            "face.obj",
            Format::Obj,
            repeated("v 0 0 0\nf ", "1 ", "\n", SIZE),
        ),
        (
            "joined.obj",
            Format::Obj,
            repeated("v 0 0 0\nf ", "1 \\\n", "\n", SIZE),
        ),
        (
            "faces.obj",
            Format::Obj,
            repeated("v 0 0 0\n", "f 1 1 1\n", "", SIZE),
        ),
        (
            "wide.csv",
            Format::Text,
            repeated("x,y,z", ",c", "\n", SIZE),
        ),
        ("long.xyz", Format::Text, repeated("", "0 0 0\n", "", SIZE)),
        (
            "facets.stl",
            Format::Stl,
            repeated("solid facet\n", "vertex 0 0 0\n", "", SIZE),
        ),
    ];
    for (name, format, bytes) in files {
        // An error is fine as well, such as that of too many columns.
        drop(parse(&source(name, bytes), format));
    }
    let mut attributes = String::from(vtp);
    attributes.push_str("<a ");
    for i in 0..SIZE / 12 {
        attributes.push_str(&format!("a{i}=\"\" "));
    }
    attributes.push_str(&format!("/>{vtp_end}"));
    drop(parse(&source("attributes.vtp", attributes), Format::Vtp));
}

/// Header of a PLY of one vertex with `extra` properties besides x, y and z.
fn wide_ply(extra: usize) -> String {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n",
    );
    for i in 0..extra {
        text.push_str(&format!("property float p{i}\n"));
    }
    text.push_str(&format!("end_header\n0 0 0{}\n", " 1".repeat(extra)));
    text
}

#[test]
fn headers_have_a_sane_maximum_of_parts() {
    let file = parse_geometry(&source("wide.ply", wide_ply(4000)), Format::Ply).expect("valid");
    assert_eq!(file.attributes.len(), 4000);
    let error = |name: &str, format: Format, text: String| {
        let error = parse(&source(name, text), format).expect_err(name);
        error.to_string()
    };
    let message = error("wide.ply", Format::Ply, wide_ply(100_000));
    assert!(
        message.contains("line 4100: 'property float p4093' follows 4096 properties"),
        "{message}"
    );
    let mut elements = String::from("ply\nformat ascii 1.0\n");
    for i in 0..100_000 {
        elements.push_str(&format!("element e{i} 0\n"));
    }
    let message = error("elements.ply", Format::Ply, elements);
    assert!(
        message.contains("line 259: 'element e256 0' follows 256 elements"),
        "{message}"
    );
    let text = format!("x,y,z{}\n", ",c".repeat(100_000));
    let message = error("wide.csv", Format::Text, text);
    assert!(
        message.contains("line 1: more than 4096 columns"),
        "{message}"
    );
    let members: Vec<(String, Vec<u8>)> = (0..5000).map(|i| (format!("{i}"), Vec::new())).collect();
    let members: Vec<(&str, Vec<u8>)> = members
        .iter()
        .map(|(n, b)| (n.as_str(), b.clone()))
        .collect();
    let error = parse(&source("many.npz", npz(&members, false)), Format::Npz).expect_err("many");
    assert!(
        error.to_string().contains("more than 4096 arrays"),
        "{error}"
    );
}

/// A VTP of one point, whose `arrays` lie one behind another in appended base64 with line ends in it.
fn appended_base64(arrays: usize) -> Vec<u8> {
    let mut tags = String::new();
    let mut data = String::new();
    let mut add = |name: usize, values: &[u8]| {
        let tag = format!(
            r#"<DataArray type="UInt8" Name="{name}" NumberOfComponents="{}" format="appended" offset="{}"/>"#,
            values.len(),
            data.len()
        );
        let length = (values.len() as u32).to_le_bytes();
        data.push_str(&STANDARD.encode([&length, values].concat()));
        data.push('\n');
        tag
    };
    let points = add(0, &[1, 2, 3]);
    for name in 0..arrays {
        tags.push_str(&add(name, &[4]));
    }
    let begin = r#"<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="1"><PointData>"#;
    let middle = "</PointData><Points>";
    let end = r#"</Points></Piece></PolyData><AppendedData encoding="base64">_"#;
    let last = "</AppendedData></VTKFile>";
    [begin, &tags, middle, &points, end, &data, last]
        .concat()
        .into()
}

/// Bytes that are allocated in total while a file is read.
fn allocated(bytes: Vec<u8>, format: Format) -> u64 {
    let source = source("counted", bytes);
    let memory = allocation_counter::measure(|| drop(parse_geometry(&source, format)));
    memory.bytes_total
}

#[test]
fn work_grows_with_the_file_and_no_faster() {
    // A copy of the rest of the file for each array would show in the bytes that are allocated in total.
    let [small, large] = [1000, 8000].map(|n| {
        let bytes = appended_base64(n);
        let file = parse_geometry(&source("base64.vtp", bytes.clone()), Format::Vtp);
        let file = file.expect("valid");
        assert_eq!(file.points, [[1.0, 2.0, 3.0]]);
        assert!(
            file.attributes
                .iter()
                .all(|attribute| attribute.values == [4.0])
        );
        allocated(bytes, Format::Vtp) as f64
    });
    // Eight times the file; the rest is for vectors that double.
    assert!(large < 12.0 * small, "{small} bytes, then {large}");
}
