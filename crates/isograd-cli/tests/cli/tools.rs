//! `isograd sample`, `query` and `info`, run as a user runs them.

use crate::sandbox::Sandbox;

#[test]
fn samples_depend_on_the_seed_alone() {
    let sandbox = Sandbox::new();
    for (name, seed) in [("a.ply", 1), ("b.ply", 1), ("c.ply", 2)] {
        sandbox.done(&format!("sample torus -n 400 -o {name} --seed {seed}"));
    }
    assert_eq!(sandbox.read("a.ply"), sandbox.read("b.ply"));
    assert_ne!(sandbox.read("a.ply"), sandbox.read("c.ply"));
    sandbox.done("sample torus -n 400 -o d.csv --param major=2 --param minor=0.5 --precision f64");
    let file = sandbox.geometry("d.csv");
    for [x, y, z] in &file.points {
        // Seventeen digits stand in the file.
        assert!(((x.hypot(*y) - 2.0).hypot(*z) - 0.5).abs() < 1e-12);
    }
    assert_eq!(file.normals.map(|n| n.len()), Some(400));
}

#[test]
fn the_list_names_every_shape_and_its_parameters() {
    let list = Sandbox::new().done("sample --list").stdout;
    for shape in isograd_shapes::all() {
        assert!(list.contains(&format!("{}: ", shape.name())));
        for (parameter, _) in shape.parameters() {
            assert!(list.contains(parameter.name), "{}", parameter.name);
        }
    }
}

#[test]
fn density_grows_along_the_axis_that_was_named() {
    let sandbox = Sandbox::with("sample sphere -n 2000 -o a.npz --density z:10 --layout random");
    let points = sandbox.geometry("a.npz").points;
    let upper = points.iter().filter(|p| p[2] > 0.0).count();
    assert!(upper > 1300, "{upper}");
}

#[test]
fn queries_of_a_mesh_and_of_its_field_agree_with_the_sphere() {
    let sandbox = Sandbox::with("sample sphere -n 3000 -o cloud.ply");
    sandbox
        .done("reconstruct cloud.ply -q --mesh m.ply --sdf s.vti --resolution 48 --precision f64");
    sandbox.write("at.xyz", "0 0 0\n0.4 0 0\n0.55 0 0\n0 0.2 -0.3\n5 0 0\n");
    sandbox.done("query m.ply --at at.xyz -o mesh.npz");
    sandbox.says(
        "0 query s.vti --at at.xyz -o field.npz | warning: 1 of 5 points lie outside the grid",
    );
    let [mesh, field] = ["mesh.npz", "field.npz"].map(|name| sandbox.geometry(name));
    let names = |of: &isograd_io::Geometry| -> Vec<String> {
        of.attributes.iter().map(|a| a.name.clone()).collect()
    };
    assert_eq!(
        names(&mesh),
        ["distance", "gradient", "closest", "triangle", "barycentric"]
    );
    assert_eq!(names(&field), ["distance", "gradient"]);
    for (i, point) in mesh.points.iter().enumerate() {
        let exact = isograd_element::vector::norm(*point) - 0.5;
        // A tenth of a cell, which is 1.25/48.
        assert!((mesh.attributes[0].values[i] - exact).abs() < 2.6e-3, "{i}");
        if i == 4 {
            assert!(field.attributes[0].values[i].is_nan());
        } else if i > 0 {
            // At the center of the sphere the field has a kink that cells round off.
            assert!(
                (field.attributes[0].values[i] - exact).abs() < 2.6e-3,
                "{i}"
            );
        }
    }
    sandbox.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.says("0 query open.obj --at at.xyz -o open.ply | not closed");
    sandbox.says("1 query at.xyz --at at.xyz -o bad.ply | at.xyz");
}

#[test]
fn info_says_what_a_file_holds() {
    let sandbox = Sandbox::with("sample sphere -n 1000 -o cloud.ply");
    sandbox.done("reconstruct cloud.ply -q --mesh m.obj --sdf s.npz --resolution 24");
    let says = |file: &str, parts: &[&str]| {
        let text = sandbox.done(&format!("info {file}")).stdout;
        let plain: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in parts {
            assert!(plain.contains(part), "'{part}' is missing: {plain}");
        }
    };
    says(
        "cloud.ply",
        &["format PLY", "stored as f32", "points 1000", "normals yes"],
    );
    says(
        "m.obj",
        &["format OBJ", "closed yes", "components 1", "euler 2"],
    );
    says(
        "s.npz",
        &[
            "format NPZ",
            "cells 24 × 24 × 24",
            "spacing",
            "|∇φ| near mean",
        ],
    );
}
