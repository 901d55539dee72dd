//! Data written and read back in their own type have the same bits.

use std::path::Path;

use isograd::data::Attribute;
use isograd::{Field, Grid, Mesh, PointCloud, Real};
use proptest::prelude::*;

use crate::files;

/// Numbers of every size, also tiny, huge and negative zero.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -1e3..1e3f64,
        any::<f64>().prop_filter("finite in f32 too", |x| (*x as f32).is_finite()),
        Just(-0.0),
    ]
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    [number(), number(), number()]
}

prop_compose! {
    fn mesh()(vertices in prop::collection::vec(vector(), 1..20))
        (faces in prop::collection::vec(prop::array::uniform3(0..vertices.len() as u32), 1..20),
         vertices in Just(vertices)) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        (vertices, faces)
    }
}

fn to<T: Real>(rows: &[[f64; 3]]) -> Vec<[T; 3]> {
    rows.iter().map(|row| row.map(T::of)).collect()
}

fn bits<'a, T: Real>(values: impl IntoIterator<Item = &'a [T; 3]>) -> Vec<[u64; 3]> {
    let values = values.into_iter();
    values.map(|v| v.map(|x| x.f64().to_bits())).collect()
}

fn with_file<R>(name: &str, use_it: impl FnOnce(&Path) -> R) -> R {
    let folder = tempfile::tempdir().expect("temporary folder");
    use_it(&folder.path().join(name))
}

fn mesh_comes_back<T: Real>(name: &str, vertices: &[[f64; 3]], faces: &[[u32; 3]]) {
    let mesh = Mesh::<T>::new(to(vertices), faces.to_vec()).expect("valid");
    let file = with_file(name, |path| {
        isograd_io::write_mesh(path, &mesh).expect("writes");
        isograd_io::read_mesh(path).expect("reads")
    });
    let vertices = to::<T>(&file.points);
    assert_eq!(bits(&vertices), bits(mesh.vertices()), "{name}");
    assert_eq!(file.faces, mesh.faces(), "{name}");
}

/// An STL file has no vertices: its triangles come back, corner by corner, −0 as 0.
fn triangles_come_back(vertices: &[[f64; 3]], faces: &[[u32; 3]]) {
    let mesh = Mesh::<f32>::new(to(vertices), faces.to_vec()).expect("valid");
    let back = with_file("m.stl", |path| {
        isograd_io::write_mesh(path, &mesh).expect("writes");
        isograd_io::read_mesh(path).expect("reads")
    });
    let back = back.mesh::<f32>().expect("valid");
    assert_eq!(back.faces().len(), faces.len());
    for face in 0..faces.len() {
        assert_eq!(back.corners(face), mesh.corners(face));
    }
}

fn cloud_comes_back<T: Real>(name: &str, points: &[[f64; 3]], normals: &[[f64; 3]]) {
    let values = |components: usize| normals.iter().flatten().take(components * points.len());
    let attribute = |name: &str| Attribute {
        name: name.into(),
        components: 1,
        values: values(1).map(|&v| T::of(v)).collect(),
    };
    let cloud = PointCloud::<T>::new(to(points))
        .and_then(|cloud| cloud.with_normals(to(normals)))
        .and_then(|cloud| cloud.with_attribute(attribute("confidence")))
        .expect("valid");
    let file = with_file(name, |path| {
        isograd_io::write_cloud(path, &cloud).expect("writes");
        isograd_io::read_geometry(path).expect("reads")
    });
    assert_eq!(bits(&to::<T>(&file.points)), bits(cloud.points()), "{name}");
    let normals = to::<T>(&file.normals.expect("normals"));
    assert_eq!(bits(&normals), bits(cloud.normals().expect("normals")));
    let [attribute] = &file.attributes[..] else {
        panic!("{name}: {} attributes", file.attributes.len());
    };
    assert_eq!(attribute.name, "confidence", "{name}");
    let values = attribute.values.iter().map(|&v| T::of(v).f64().to_bits());
    let expected = cloud.attributes()[0].values.iter();
    assert!(values.eq(expected.map(|v| v.f64().to_bits())), "{name}");
}

fn field_comes_back<T: Real>(name: &str, shape: [usize; 3], lower: [f64; 3], values: &[f64]) {
    let grid = Grid::<T>::new(lower.map(T::of), T::of(0.1), shape).expect("valid");
    let values = (0..grid.cells())
        .map(|i| T::of(values[i % values.len()]))
        .collect();
    let field = Field::new(grid, values).expect("valid");
    let file = with_file(name, |path| {
        isograd_io::write_field(path, &field).expect("writes");
        isograd_io::read_field(path).expect("reads")
    });
    assert_eq!(file.dtype.name(), T::NAME);
    let back = &file.field;
    assert_eq!(back.grid().shape(), shape);
    assert_eq!(back.grid().spacing(), grid.spacing().f64());
    let values = back.values().iter().map(|v| v.to_bits());
    assert!(
        values.eq(field.values().iter().map(|v| v.f64().to_bits())),
        "{name}"
    );
    for axis in 0..3 {
        // Half a cell is subtracted and added again: two roundings at this size.
        let error = back.grid().origin()[axis] - grid.center_f64([0; 3])[axis];
        let tolerance = 4.0 * f64::EPSILON * (lower[axis].abs() + 0.1);
        assert!(error.abs() <= tolerance, "{name}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn meshes((vertices, faces) in mesh()) {
        for name in ["m.ply", "m.obj", "m.off", "m.vtp"] {
            mesh_comes_back::<f32>(name, &vertices, &faces);
            mesh_comes_back::<f64>(name, &vertices, &faces);
        }
        triangles_come_back(&vertices, &faces);
    }

    #[test]
    fn clouds(rows in prop::collection::vec((vector(), vector()), 1..20)) {
        let (points, normals): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
        for name in ["c.ply", "c.npz", "c.xyz", "c.csv", "c.pcd"] {
            cloud_comes_back::<f32>(name, &points, &normals);
            cloud_comes_back::<f64>(name, &points, &normals);
        }
    }

    #[test]
    fn fields(
        shape in prop::array::uniform3(2usize..20),
        lower in prop::array::uniform3(-1e3..1e3f64),
        values in prop::collection::vec(number(), 1..50),
    ) {
        for name in ["f.vti", "f.npz"] {
            field_comes_back::<f32>(name, shape, lower, &values);
            field_comes_back::<f64>(name, shape, lower, &values);
        }
    }
}

#[test]
fn attributes_of_several_components_stay_together_in_npz() {
    let cloud = files::cloud::<f32>();
    let file = with_file("c.npz", |path| {
        isograd_io::write_cloud(path, &cloud).expect("writes");
        isograd_io::read_geometry(path).expect("reads")
    });
    assert_eq!(file.cloud::<f32>().expect("valid"), cloud);
}

#[test]
fn points_a_million_away_with_extent_one_keep_every_bit() {
    let point = |i: f64| [1e6 + (i * 0.37).sin(), -1e6 + i / 50.0, 1e6 + 1e-9 * i];
    let points: Vec<[f64; 3]> = (0..50).map(|i| point(f64::from(i))).collect();
    for name in ["c.ply", "c.npz", "c.xyz", "c.pcd"] {
        cloud_comes_back::<f64>(name, &points, &points);
    }
}

#[test]
fn the_same_data_give_the_same_bytes() {
    for name in ["a.npz", "a.ply", "a.pcd"] {
        let cloud = files::cloud::<f32>();
        let bytes = || files::written(name, |path| isograd_io::write_cloud(path, &cloud));
        assert_eq!(bytes(), bytes());
    }
}
