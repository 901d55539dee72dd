//! Outputs of a reconstruction: none at all, standard output, and what a run says about its input.

use std::process::Command;

use isograd_io::{Geometry, parse_geometry};

use crate::sandbox::{Run, Sandbox};

/// A sandbox with a small cloud of a sphere, which has normals.
fn sandbox() -> Sandbox {
    Sandbox::with("sample sphere -n 500 -o a.ply -q")
}

/// The bytes on standard output of `isograd LINE`, which must succeed, and its standard error.
fn streamed(sandbox: &Sandbox, line: &str) -> (Vec<u8>, String) {
    let output = sandbox.command(line).output().expect("starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{line}: {stderr}");
    (output.stdout, stderr)
}

#[test]
fn a_run_without_outputs_is_refused_before_the_input_is_read() {
    let sandbox = sandbox();
    for line in [
        "reconstruct a.ply",
        "reconstruct none.ply",
        "reconstruct -",
        "reconstruct a.ply --strict",
    ] {
        let parts = ["no output", "-o DIR", "--mesh", "--report"];
        sandbox.run(line).says(2, &parts);
    }
    sandbox.done("info a.ply");
    sandbox.done("gradcheck a.ply --resolution 20 -q");
    assert_eq!(sandbox.files(), ["a.ply"]);
}

#[test]
fn standard_output_gets_the_bytes_of_the_file_and_nothing_else() {
    let sandbox = sandbox();
    sandbox.done("reconstruct a.ply -o out --resolution 16 -q");
    for (flag, file) in [
        ("--mesh", "mesh.ply"),
        ("--sdf", "sdf.vti"),
        ("--points", "points.ply"),
        ("--plot", "slices.png"),
    ] {
        let line = format!("reconstruct a.ply {flag} - --resolution 16");
        let (bytes, lines) = streamed(&sandbox, &line);
        assert!(bytes == sandbox.read(&format!("out/{file}")), "{file}");
        assert!(lines.contains("verdict: "), "{lines}");
    }
    let (report, _) = streamed(&sandbox, "reconstruct a.ply --report - --resolution 16");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!(report["input"]["points"], 500);
}

#[test]
fn commands_can_be_joined_by_pipes() {
    let sandbox = sandbox();
    let (cloud, _) = streamed(&sandbox, "sample sphere -n 500 -o -");
    assert!(cloud == sandbox.read("a.ply"));
    let run = sandbox.run_with_input("orient - -o b.ply", &cloud);
    assert_eq!(run.status, Some(0), "{run:?}");
    sandbox.done("orient a.ply -o c.ply");
    assert!(sandbox.read("b.ply") == sandbox.read("c.ply"));
    let (oriented, _) = streamed(&sandbox, "orient a.ply -o - --report o.json");
    assert!(oriented == sandbox.read("c.ply"));
    sandbox.done("reconstruct a.ply --mesh m.ply --resolution 16 -q");
    let (found, lines) = streamed(&sandbox, "query m.ply --at a.ply -o -");
    let source = isograd_io::Source {
        name: "-".into(),
        bytes: found,
    };
    let found: Geometry = parse_geometry(&source, isograd_io::Format::Ply).expect("a cloud");
    assert_eq!(found.attributes[0].name, "distance");
    assert!(lines.contains("wrote -"), "{lines}");
}

#[test]
fn standard_output_takes_one_file() {
    let sandbox = sandbox();
    sandbox.says("2 reconstruct a.ply -o - | --mesh - | --report -");
    sandbox.says("2 reconstruct a.ply --mesh - --points - | - is the name of two outputs");
    assert_eq!(sandbox.files(), ["a.ply"]);
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_takes_no_file_is_an_error() {
    let sandbox = sandbox();
    let bash = |script: &str| {
        let mut command = Command::new("bash");
        command.args(["-c", script, env!("CARGO_BIN_EXE_isograd")]);
        command.current_dir(sandbox.path("."));
        Run::new(command.output().expect("bash starts"))
    };
    let line = "\"$0\" reconstruct a.ply --resolution 16 --mesh -";
    bash(&format!("{line} >&-")).says(1, &["standard output", "closed"]);
    bash(&format!("{line} > /dev/full")).says(1, &["cannot write standard output", "space"]);
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = sandbox.command("reconstruct a.ply --resolution 16 --mesh - -q");
    let output = command.stdout(writer).output().expect("starts");
    assert_eq!(output.status.code(), Some(141));
    // `script` runs a command on a terminal of its own.
    let program = env!("CARGO_BIN_EXE_isograd");
    let on_terminal = |line: &str| {
        let mut script = Command::new("script");
        script.args(["-qec", &format!("{program} {line}"), "/dev/null"]);
        script.current_dir(sandbox.path(".")).output()
    };
    let Ok(refused) = on_terminal("reconstruct a.ply --resolution 16 --mesh -") else {
        println!("SKIPPED: the command script is absent");
        return;
    };
    let text = String::from_utf8_lossy(&refused.stdout);
    assert_eq!(refused.status.code(), Some(2), "{text}");
    assert!(text.contains("standard output is a terminal"), "{text}");
    let report = on_terminal("reconstruct a.ply --resolution 16 --report -").expect("starts");
    assert_eq!(report.status.code(), Some(0), "text may go to a terminal");
}

#[test]
fn normals_of_the_input_are_used_with_signs_and_given_and_a_note_says_so_otherwise() {
    let sandbox = sandbox();
    let run = |more: &str| {
        let line = format!("reconstruct a.ply --report r.json --resolution 16 {more}");
        let run = sandbox.done(&line);
        let report = sandbox.json("r.json");
        (run.stderr, report["input"]["normals"].clone())
    };
    for method in ["", "--orient auto", "--orient parity", "--orient previous"] {
        let (lines, normals) = run(method);
        assert!(lines.starts_with("note: the normals in a.ply"), "{lines}");
        assert!(lines.contains("--orient signs"), "{lines}");
        assert_eq!(normals, "unused");
        assert!(!run(&format!("{method} -q")).0.contains("note"));
    }
    for method in ["--orient signs", "--orient given"] {
        assert_eq!(run(method), (String::new(), "used".into()));
    }
    let bare = sandbox.rows("a.ply", |_| true);
    let zeros: String = bare.lines().map(|row| format!("{row} 0 0 0\n")).collect();
    for text in [bare, zeros] {
        sandbox.write("b.xyz", text);
        let line = "reconstruct b.xyz --report r.json --resolution 16";
        assert_eq!(sandbox.done(line).stderr, "");
        assert!(sandbox.json("r.json")["input"]["normals"].is_null());
    }
}

#[test]
fn signs_are_those_of_the_normals_of_the_input() {
    let sandbox = sandbox();
    let cloud = sandbox.geometry("a.ply");
    let normals = cloud.normals.expect("normals");
    let inward: String = (cloud.points.iter().zip(&normals))
        .map(|([x, y, z], [a, b, c])| format!("{x} {y} {z} {} {} {}\n", -a, -b, -c))
        .collect();
    sandbox.write("inward.xyz", inward);
    sandbox.done("orient inward.xyz -o o.npz --orient signs");
    let found = sandbox.geometry("o.npz").normals.expect("normals");
    let dots = found.iter().zip(&normals);
    let dots: Vec<f64> = dots
        .map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
        .collect();
    assert!(dots.iter().all(|dot| *dot < -0.9), "{dots:?}");
}
