//! Small files of every format: the corpus, written by hand or by other programs, and results of the writers.

use std::io::Write;
use std::path::Path;

use isograd::data::Attribute;
use isograd::{Field, Grid, Mesh, PointCloud, Real};
use isograd_io::{Error, Format, Geometry, Source, parse_field, parse_geometry};

/// Reads points and faces.
pub fn geometry(format: Format, bytes: impl Into<Vec<u8>>) -> Geometry {
    parse_geometry(&source("file", bytes), format).unwrap_or_else(|e| panic!("{e}"))
}

/// Checks that a file is refused with a message that contains `parts`.
pub fn refused(format: Format, bytes: impl Into<Vec<u8>>, parts: &[&str]) {
    let result = parse_in_bounds(&source("bad.file", bytes), format);
    let message = result.expect_err("must be refused").to_string();
    assert!(message.starts_with("bad.file"), "{message}");
    assert_says(&message, parts);
}

pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in: {message}");
    }
}

/// Parses a file as a field (VTI) or as points and faces, and checks the memory that it takes.
pub fn parse_in_bounds(source: &Source, format: Format) -> Result<(), Error> {
    // One byte may become a number of 8 bytes, held twice.
    parse_within(source, format, 64 * source.bytes.len() as u64)
}

/// [`parse_in_bounds`] with so many bytes of memory, and 1 MiB for messages and the buffers of the unpackers.
pub fn parse_within(source: &Source, format: Format, limit: u64) -> Result<(), Error> {
    let mut result = Ok(());
    let memory = allocation_counter::measure(|| {
        result = match format {
            Format::Vti => parse_field(source, format).map(drop),
            _ => parse_geometry(source, format).map(drop),
        };
    });
    let (size, used) = (source.bytes.len(), memory.bytes_max);
    assert!(
        used <= limit + (1 << 20),
        "{} of {size} bytes took {used} bytes",
        source.name
    );
    result
}

pub const SQUARE: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// A tetrahedron with outward faces.
pub fn tetrahedron<T: Real>() -> Mesh<T> {
    let vertices = [
        [0.1, 0.2, 0.3],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let vertices = vertices.map(|v: [f64; 3]| v.map(T::of)).to_vec();
    Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).expect("valid mesh")
}

/// Five points with normals and two attributes.
pub fn cloud<T: Real>() -> PointCloud<T> {
    let value = |i: usize| T::of((i as f64 * 0.7).sin());
    let rows = |from: usize| (0..5).map(move |i| [from, from + 5, from + 10].map(|o| value(i + o)));
    let cloud = PointCloud::new(rows(0).collect()).expect("finite");
    let cloud = cloud.with_normals(rows(20).collect()).expect("one a point");
    let attribute = |name: &str, components: usize| Attribute {
        name: name.into(),
        components,
        values: (0..5 * components).map(value).collect(),
    };
    cloud
        .with_attribute(attribute("confidence", 1))
        .and_then(|cloud| cloud.with_attribute(attribute("velocity", 3)))
        .expect("right length")
}

/// A field whose axes differ in length.
pub fn field<T: Real>() -> Field<T> {
    let lower = [-1.0, 2.0, 0.5].map(T::of);
    let grid = Grid::new(lower, T::of(0.25), [3, 4, 5]).expect("valid grid");
    let values = (0..grid.cells()).map(|i| T::of((i as f64).cos())).collect();
    Field::new(grid, values).expect("right length")
}

/// Bytes of the file `name` as written by `write`.
pub fn written(name: &str, write: impl FnOnce(&Path) -> Result<(), Error>) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join(name);
    write(&path).expect("writes");
    std::fs::read(&path).expect("is there")
}

/// Bytes of the tetrahedron in a file `name`.
pub fn mesh_file<T: Real>(name: &str) -> Vec<u8> {
    written(name, |path| {
        isograd_io::write_mesh(path, &tetrahedron::<T>())
    })
}

pub fn source(name: &str, bytes: impl Into<Vec<u8>>) -> Source {
    Source {
        name: name.into(),
        bytes: bytes.into(),
    }
}

/// A NumPy array file.
pub fn npy(descr: &str, fortran_order: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran_order { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// An archive of members, compressed or not.
pub fn npz(members: &[(&str, Vec<u8>)], compressed: bool) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = match compressed {
        true => zip::CompressionMethod::Deflated,
        false => zip::CompressionMethod::Stored,
    };
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    for (name, bytes) in members {
        archive.start_file(*name, options).expect("begins");
        archive.write_all(bytes).expect("writes");
    }
    archive.finish().expect("ends").into_inner()
}

pub const ASCII_PLY: &str = include_str!("../corpus/mesh_ascii.ply");
pub const ASCII_STL: &str = include_str!("../corpus/mesh_ascii.stl");
pub const OBJ: &str = include_str!("../corpus/mesh.obj");
pub const CSV: &str = include_str!("../corpus/cloud.csv");
pub const ASCII_VTP: &str = include_str!("../corpus/mesh_ascii.vtp");
/// Written by VTK 9 (`SetDataModeToBinary`), with zlib and without.
pub const BINARY_VTP: &str = include_str!("../corpus/mesh_base64.vtp");
pub const ZLIB_VTP: &str = include_str!("../corpus/mesh_zlib.vtp");
pub const BIG_ENDIAN_PLY: &[u8] = include_bytes!("../corpus/mesh_big_endian.ply");
pub const VTI: &[u8] = include_bytes!("../corpus/sdf.vti");

/// Files of the corpus, one of every readable kind, as `(name, format, bytes)` in the order of their names. Those
/// whose names begin with `sdf` hold a field, the others points or a mesh.
pub fn valid_files() -> Vec<(String, Format, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let entries = std::fs::read_dir(folder).expect("the corpus");
    let mut files: Vec<_> = entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().and_then(|name| name.to_str());
            let format = Format::from_path(&path).expect("a known extension");
            let bytes = std::fs::read(&path).expect("is readable");
            (name.expect("plain").to_string(), format, bytes)
        })
        .collect();
    files.sort_by(|a, b| a.0.cmp(&b.0));
    files
}
