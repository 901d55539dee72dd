//! Meshes with normals and attributes at their vertices.

use isograd::data::Attribute;
use isograd::{PointCloud, Real};
use isograd_io::Geometry;

use crate::files;

const FACES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn attribute<T: Real>(name: &str, components: usize, values: &[f64]) -> Attribute<T> {
    Attribute {
        name: name.into(),
        components,
        values: values.iter().map(|&v| T::of(v)).collect(),
    }
}

/// Four vertices with these attributes.
fn vertices<T: Real>(attributes: Vec<Attribute<T>>) -> PointCloud<T> {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.1],
        [1.0, 1.0, 0.2],
        [0.0, 1.0, 0.3],
    ];
    let cloud = PointCloud::new(corners.map(|p| p.map(T::of)).to_vec());
    let add = |cloud: PointCloud<T>, attribute| cloud.with_attribute(attribute);
    cloud
        .and_then(|cloud| attributes.into_iter().try_fold(cloud, add))
        .expect("valid")
}

fn written<T: Real>(name: &str, vertices: &PointCloud<T>) -> (Vec<u8>, Geometry) {
    let bytes = files::written(name, |path| {
        isograd_io::write_surface(path, vertices, &FACES)
    });
    let source = isograd_io::Source {
        name: name.into(),
        bytes: bytes.clone(),
    };
    let format = isograd_io::Format::from_path(name.as_ref()).expect("known");
    let back = isograd_io::parse_geometry(&source, format).expect("reads");
    assert_eq!(back.faces, FACES);
    (bytes, back)
}

fn has(bytes: &[u8], text: &str) -> bool {
    bytes
        .windows(text.len())
        .any(|window| window == text.as_bytes())
}

fn data_come_back<T: Real>(name: &str) {
    let normals = vec![[0.6, 0.0, 0.8].map(T::of); 4];
    let attributes = vec![
        attribute("heat", 1, &[0.1, f64::NAN, -0.0, 3e7]),
        attribute("a<b>&\"c", 1, &[1.0, 2.0, 3.0, 4.0]),
    ];
    let cloud = vertices::<T>(attributes)
        .with_normals(normals)
        .expect("valid");
    let (_, back) = written(name, &cloud);
    let bits =
        |rows: &[[T; 3]]| -> Vec<_> { rows.iter().map(|r| r.map(|x| x.f64().to_bits())).collect() };
    let again = back.cloud::<T>().expect("valid");
    assert_eq!(bits(again.points()), bits(cloud.points()), "{name}");
    assert_eq!(again.normals(), cloud.normals(), "{name}");
    for (after, before) in again.attributes().iter().zip(cloud.attributes()) {
        let bits =
            |a: &Attribute<T>| -> Vec<_> { a.values.iter().map(|v| v.f64().to_bits()).collect() };
        assert_eq!(bits(after), bits(before), "{name} {}", before.name);
    }
    let names: Vec<&str> = again.attributes().iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names.len(), 2);
    assert_eq!(names[0], "heat");
}

#[test]
fn vertices_come_back_with_their_data() {
    for name in ["m.ply", "m.vtp"] {
        data_come_back::<f32>(name);
        data_come_back::<f64>(name);
    }
}

#[test]
fn colors_are_bytes_and_come_back_from_either_format() {
    let channel = |name: &str, first: f64| attribute::<f32>(name, 1, &[first, 2.0, 3.0, 255.0]);
    let split = vertices(vec![
        channel("heat", 0.5),
        channel("red", 9.0),
        channel("green", 8.0),
        channel("blue", 7.0),
    ]);
    let rgb = [
        9.0, 8.0, 7.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 255.0, 255.0, 255.0,
    ];
    let packed = vertices(vec![
        attribute::<f32>("heat", 1, &[0.5, 2.0, 3.0, 255.0]),
        attribute("RGB", 3, &rgb),
    ]);
    for cloud in [split, packed] {
        let (bytes, ply) = written("m.ply", &cloud);
        assert!(has(
            &bytes,
            "property float heat\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        ));
        let blue = &ply.attributes[3];
        assert_eq!(
            (blue.name.as_str(), &blue.values[..]),
            ("blue", &[7.0, 2.0, 3.0, 255.0][..])
        );
        let (bytes, vtp) = written("m.vtp", &cloud);
        assert!(has(
            &bytes,
            r#"<DataArray type="UInt8" Name="RGB" NumberOfComponents="3""#
        ));
        let color = vtp
            .attributes
            .iter()
            .find(|a| a.name == "RGB")
            .expect("colors");
        assert_eq!((color.components, &color.values[..]), (3, &rgb[..]));
    }
    // Fractions stay fractions.
    let unit = vertices(
        ["red", "green", "blue"]
            .map(|name| attribute::<f32>(name, 1, &[0.0, 1.0, 1.0, 0.0]))
            .to_vec(),
    );
    let (bytes, _) = written("m.ply", &unit);
    assert!(has(&bytes, "property float red\n"));
    // Clouds as well.
    let clouds = vertices(
        ["red", "green", "blue"]
            .map(|name| channel(name, 4.0))
            .to_vec(),
    );
    let bytes = files::written("c.ply", |path| isograd_io::write_cloud(path, &clouds));
    assert!(has(&bytes, "property uchar red\n"));
}

#[test]
fn two_arrays_of_one_name_and_those_of_normals_are_renamed() {
    let values = [1.0, 2.0, 3.0, 4.0];
    let names = ["heat", "heat", "Normals", ""];
    let cloud = vertices(
        names
            .map(|name| attribute::<f64>(name, 1, &values))
            .to_vec(),
    );
    for name in ["m.ply", "m.vtp"] {
        let (_, back) = written(name, &cloud);
        assert_eq!(back.attributes.len(), 4, "{name}");
        assert_eq!(back.normals, None, "{name}");
        let mut found: Vec<&str> = back.attributes.iter().map(|a| a.name.as_str()).collect();
        found.sort();
        found.dedup();
        assert_eq!(found.len(), 4, "{name}: {found:?}");
    }
}

#[test]
fn other_formats_and_wrong_faces_are_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let cloud = vertices::<f32>(Vec::new());
    let write = |name: &str, faces: &[[u32; 3]]| {
        isograd_io::write_surface(&folder.path().join(name), &cloud, faces)
    };
    for name in ["m.stl", "m.obj", "m"] {
        let error = write(name, &FACES).expect_err("no attributes").to_string();
        assert!(error.contains("must end in .ply or .vtp"), "{error}");
    }
    let error = write("m.ply", &[[0, 1, 4]])
        .expect_err("no vertex 4")
        .to_string();
    assert!(error.contains("face 0"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 0);
}
