//! `isograd sdf` and `isosurface`, run as a user runs them.

use crate::sandbox::Sandbox;

const OPEN: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";

#[test]
fn a_mesh_becomes_a_field_and_a_mesh_again() {
    let sandbox = Sandbox::new();
    sandbox.write("tetrahedron.obj", format!("{OPEN}f 2 3 4\n"));
    let run = sandbox.done("sdf tetrahedron.obj -o sdf.vti --resolution 40 --padding 0.2");
    assert!(run.stdout.contains("sign: closed"), "{}", run.stdout);
    assert_eq!(run.stderr, "");
    let field = sandbox.field("sdf.vti").field;
    for index in 0..field.grid().cells() {
        let [x, y, z] = field.grid().center_f64(field.grid().cell(index));
        let depth = x.min(y).min(z).min((1.0 - x - y - z) / 3f64.sqrt());
        let value = field.values()[index];
        assert_eq!(value < 0.0, depth > 0.0);
        assert!(depth < 0.0 || (value + depth).abs() < 1e-12);
    }
    let run = sandbox.done("isosurface sdf.vti -o back.ply --level 0.1");
    assert!(
        run.stdout.contains("closed, components: 1"),
        "{}",
        run.stdout
    );
    sandbox.done("query tetrahedron.obj --at back.ply -o back.npz");
    let back = sandbox.geometry("back.npz");
    let mut distance = back.attributes[0].values.iter();
    // The spheres around the corners have a radius of 0.1, the cells of 1.4 / 40.
    assert!(distance.all(|d| (d - 0.1).abs() < 3e-3));
}

#[test]
fn open_meshes_get_a_warning_and_bands_a_constant() {
    let sandbox = Sandbox::new();
    sandbox.write("open.obj", OPEN);
    sandbox.says(
        "0 sdf open.obj -o sdf.vti --spacing 0.1 --band 0.15 | warning: the mesh is not closed",
    );
    let field = sandbox.field("sdf.vti").field;
    assert!(field.values().iter().all(|value| value.abs() <= 0.15));
    let inside = field.values().iter().filter(|value| **value < 0.0).count();
    assert!((50..400).contains(&inside), "{inside}");
    sandbox.says("0 sdf open.obj -o tight.vti --spacing 0.1 --bounds 0 0 0 1 1 1 | winding number");
    sandbox.says("0 isosurface tight.vti -o wall.stl | low x, low y, low z walls | left open");
}

#[test]
fn bad_input_is_refused_with_a_reason() {
    let sandbox = Sandbox::with("sample sphere -n 100 -o cloud.ply");
    sandbox.write("open.obj", OPEN);
    sandbox.says("1 sdf cloud.ply -o sdf.vti | cloud.ply");
    sandbox.says("2 sdf open.obj -o sdf.ply | must end in");
    sandbox.says("1 sdf open.obj -o sdf.vti --spacing 1e-30 | cells");
    sandbox.says("2 sdf open.obj -o sdf.vti --outliers keep | unexpected");
    sandbox.says("2 isosurface cloud.ply -o mesh.ply | must end in");
    sandbox.done("sdf open.obj -o sdf.npz --resolution 16");
    sandbox.says("1 isosurface sdf.npz -o mesh.ply --level -9 | no cell is below");
    assert!(!sandbox.path("mesh.ply").exists() && !sandbox.path("sdf.vti").exists());
}
