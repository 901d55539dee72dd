//! Colors and attributes of a cloud at the vertices of its mesh.

use isograd_io::Geometry;

use crate::sandbox::Sandbox;

/// Samples of a sphere with columns that are functions of their position.
fn colored(header: &str, columns: impl Fn([f64; 3]) -> String) -> Sandbox {
    let sandbox = Sandbox::with("sample sphere -n 2000 -o a.ply -q");
    let points = sandbox.geometry("a.ply").points;
    let rows = points
        .iter()
        .map(|&[x, y, z]| format!("{x},{y},{z},{}\n", columns([x, y, z])));
    let text = format!("x,y,z,{header}\n{}", rows.collect::<String>());
    sandbox.write("c.csv", text);
    sandbox
}

/// Red, green and blue from 0 to 255 along the axes.
fn color(p: [f64; 3]) -> [f64; 3] {
    p.map(|x| (255.0 * (x + 0.5)).round().clamp(0.0, 255.0))
}

fn attribute<'a>(geometry: &'a Geometry, name: &str) -> &'a [f64] {
    let mut found = geometry.attributes.iter().filter(|a| a.name == name);
    &found.next().unwrap_or_else(|| panic!("{name}")).values
}

fn has(bytes: &[u8], text: &str) -> bool {
    bytes
        .windows(text.len())
        .any(|window| window == text.as_bytes())
}

#[test]
fn colors_are_carried_to_the_vertices_as_bytes() {
    let sandbox = colored("red,green,blue", |p| {
        color(p).map(|c| c.to_string()).join(",")
    });
    sandbox.done("reconstruct c.csv -o out --mesh m.ply --resolution 24 -q");
    let mesh = sandbox.mesh("m.ply");
    let header = sandbox.read("m.ply");
    for (axis, name) in ["red", "green", "blue"].into_iter().enumerate() {
        assert!(has(&header, &format!("property uchar {name}\n")), "{name}");
        assert!(has(
            &sandbox.read("out/points.ply"),
            &format!("property uchar {name}\n")
        ));
        for (vertex, &value) in mesh.points.iter().zip(attribute(&mesh, name)) {
            // Linear in the position, but for rounding; the mesh is up to a hundredth off the sphere.
            let expected = 255.0 * (vertex[axis] + 0.5);
            assert!((value - expected).abs() < 4.0, "{value} for {expected}");
        }
    }
    sandbox.done("reconstruct c.csv --mesh m.vtp --resolution 24 -q");
    let vtp = sandbox.mesh("m.vtp");
    assert!(has(
        &sandbox.read("m.vtp"),
        r#"type="UInt8" Name="RGB" NumberOfComponents="3""#
    ));
    let rows: Vec<f64> = (0..vtp.points.len())
        .flat_map(|i| ["red", "green", "blue"].map(|name| attribute(&mesh, name)[i]))
        .collect();
    assert_eq!(attribute(&vtp, "RGB"), rows);
    // As the points of a further run, they are colors again.
    sandbox.done("reconstruct m.vtp --points p.ply --resolution 24 -q");
    assert!(has(&sandbox.read("p.ply"), "property uchar blue\n"));
}

#[test]
fn other_attributes_keep_their_type_and_their_names() {
    let sandbox = colored(
        "heat,red,green,blue,sensor_x,sensor_y,sensor_z",
        |[x, y, z]| {
            format!(
                "{},{},{},{},9,9,9",
                20.0 + x + 2.0 * y,
                x + 0.5,
                y + 0.5,
                z + 0.5
            )
        },
    );
    for name in ["m.ply", "m.vtp"] {
        let line = format!("reconstruct c.csv --mesh {name} --resolution 24 -q --precision f64");
        sandbox.done(&line);
        let mesh = sandbox.mesh(name);
        let names: Vec<&str> = mesh.attributes.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, ["heat", "red", "green", "blue"], "{name}");
        for (p, &heat) in mesh.points.iter().zip(attribute(&mesh, "heat")) {
            assert!((heat - (20.0 + p[0] + 2.0 * p[1])).abs() < 0.02, "{heat}");
        }
    }
    // A velocity, of three components.
    sandbox.done("sample fish -n 1500 -o fish.npz --param amplitude=0.1 -q");
    sandbox.done("reconstruct fish.npz --mesh fish.vtp --resolution 32 -q");
    let fish = sandbox.mesh("fish.vtp");
    assert_eq!(fish.attributes[0].name, "velocity");
    assert_eq!(fish.attributes[0].components, 3);
}

#[test]
fn open_meshes_and_shells_have_attributes_too() {
    let sandbox = colored("heat", |[x, ..]| x.to_string());
    let bowl: Vec<String> = String::from_utf8(sandbox.read("c.csv"))
        .expect("text")
        .lines()
        .enumerate()
        .filter(|(k, line)| *k == 0 || line.split(',').nth(2).is_some_and(|z| !z.starts_with('-')))
        .map(|(_, line)| line.to_string())
        .collect();
    sandbox.write("bowl.csv", bowl.join("\n"));
    for more in ["--trim 0.1", "--sheet 0.1"] {
        let line =
            format!("reconstruct bowl.csv --mesh m.ply --padding 0.3 -q --resolution 32 {more}");
        sandbox.done(&line);
        let mesh = sandbox.mesh("m.ply");
        let heat = attribute(&mesh, "heat");
        assert_eq!(heat.len(), mesh.points.len());
        for (p, &heat) in mesh.points.iter().zip(heat) {
            // The shell is half of its thickness off the samples.
            assert!((heat - p[0]).abs() < 0.12, "{more}: {heat} at {p:?}");
        }
    }
}

#[test]
fn what_a_format_does_not_hold_is_named() {
    let sandbox = colored("heat,mark", |[x, ..]| {
        format!("{x},{}", if x > 0.49 { f64::NAN } else { 1.0 })
    });
    for name in ["m.stl", "m.obj"] {
        let line = format!("reconstruct c.csv --mesh {name} --resolution 16");
        let run = sandbox.done(&line);
        let note = format!("note: {name} holds no attributes; heat, mark can be written");
        assert!(run.stderr.contains(&note), "{run:?}");
        assert!(!sandbox.done(&format!("{line} -q")).stderr.contains("note"));
    }
    let run = sandbox.done("reconstruct c.csv --mesh m.ply --resolution 16 -q");
    assert!(
        run.stderr
            .contains("warning: 'mark' is not written to m.ply: "),
        "{run:?}"
    );
    let mesh = sandbox.mesh("m.ply");
    assert_eq!(mesh.attributes.len(), 1, "heat is there");
}
