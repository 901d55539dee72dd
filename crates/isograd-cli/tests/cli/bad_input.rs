//! Bad input and bad command lines: the exit status, the message, and nothing half-written.

use crate::sandbox::Sandbox;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n";

#[test]
fn damaged_files_end_with_1_and_name_the_place() {
    let sandbox = Sandbox::new();
    let refused = |name: &str, bytes: &[u8], parts: &[&str]| {
        sandbox.write(name, bytes);
        let run = sandbox.run(&format!("reconstruct {name} -o out"));
        run.says(1, &[&["error: ", name], parts].concat());
        assert_eq!(sandbox.files(), [name], "nothing is written");
        std::fs::remove_file(sandbox.path(name)).expect("removes");
    };
    refused("a.ply", b"", &["empty"]);
    refused("a.ply", PLY.as_bytes(), &["line 3", "cut short"]);
    refused(
        "a.ply",
        format!("{PLY}0 0 0\n1 0 0\n0 nan 0\n0 0 1").as_bytes(),
        &["line 10", "not finite"],
    );
    refused(
        "a.ply",
        format!("{PLY}0 0 0\n1 0 0\n0 inf 0\n0 0 1").as_bytes(),
        &["line 10"],
    );
    refused(
        "a.ply",
        PLY.replace("vertex 4", "vertex 4000000000").as_bytes(),
        &["line 3"],
    );
    refused("a.xyz", b"0 0 0\n1 0 zero\n", &["line 2", "'zero'"]);
    refused(
        "a.obj",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
        &["line 4", "counts from 1"],
    );
    refused("a.stl", b"solid", &["STL"]);
    refused("a.npy", b"\x93NUMPY\x01\x00\xff\xff", &["cut short"]);
    refused("a.npz", b"PK\x03\x04", &["damaged"]);
    refused("a.vtp", b"<VTKFile type=\"PolyData\">", &["cut short"]);
    refused("a.doc", b"1 2 3", &["format is unknown"]);
}

#[test]
fn clouds_that_no_surface_goes_through_end_with_1() {
    let sandbox = Sandbox::new();
    let refused = |name: &str, text: String, parts: &[&str]| {
        sandbox.write(name, text);
        sandbox
            .run(&format!("reconstruct {name} -o out"))
            .says(1, &[&[name], parts].concat());
        assert!(!sandbox.path("out").exists());
    };
    refused("none.xyz", "# nothing\n".into(), &["0 points"]);
    refused("one.xyz", "1 2 3\n".into(), &[]);
    refused("two.xyz", "1 2 3\n2 2 3\n".into(), &[]);
    refused("three.xyz", "1 2 3\n2 2 3\n1 3 3\n".into(), &[]);
    refused("equal.xyz", "1 2 3\n".repeat(500), &["all equal"]);
}

#[test]
fn zero_normals_that_were_given_are_refused() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o a.npz");
    let geometry = sandbox.geometry("a.npz");
    let text: String = geometry
        .points
        .iter()
        .map(|[x, y, z]| format!("{x} {y} {z} 0 0 0\n"))
        .collect();
    sandbox.write("zero.xyz", text);
    sandbox.says("1 reconstruct zero.xyz -o out --orient given | zero.xyz | normal");
    sandbox.write("bare.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n");
    sandbox.says("1 reconstruct bare.xyz -o out --orient given | bare.xyz | normal");
    assert!(!sandbox.path("out").exists());
}

#[test]
fn a_flat_cloud_is_no_panic() {
    let sandbox = Sandbox::new();
    let text: String = (0..900)
        .map(|i| format!("{} {} 0.5\n", i % 30, i / 30))
        .collect();
    sandbox.write("flat.xyz", text);
    let run = sandbox.run("reconstruct flat.xyz -o out --resolution 32");
    assert!(matches!(run.status, Some(0 | 1)), "{run:?}");
    assert!(
        run.stderr.contains("open") || run.status == Some(1),
        "{run:?}"
    );
    assert!(!run.stderr.contains("panicked"), "{run:?}");
}

#[test]
fn folders_and_missing_files_are_named() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("folder.ply")).expect("creates");
    sandbox
        .says("1 reconstruct folder.ply -o out | folder.ply: the folder has no file with points");
    sandbox.says("1 reconstruct none.ply -o out | none.ply | check the path");
    sandbox.says("1 info none.ply | none.ply");
    sandbox.says("1 query none.ply --at none.xyz -o a.ply | none.ply");
}

#[test]
fn outputs_that_can_not_be_written_fail_before_the_work() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply");
    sandbox.says("1 reconstruct a.ply --mesh no/m.ply | no/m.ply | create its folder");
    sandbox.says("1 sample sphere -n 5 -o no/a.ply | no/a.ply | create its folder");
    sandbox.says("2 reconstruct a.ply -o a.ply | a.ply is a file");
    assert_eq!(sandbox.files(), ["a.ply"]);
}

#[test]
fn wrong_command_lines_end_with_2() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply");
    for (line, part) in [
        ("", "Usage"),
        ("reconstruct", "CLOUD"),
        ("rebuild a.ply", "rebuild"),
        ("reconstruct a.ply --fast", "--fast"),
        ("reconstruct a.ply --resolution -5", "-5"),
        ("reconstruct a.ply --resolution 1e3", "--resolution"),
        ("reconstruct a.ply --spacing 0", "above 0"),
        ("reconstruct a.ply --orient up", "parity"),
        ("reconstruct a.ply --bounds 0 0 0 1 1", "--bounds"),
        ("reconstruct a.ply --mesh m.doc", "must end in .ply"),
        (
            "reconstruct a.ply --mesh out.ply --points out.ply",
            "name of two outputs",
        ),
        ("reconstruct a.ply --mesh ./a.ply", "is the input"),
        ("sample cube -n 5 -o b.ply", "cube"),
        ("sample fish -n 5 -o b.ply --param size=3", "size"),
        ("sample fish -n 5 -o b.vti", "must end in"),
        ("sample fish -n 0 -o b.ply", "-n"),
        ("query a.ply --at a.ply -o b.doc", "must end in"),
    ] {
        sandbox.run(line).says(2, &[part]);
    }
    assert_eq!(sandbox.files(), ["a.ply"]);
}

#[test]
fn help_and_version_end_with_0() {
    let sandbox = Sandbox::new();
    let help = sandbox.done("reconstruct --help");
    assert!(help.stdout.contains("--resolution") && help.stdout.contains("Exit status"));
    assert!(
        sandbox
            .done("--version")
            .stdout
            .contains(env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn grids_that_no_memory_holds_are_refused() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply");
    sandbox.says("1 reconstruct a.ply --resolution 65535 -o out | coarser");
    // 69 GiB.
    if isograd::available_memory().is_some_and(|free| free < 64e9) {
        sandbox.says("1 reconstruct a.ply --resolution 1600 -o out | a.ply | iB are free ( | use a lower resolution");
    }
    sandbox.says("1 reconstruct a.ply --spacing 1e-30 -o out | a.ply");
    sandbox.says("1 reconstruct a.ply --bounds 0 0 0 0 1 1 -o out | enclose no volume");
}

#[test]
fn an_input_is_not_overwritten_by_the_folder() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o points.ply");
    let before = sandbox.read("points.ply");
    sandbox.says("2 reconstruct points.ply -o . | points.ply is the input");
    assert_eq!(sandbox.read("points.ply"), before);
    assert_eq!(sandbox.files(), ["points.ply"]);
}

#[cfg(target_os = "linux")]
mod on_linux {
    use std::io::Read;
    use std::process::{Command, Stdio};
    use std::time::Duration;

    use crate::sandbox::Sandbox;

    #[test]
    fn a_full_disk_ends_with_1() {
        let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply");
        std::os::unix::fs::symlink("/dev/full", sandbox.path("m.ply")).expect("links");
        sandbox.says("1 reconstruct a.ply --mesh m.ply --resolution 24 | m.ply | free some space");
    }

    /// A limit on the size of files stands in for a disk that fills up in the middle of one.
    #[test]
    fn a_disk_that_fills_up_leaves_no_half_written_file() {
        let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply");
        sandbox.done("reconstruct a.ply --sdf s.npz --resolution 24 -q");
        let before = sandbox.read("s.npz");
        let script =
            "trap '' XFSZ; ulimit -f 64; exec \"$0\" reconstruct a.ply --sdf s.npz --resolution 64";
        let output = Command::new("bash")
            .args(["-c", script, env!("CARGO_BIN_EXE_isograd")])
            .current_dir(sandbox.path("."))
            .output()
            .expect("bash starts");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            message.contains("s.npz") && message.contains("free some space"),
            "{message}"
        );
        assert_eq!(sandbox.files(), ["a.ply", "s.npz"]);
        assert_eq!(sandbox.read("s.npz"), before, "the old file stays");
    }

    #[test]
    fn an_interrupt_leaves_whole_files_or_none() {
        let sandbox = Sandbox::with("sample sphere -n 20000 -o a.npz --layout random");
        for milliseconds in [5, 40, 120, 250, 400, 600] {
            let mut command = sandbox.command("reconstruct a.npz -o out --resolution 96");
            command.stdout(Stdio::null()).stderr(Stdio::piped());
            let mut child = command.spawn().expect("starts");
            std::thread::sleep(Duration::from_millis(milliseconds));
            let kill = Command::new("kill")
                .args(["-INT", &child.id().to_string()])
                .output();
            kill.expect("kill is there");
            let mut message = String::new();
            let pipe = child.stderr.as_mut().expect("a pipe");
            pipe.read_to_string(&mut message).expect("text");
            let status = child.wait().expect("it ends");
            // Done before the signal, stopped by the handler, or stopped before it was set up.
            assert!(
                matches!(status.code(), Some(0 | 130) | None),
                "{status:?}: {message}"
            );
            for name in sandbox.files() {
                let path = sandbox.path(&name);
                match path.extension().and_then(|e| e.to_str()) {
                    Some("ply" | "vti" | "npz") => drop(isograd_io::read(&path).expect("whole")),
                    Some("json" | "png") => {}
                    _ => panic!("{name} was left behind after {milliseconds} ms"),
                }
            }
            let _ = std::fs::remove_dir_all(sandbox.path("out"));
        }
    }
}
