//! Small files of every format, written by hand or by the writers.

use std::io::Write;
use std::path::Path;

use isograd::data::Attribute;
use isograd::{Field, Grid, Mesh, PointCloud, Real};
use isograd_io::{Error, Format, Source, parse_field, parse_geometry, write_cloud, write_field};

/// Parses a file as a field (VTI) or as points and faces, and checks the memory that it takes.
pub fn parse_in_bounds(source: &Source, format: Format) -> Result<(), Error> {
    let mut result = Ok(());
    let memory = allocation_counter::measure(|| {
        result = match format {
            Format::Vti => parse_field(source, format).map(drop),
            _ => parse_geometry(source, format).map(drop),
        };
    });
    // One byte may become a number of 8 bytes, held twice; the constant is for the unpacker's buffers.
    let allowed = 64 * source.bytes.len() as u64 + (1 << 20);
    let used = memory.bytes_max;
    assert!(
        used <= allowed,
        "{}: {used} bytes were allocated",
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

pub const ASCII_PLY: &str = "ply
format ascii 1.0
comment by hand
element vertex 4
property float x
property double y
property float z
property list uchar int skipped
property uchar red
element face 2
property list uchar int vertex_indices
property float quality
end_header
0 0 0 2 7 8 255
1 0 0 0 0
1 1 0 1 9 12
0 1.5 0 0 3
4 0 1 2 3 0.5
3 0 2 3 0.25
";

pub const ASCII_STL: &str = "solid two triangles
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1 0
 endloop
endfacet
facet normal 0 0 1
 outer loop
  vertex 1 0 0
  vertex 1 1 0
  vertex 0 1 -0.0
 endloop
endfacet
endsolid
";

pub const OBJ: &str = "# comment
o thing
v 0 0 0 1 0 0
v 1 0 0 1 0 0
v 1 1 0 1 0 0
v 0 1 0 1 0 0
vn 0 0 1
vn 0 0 1
vn 0 0 1
vn 0 0 1
f 1//1 2//2 3//3 4//4
f -4 -3 \\
  -2
";

pub const CSV: &str =
    "# made by hand\nx,y,z,nx,ny,nz,temperature\n0,0,0,0,0,1,20\n1,0,0,0,0,1,21\n0,1,0,0,0,1,22\n";

pub const ASCII_VTP: &str = r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
<PolyData><Piece NumberOfPoints="4" NumberOfPolys="1" NumberOfStrips="1">
<PointData Normals="N"><DataArray type="Float32" Name="N" NumberOfComponents="3" format="ascii">
0 0 1 0 0 1 0 0 1 0 0 1</DataArray>
<DataArray type="Float32" Name="heat" format="ascii">1 2 3 4</DataArray></PointData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 1 1 0</DataArray></Points>
<Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">3</DataArray></Polys>
<Strips><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4</DataArray></Strips>
</Piece></PolyData></VTKFile>
"#;

/// Written by VTK 9 (`SetDataModeToBinary`), with zlib and without.
pub const BINARY_VTP: &str = include_str!("triangle_base64.vtp");
pub const ZLIB_VTP: &str = include_str!("triangle_zlib.vtp");

/// One valid file of every readable kind, as `(name, format, bytes)`.
pub fn valid_files() -> Vec<(&'static str, Format, Vec<u8>)> {
    let points: Vec<u8> = (0..12).flat_map(|i| (i as f32).to_be_bytes()).collect();
    let array = npy(">f4", true, "(4, 3)", &points);
    let packed = npz(&[("points.npy", array.clone())], true);
    let cloud_ply = written("c.ply", |path| write_cloud(path, &cloud::<f64>()));
    let cloud_npz = written("c.npz", |path| write_cloud(path, &cloud::<f32>()));
    let sdf_npz = written("f.npz", |path| write_field(path, &field::<f32>()));
    let sdf_vti = written("f.vti", |path| write_field(path, &field::<f64>()));
    vec![
        ("ascii.ply", Format::Ply, ASCII_PLY.into()),
        ("mesh.ply", Format::Ply, mesh_file::<f32>("m.ply")),
        ("cloud.ply", Format::Ply, cloud_ply),
        ("big.ply", Format::Ply, big_endian_ply()),
        ("points.csv", Format::Text, CSV.into()),
        (
            "points.xyz",
            Format::Text,
            "3\n0 0 0\n1 2 3\n4 5 6\n".into(),
        ),
        ("mesh.obj", Format::Obj, OBJ.into()),
        ("ascii.stl", Format::Stl, ASCII_STL.into()),
        ("mesh.stl", Format::Stl, mesh_file::<f32>("m.stl")),
        ("points.npy", Format::Npy, array),
        ("cloud.npz", Format::Npz, cloud_npz),
        ("packed.npz", Format::Npz, packed),
        ("sdf.npz", Format::Npz, sdf_npz),
        ("ascii.vtp", Format::Vtp, ASCII_VTP.into()),
        ("base64.vtp", Format::Vtp, BINARY_VTP.into()),
        ("zlib.vtp", Format::Vtp, ZLIB_VTP.into()),
        ("mesh.vtp", Format::Vtp, mesh_file::<f64>("m.vtp")),
        ("sdf.vti", Format::Vti, sdf_vti),
    ]
}

/// A quad with vertices of `double`, big-endian.
pub fn big_endian_ply() -> Vec<u8> {
    let mut bytes = b"ply\r\nformat binary_big_endian 1.0\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\nelement face 1\r\nproperty list int uint vertex_index\r\nend_header\r\n".to_vec();
    bytes.extend(SQUARE.iter().flatten().flat_map(|x| x.to_be_bytes()));
    bytes.extend(4i32.to_be_bytes());
    bytes.extend([0u32, 1, 2, 3].iter().flat_map(|i| i.to_be_bytes()));
    bytes
}
