//! Several clouds, folders and sequences.

use crate::sandbox::Sandbox;

/// A sandbox with the folder `scans` of two spheres and a torus.
fn scans() -> Sandbox {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("scans")).expect("creates");
    for (name, shape) in [("a2", "sphere"), ("a10", "torus"), ("b", "ellipsoid")] {
        sandbox.done(&format!("sample {shape} -n 600 -o scans/{name}.ply -q"));
    }
    sandbox
}

/// A sandbox with frames of a sphere that moves along x.
fn frames(count: usize) -> Sandbox {
    let sandbox = Sandbox::with("sample sphere -n 600 -o start.ply -q");
    std::fs::create_dir(sandbox.path("f")).expect("creates");
    let points = sandbox.geometry("start.ply").points;
    for k in 0..count {
        let moved = |p: &[f64; 3]| format!("{} {} {}\n", p[0] + 0.3 * k as f64, p[1], p[2]);
        let text: String = points.iter().map(moved).collect();
        sandbox.write(&format!("f/{k}.xyz"), text);
    }
    sandbox
}

/// The lines of a run that begin with the name of a cloud, without the rest.
fn order(stdout: &str) -> Vec<&str> {
    let lines = stdout.lines().filter(|line| line.contains(": "));
    lines.filter_map(|line| line.split(": ").next()).collect()
}

#[test]
fn each_cloud_gets_the_files_of_a_run_of_its_own() {
    let sandbox = scans();
    let run = sandbox.done("reconstruct scans -o out --resolution 16");
    let names = ["scans/a2.ply", "scans/a10.ply", "scans/b.ply", "3 clouds"];
    assert_eq!(order(&run.stdout), names, "{run:?}");
    let last = run.stdout.lines().last().unwrap_or_default();
    assert!(last.contains("0 failed"), "{last}");
    assert_eq!(run.stderr.matches("note: ").count(), 1, "{run:?}");
    for name in ["a2", "a10", "b"] {
        sandbox.done(&format!(
            "reconstruct scans/{name}.ply -o one --resolution 16 -q"
        ));
        for file in ["mesh.ply", "sdf.vti", "points.ply", "slices.png"] {
            let [all, one] = [format!("out/{name}/{file}"), format!("one/{file}")];
            assert!(sandbox.read(&all) == sandbox.read(&one), "{name} {file}");
        }
        let report = sandbox.json(&format!("out/{name}/report.json"));
        assert_eq!(report["input"]["path"], format!("scans/{name}.ply"));
    }
    let quiet = sandbox.done("reconstruct scans/a2.ply scans/b.ply -o q --resolution 16 -q");
    assert_eq!(quiet.stdout, "");
}

#[test]
fn braces_in_the_name_of_an_output_stand_for_the_name_of_the_cloud() {
    let sandbox = scans();
    std::fs::create_dir(sandbox.path("m")).expect("creates");
    let line = "--mesh m/{}.obj --report m/{}.json --resolution 16 -q";
    sandbox.done(&format!("reconstruct scans {line}"));
    sandbox.done("reconstruct scans/b.ply --mesh m/{}_alone.obj --resolution 16 -q");
    sandbox.done("reconstruct scans/b.ply -o folder/{}/x --resolution 16 -q");
    assert_eq!(sandbox.read("m/b.obj"), sandbox.read("m/b_alone.obj"));
    for name in ["m/a2.obj", "m/a10.json", "folder/b/x/mesh.ply"] {
        assert!(sandbox.path(name).is_file(), "{name}");
    }
}

#[test]
fn a_bad_cloud_does_not_stop_the_others() {
    let sandbox = scans();
    sandbox.write("scans/a3.ply", "ply\n");
    sandbox.write("scans/c.xyz", "1 2 3\n");
    sandbox.write("scans/notes.md", "no cloud");
    let run = sandbox.run("reconstruct scans none.ply -o out --resolution 16");
    let parts = [
        "error: scans/a3.ply",
        "error: scans/c.xyz",
        "none.ply",
        "error: 3 of 6 clouds failed",
    ];
    run.says(1, &parts);
    assert!(run.stdout.contains("3 failed"), "{run:?}");
    assert!(!sandbox.path("out/a3").exists() && !sandbox.path("out/c").exists());
    for name in ["a2", "a10", "b"] {
        sandbox.mesh(&format!("out/{name}/mesh.ply"));
    }
}

#[test]
fn strict_ends_with_3_after_all_clouds() {
    let sandbox = Sandbox::with("sample sphere -n 3000 -o whole.ply -q");
    let half = sandbox.rows("whole.ply", |p| p[2] > 0.0);
    sandbox.write("half.xyz", half);
    let line = "reconstruct half.xyz whole.ply -o out --resolution 32";
    sandbox.says(&format!("0 {line} | warning: half.xyz: "));
    let run = sandbox.run(&format!("{line} --strict"));
    run.says(3, &["error: the results of 1 of 2 clouds are bad"]);
    assert!(
        run.stdout
            .contains("2 clouds: 1 good, 0 check, 1 bad, 0 failed"),
        "{run:?}"
    );
    assert!(run.stdout.contains("half.xyz: bad: open (try: "), "{run:?}");
    sandbox.mesh("out/whole/mesh.ply");
    // Going on after an interruption, it still does.
    let run = sandbox.run(&format!("{line} --strict --skip-existing"));
    run.says(3, &["error: the results of 1 of 2 clouds are bad"]);
    assert!(run.stdout.contains("1 bad, 0 failed, 1 skipped"), "{run:?}");
    let line = "reconstruct half.xyz -o out/half --resolution 32 --strict --skip-existing";
    let run = sandbox.run(line);
    run.says(3, &["half.xyz"]);
    assert!(run.stdout.contains("was skipped"), "{run:?}");
}

#[test]
fn command_lines_that_would_mix_up_files_are_refused_before_any_work() {
    let sandbox = scans();
    sandbox.done("sample sphere -n 100 -o b.xyz -q");
    std::fs::create_dir(sandbox.path("none")).expect("creates");
    std::fs::create_dir_all(sandbox.path("out/b")).expect("creates");
    sandbox.done("sample sphere -n 100 -o out/b/points.ply -q");
    let before = sandbox.files();
    for (status, line, parts) in [
        (
            2,
            "scans b.xyz -o out",
            &["b.xyz and scans/b.ply", "rename one"][..],
        ),
        (2, "b.xyz b.xyz -o out", &["b.xyz and b.xyz"]),
        (2, "scans", &["no output is named"]),
        (2, "scans --mesh m.ply", &["m.ply", "{}"]),
        (2, "scans --mesh -", &["{}"]),
        (2, "scans - -o out", &["standard input"]),
        (2, "- --sequence -o out", &["standard input"]),
        (
            2,
            "scans out/b/points.ply -o out",
            &["points.ply is one of the clouds"],
        ),
        (2, "scans -o b.xyz", &["b.xyz is a file; -o takes a folder"]),
        (2, "scans -o out/b/points.ply/{}", &["is a file"]),
        (2, "scans --mesh {}.doc", &["must end in"]),
        (1, "none -o out", &["none", "no file with points"]),
    ] {
        sandbox
            .run(&format!("reconstruct {line}"))
            .says(status, parts);
    }
    assert_eq!(sandbox.files(), before);
}

#[test]
fn existing_outputs_are_skipped_unless_one_is_missing_or_older() {
    let sandbox = scans();
    let line = "reconstruct scans -o out --resolution 16 --skip-existing";
    sandbox.done(line);
    let run = sandbox.done(line);
    assert_eq!(order(&run.stdout), ["3 clouds"], "{run:?}");
    assert!(run.stdout.contains("3 skipped"), "{run:?}");
    std::fs::remove_file(sandbox.path("out/a10/sdf.vti")).expect("removes");
    let run = sandbox.done(line);
    assert_eq!(order(&run.stdout), ["scans/a10.ply", "3 clouds"]);
    sandbox.field("out/a10/sdf.vti");
    // A cloud newer than its outputs.
    let file = std::fs::File::options()
        .append(true)
        .open(sandbox.path("scans/b.ply"));
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(60);
    file.and_then(|file| file.set_modified(later))
        .expect("sets the time");
    let run = sandbox.done(line);
    assert_eq!(order(&run.stdout), ["scans/b.ply", "3 clouds"]);
    // A single cloud, too.
    sandbox.done("reconstruct scans/a2.ply -o one --resolution 16 -q");
    let run = sandbox.done("reconstruct scans/a2.ply -o one --resolution 16 --skip-existing");
    assert!(run.stdout.contains("was skipped"), "{run:?}");
}

#[test]
fn frames_of_a_sequence_share_a_grid_round_all_of_them() {
    let sandbox = frames(3);
    let run = sandbox.done("reconstruct f --sequence -o out --resolution 32 --outliers keep");
    assert_eq!(
        order(&run.stdout),
        ["f/0.xyz", "f/1.xyz", "f/2.xyz", "3 clouds"]
    );
    let report = |k: usize| sandbox.json(&format!("out/{k}/report.json"));
    let first = report(0);
    // From -0.5 to 1.1 along x, and four cells on either side, which are more than a tenth.
    let spacing = first["grid"]["spacing"].as_f64().expect("a number");
    assert!((spacing - 1.6 / 24.0).abs() < 1e-3, "{spacing}");
    assert_eq!(first["orientation"]["method"], "auto");
    for k in 1..3 {
        assert_eq!(report(k)["grid"], first["grid"]);
        assert_eq!(report(k)["orientation"]["method"], "previous");
        let field = sandbox.field(&format!("out/{k}/sdf.vti")).field;
        let inside = field.interpolate([0.3 * k as f64, 0.3, 0.0]);
        // A tenth of a cell.
        assert!((inside + 0.2).abs() < 6.7e-3, "{k}: {inside}");
    }
    // Given corners are kept.
    let line = "reconstruct f --sequence -o given --bounds -1 -1 -1 2 1 1 --spacing 0.125 -q";
    sandbox.done(line);
    assert_eq!(
        sandbox.field("given/2/sdf.vti").field.grid().shape(),
        [24, 16, 16]
    );
}

#[test]
fn a_frame_with_another_number_of_points_is_an_error_unless_signs_are_found_in_each() {
    let sandbox = frames(3);
    let less = sandbox.rows("f/1.xyz", |p| p[2] < 0.49);
    sandbox.write("f/1.xyz", less);
    let line = "reconstruct f --sequence -o out --resolution 16";
    let run = sandbox.run(line);
    run.says(
        1,
        &[
            "f/1.xyz: it has 5",
            "f/0.xyz has 600",
            "--orient auto",
            "1 of 3",
        ],
    );
    assert!(sandbox.path("out/2/mesh.ply").is_file());
    assert!(!sandbox.path("out/1").exists());
    sandbox.done(&format!("{line} --orient auto"));
    assert_eq!(
        sandbox.json("out/2/report.json")["orientation"]["method"],
        "auto"
    );
}

#[test]
fn a_sequence_goes_on_where_it_was_interrupted() {
    let sandbox = frames(4);
    let line = "reconstruct f --sequence -o out --resolution 16 --skip-existing";
    sandbox.done(line);
    let before = sandbox.json("out/3/report.json")["grid"].clone();
    for k in [2, 3] {
        std::fs::remove_dir_all(sandbox.path(&format!("out/{k}"))).expect("removes");
    }
    let run = sandbox.done(line);
    assert_eq!(order(&run.stdout), ["f/2.xyz", "f/3.xyz", "4 clouds"]);
    assert_eq!(sandbox.json("out/3/report.json")["grid"], before);
    let run = sandbox.done(line);
    assert!(run.stdout.contains("4 skipped"), "{run:?}");
    // A frame that can't be read is no reason to stop.
    sandbox.write("f/1.xyz", "1 2 x\n");
    let run = sandbox.run("reconstruct f --sequence -o new --resolution 16");
    run.says(1, &["error: f/1.xyz, line 1", "1 of 4 clouds failed"]);
    assert!(sandbox.path("new/3/mesh.ply").is_file());
}

#[test]
fn coordinates_far_from_the_origin_make_all_frames_double() {
    let sandbox = frames(2);
    for k in 0..2 {
        let points = sandbox.geometry(&format!("f/{k}.xyz")).points;
        let far = points
            .iter()
            .map(|[x, y, z]| format!("{:?} {y} {z}\n", x + 1e6));
        sandbox.write(&format!("f/{k}.xyz"), far.collect::<String>());
    }
    let run = sandbox.done("reconstruct f --sequence -o out --resolution 16");
    assert_eq!(run.stderr.matches("computed in f64").count(), 1, "{run:?}");
    for k in 0..2 {
        assert_eq!(
            sandbox.field(&format!("out/{k}/sdf.vti")).dtype,
            isograd_io::Dtype::F64
        );
        assert!(sandbox.json(&format!("out/{k}/report.json"))["note"].is_string());
    }
}
