//! `isograd orient`, run as a user runs it.

use crate::sandbox::Sandbox;
use isograd_element::vector::{dot, norm};
use isograd_io::{Dtype, Geometry};
use serde_json::Value;

fn read(sandbox: &Sandbox, name: &str) -> Geometry {
    sandbox.geometry(name)
}

fn names(geometry: &Geometry) -> Vec<&str> {
    let attributes = geometry.attributes.iter();
    attributes.map(|a| a.name.as_str()).collect()
}

#[test]
fn points_come_out_with_outward_normals_confidence_and_all_that_they_had() {
    let sandbox = Sandbox::with("sample fish -n 3000 -o cloud.npz --param amplitude=0.1");
    let before = read(&sandbox, "cloud.npz");
    for out in ["out.npz", "out.ply"] {
        let run = sandbox.done(&format!("orient cloud.npz -o {out}"));
        for part in ["wrote ", "3000 points", "orientation: auto", "doubtful: "] {
            assert!(run.stdout.contains(part), "'{part}' is missing: {run:?}");
        }
        let after = read(&sandbox, out);
        assert_eq!(after.points, before.points, "{out}");
        assert_eq!((after.dtype, names(&after)[0]), (Dtype::F32, "confidence"));
        let normals = after.normals.expect("normals");
        let truth = before.normals.as_ref().expect("normals");
        let pairs = normals.iter().zip(truth);
        let wrong = pairs.filter(|&(&n, &t)| dot(n, t) < 0.0).count();
        // Of so few samples the rim of the tail is less than a spacing thick.
        assert!(wrong < 90, "{wrong}");
        assert!(normals.iter().all(|&n| (norm(n) - 1.0).abs() < 1e-5));
    }
    assert_eq!(
        names(&read(&sandbox, "out.npz")),
        ["confidence", "velocity"]
    );
    let rerun = sandbox.done("orient out.ply -o again.ply -q");
    assert_eq!(rerun.stdout, "");
    assert_eq!(sandbox.read("again.ply"), sandbox.read("out.ply"));
}

#[test]
fn numbers_keep_the_type_that_holds_them() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o double.ply --precision f64");
    sandbox.done("orient double.ply -o out.ply");
    assert_eq!(read(&sandbox, "out.ply").dtype, Dtype::F64);
    // Coordinates in single precision, but a time that is not.
    let mut file = b"ply\nformat binary_little_endian 1.0\nelement vertex 200\n".to_vec();
    for property in ["float x", "float y", "float z", "double time"] {
        file.extend(format!("property {property}\n").bytes());
    }
    file.extend(b"end_header\n");
    for i in 0..200 {
        let (z, turn) = (f64::from(2 * i + 1) / 200.0 - 1.0, f64::from(i) * 2.4);
        let r = (1.0 - z * z).sqrt();
        for x in [r * turn.cos(), r * turn.sin(), z] {
            file.extend((x as f32).to_le_bytes());
        }
        file.extend((1.7e9 + f64::from(i) / 1024.0).to_le_bytes());
    }
    sandbox.write("times.ply", file);
    sandbox.done("orient times.ply -o times.npz");
    let after = read(&sandbox, "times.npz");
    assert_eq!(after.dtype, Dtype::F64);
    assert_eq!(after.attributes[1].values[199], 1.7e9 + 199.0 / 1024.0);
}

#[test]
fn the_report_has_the_names_of_a_reconstruction() {
    let sandbox = Sandbox::with("sample torus -n 2000 -o cloud.ply");
    sandbox.done("orient cloud.ply -o o.ply --report o.json --orient parity --parity-gamma 3");
    sandbox.done("reconstruct cloud.ply --resolution 24 --report r.json --orient parity");
    let [orient, whole] = ["o.json", "r.json"].map(|name| sandbox.json(name));
    for (key, value) in orient.as_object().expect("an object") {
        let other = &whole[key];
        assert!(!other.is_null(), "{key}");
        if key != "seconds" && value.is_object() {
            let keys = |of: &Value| -> Vec<String> {
                of.as_object().expect("an object").keys().cloned().collect()
            };
            assert_eq!(keys(value), keys(other), "{key}");
        }
    }
    assert_eq!(orient["orientation"]["method"], "parity");
}

#[test]
fn sensors_come_from_the_command_line_or_from_columns() {
    let sandbox = Sandbox::new();
    // A flat sheet, of which nobody can tell the side.
    let mut rows = String::from("x,y,z,sensor_x,sensor_y,sensor_z\n");
    let mut bare = String::new();
    for i in 0..400 {
        let (x, y) = (i % 20, i / 20);
        rows += &format!("{x},{y},0,{x},5,-30\n");
        bare += &format!("{x} {y} 0\n");
    }
    sandbox.write("seen.csv", rows);
    sandbox.write("bare.xyz", bare);
    let sides = |line: &str| {
        sandbox.done(&format!("orient {line} -o out.npz --orient sensors"));
        let normals = read(&sandbox, "out.npz").normals.expect("normals");
        let up = normals.iter().filter(|n| n[2] > 0.0).count();
        assert!(up == 0 || up == 400, "{up}");
        up > 0
    };
    assert!(!sides("seen.csv"));
    assert!(sides("seen.csv --sensor 0,0,9"), "instead of the columns");
    assert!(sides("bare.xyz --sensor 0,0,9 --sensor 20,20,9"));
    assert!(!sides("bare.xyz --sensor 0,0,-9"));
    assert_eq!(
        names(&{
            sandbox.done("orient seen.csv -o kept.npz");
            read(&sandbox, "kept.npz")
        }),
        ["confidence", "sensor_x", "sensor_y", "sensor_z"]
    );
    sandbox.says("1 orient bare.xyz -o out.ply --orient sensors | bare.xyz | no sensor positions");
    sandbox.says("1 orient bare.xyz -o out.ply --orient sensors --sensor 3,0,0 | point 3 lies exactly at a sensor");
    sandbox.write(
        "nan.csv",
        "x,y,z,sensor_x,sensor_y,sensor_z\n1,2,3,nan,0,0\n",
    );
    sandbox.says(
        "1 orient nan.csv -o out.ply --orient sensors | nan.csv | sensor position 0 is not finite",
    );
}

#[test]
fn a_wrong_command_line_is_refused_before_the_work() {
    let sandbox = Sandbox::with("sample torus -n 400 -o cloud.ply");
    for (line, says) in [
        ("orient cloud.ply -o cloud.ply", "is the input"),
        ("orient cloud.ply -o out.obj", "must end in .ply or"),
        ("orient cloud.ply -o out.ply --report r.txt", ".json"),
        (
            "orient cloud.ply -o out.ply --sensor 1,2,3",
            "--sensor is not used without --orient sensors",
        ),
        (
            "reconstruct cloud.ply -o out --sensor 1,2,3",
            "--sensor is not used without --orient sensors",
        ),
        (
            "orient cloud.ply -o out.ply --parity-tolerance 3",
            "without --orient parity",
        ),
    ] {
        sandbox.run(line).says(2, &[says]);
    }
    assert_eq!(sandbox.files(), ["cloud.ply"]);
    sandbox.says("1 orient missing.ply -o out.ply | missing.ply");
    sandbox.write(
        "line.xyz",
        (0..50).map(|i| format!("{i} 0 0\n")).collect::<String>(),
    );
    sandbox.says("1 orient line.xyz -o out.ply | line.xyz | so there is no surface");
}

#[test]
fn a_reconstruction_takes_sensors_too() {
    let sandbox = Sandbox::with("sample sphere -n 2000 -o cloud.ply");
    sandbox.done(
        "reconstruct cloud.ply --resolution 24 --orient sensors --sensor 0,0,5 --report r.json",
    );
    let report = sandbox.json("r.json");
    assert_eq!(report["orientation"]["method"], "sensors");
}
