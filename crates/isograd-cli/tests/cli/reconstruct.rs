//! `isograd reconstruct`, run as a user runs it.

use crate::sandbox::Sandbox;
use isograd_io::Dtype;
use serde_json::Value;

/// A sandbox with a cloud of a sphere of radius 0.5.
fn sphere() -> Sandbox {
    Sandbox::with("sample sphere -n 3000 -o cloud.ply")
}

fn keys(value: &Value) -> Vec<String> {
    let map = value
        .as_object()
        .unwrap_or_else(|| panic!("an object: {value}"));
    let mut keys: Vec<String> = map.keys().cloned().collect();
    keys.sort();
    keys
}

fn assert_keys(value: &Value, wanted: &str) {
    let mut wanted: Vec<String> = wanted.split(' ').map(String::from).collect();
    wanted.sort();
    assert_eq!(keys(value), wanted);
}

#[test]
fn the_folder_gets_its_five_files_and_the_report_its_fields() {
    let sandbox = sphere();
    let run = sandbox.done("reconstruct cloud.ply -o out/new --resolution 40");
    assert!(run.stdout.contains("wrote out/new/mesh.ply"), "{run:?}");
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert!(
        matches!(lines[..], [line] if line.starts_with("note: the normals in cloud.ply")),
        "no bar in a pipe, no warnings: {run:?}"
    );
    let names = [
        "mesh.ply",
        "points.ply",
        "report.json",
        "sdf.vti",
        "slices.png",
    ];
    let mut files = names.map(|name| format!("out/new/{name}")).to_vec();
    files.insert(0, "cloud.ply".into());
    assert_eq!(sandbox.files(), files);
    let report = sandbox.json("out/new/report.json");
    assert_keys(
        &report,
        "version backend input grid outliers normals orientation smoothing iso_value surface surface_spacing surface_cells walls trim sdf seconds peak_memory_bytes verdict warnings",
    );
    assert_keys(&report["input"], "path points normals");
    assert_eq!(report["input"]["normals"], "unused");
    assert_keys(&report["grid"], "shape origin spacing");
    assert_keys(
        &report["normals"],
        "radius sample_spacing neighbors guarded",
    );
    assert_keys(&report["normals"]["neighbors"], "min median max");
    assert_keys(
        &report["orientation"],
        "method flipped confidence doubtful regions",
    );
    assert_keys(&report["orientation"]["confidence"], "p05 median");
    assert_keys(
        &report["orientation"]["doubtful"],
        "share thin sparse open noisy unexplained",
    );
    assert_keys(
        &report["surface"],
        "vertices faces components area volume euler closed",
    );
    assert_keys(&report["sdf"], "min max eikonal");
    for part in ["all", "near"] {
        assert_keys(&report["sdf"]["eikonal"][part], "mean p05 p95");
    }
    assert_keys(
        &report["seconds"],
        "read normals orient splat poisson isosurface distance checks write total",
    );
    assert_eq!(report["input"]["points"], 3000);
    assert_eq!(report["grid"]["shape"][0], 40);
    assert_eq!(report["surface"]["closed"], true);
    assert!(report["peak_memory_bytes"].as_u64() > Some(1 << 20));
    let volume = report["surface"]["volume"].as_f64().expect("a number");
    let exact = std::f64::consts::PI / 6.0;
    // 26 cells across the sphere: a part in a hundred is far above the error and far below a mistake.
    assert!((volume / exact - 1.0).abs() < 0.01, "{volume}");
}

#[test]
fn a_sparse_solve_gives_the_same_volume_from_fewer_cells() {
    let sandbox = sphere();
    let [dense, sparse] = ["dense", "sparse"].map(|solve| {
        let line = format!("reconstruct cloud.ply --surface 2x --solve {solve} --report r.json -q");
        sandbox.done(&line);
        let report = sandbox.json("r.json");
        let volume = report["surface"]["volume"].as_f64().expect("a number");
        (report["surface_cells"].as_u64().expect("a number"), volume)
    });
    assert!(2 * sparse.0 < dense.0, "{} of {}", sparse.0, dense.0);
    // The indicator is right to 1e-4 of its jump, which takes about ten cells; the radius has 100.
    let off = sparse.1 / dense.1 - 1.0;
    assert!(off.abs() < 1e-4, "{off}");
    sandbox.says(
        "1 reconstruct cloud.ply --solve sparse --screening 4 --mesh m.ply | needs the dense solve",
    );
}

#[test]
fn the_points_keep_their_order_and_their_attributes() {
    let sandbox = Sandbox::with("sample fish -n 1500 -o cloud.npz --param amplitude=0.1");
    sandbox.done("reconstruct cloud.npz --points p.npz --resolution 32 -q");
    let before = sandbox.geometry("cloud.npz");
    let after = sandbox.geometry("p.npz");
    assert_eq!(after.points, before.points);
    let names: Vec<&str> = after.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["confidence", "velocity"]);
    assert_eq!(after.attributes[1], before.attributes[0]);
    let normals = after.normals.expect("normals");
    assert!(
        normals
            .iter()
            .all(|&n| (isograd_element::vector::norm(n) - 1.0).abs() < 1e-5)
    );
}

#[test]
fn every_format_of_every_output_is_written() {
    let sandbox = sphere();
    for line in [
        "--mesh m.ply --sdf s.vti --points p.ply",
        "--mesh m.obj --sdf s.npz --points p.npz --plot a.png --picture b.png --view -30 10",
        "--mesh m.stl --precision f64",
        "--mesh m.vtp --report r.json",
    ] {
        sandbox.done(&format!("reconstruct cloud.ply --resolution 24 -q {line}"));
    }
    let faces = |name: &str| sandbox.mesh(name).faces.len();
    assert!(faces("m.ply") > 100);
    assert_eq!(faces("m.ply"), faces("m.obj"));
    assert_eq!(faces("m.obj"), faces("m.vtp"));
    assert!(faces("m.stl") > 100);
    let [vti, npz] = ["s.vti", "s.npz"].map(|s| sandbox.field(s));
    assert_eq!(vti.field.values(), npz.field.values());
    for name in ["a.png", "b.png"] {
        assert!(sandbox.read(name).starts_with(b"\x89PNG"), "{name}");
    }
}

#[test]
fn a_cloud_can_come_through_a_pipe() {
    let sandbox = sphere();
    let ply = sandbox.read("cloud.ply");
    let line = "reconstruct - --mesh m.ply --report r.json --resolution 24";
    assert_eq!(sandbox.run_with_input(line, &ply).status, Some(0));
    let from_ply = sandbox.read("m.ply");
    let text = sandbox.rows("cloud.ply", |_| true);
    let run = sandbox.run_with_input(line, text.as_bytes());
    assert_eq!(run.status, Some(0));
    assert_eq!(sandbox.read("m.ply"), from_ply);
    sandbox
        .run_with_input(line, b"")
        .says(1, &["standard input", "empty"]);
    sandbox
        .run_with_input(line, b"1 2 3\n4 x 6\n")
        .says(1, &["standard input", "line 2", "'x'"]);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let sandbox = sphere();
    let outputs = |threads: usize| {
        sandbox.done(&format!(
            "reconstruct cloud.ply -o out --resolution 48 -q --threads {threads}"
        ));
        ["mesh.ply", "sdf.vti", "points.ply", "slices.png"]
            .map(|f| sandbox.read(&format!("out/{f}")))
    };
    let one = outputs(1);
    for threads in [2, 5] {
        assert!(outputs(threads) == one, "{threads} threads");
    }
}

#[test]
fn the_grid_is_the_one_that_was_asked_for() {
    let sandbox = sphere();
    let grid = |line: &str| {
        sandbox.done(&format!("reconstruct cloud.ply -q --sdf s.npz {line}"));
        *sandbox.field("s.npz").field.grid()
    };
    let fitted = grid("--spacing 0.04 --padding 0.2");
    assert!((fitted.spacing() - 0.04).abs() < 1e-8);
    assert!(
        fitted.lower()[0] <= -0.69 && fitted.upper()[2] >= 0.69,
        "{fitted:?}"
    );
    let given = grid("--bounds -1 -0.9 -0.8 1 0.9 0.8 --spacing 0.05");
    assert_eq!(given.shape(), [40, 36, 32]);
    assert!((given.lower()[1] + 0.9).abs() < 1e-6);
    let banded = sandbox.done("reconstruct cloud.ply -q --sdf b.npz --resolution 32 --band 0.1");
    assert_eq!(banded.status, Some(0));
    let field = sandbox.field("b.npz").field;
    let greatest = field.values().iter().fold(0.0f64, |m, v| m.max(*v));
    assert!(greatest < 0.1 + 1e-6, "{greatest}");
}

#[test]
fn outliers_are_left_out_with_a_warning_unless_they_are_to_be_kept() {
    let sandbox = sphere();
    let text = sandbox.rows("cloud.ply", |_| true);
    sandbox.write("far.xyz", format!("{text}60 1 1\n"));
    let line = "reconstruct far.xyz --resolution 32 --report r.json --points p.ply --mesh m.ply";
    let ran = sandbox.done(line);
    assert!(
        ran.stderr.contains("1 samples were left out"),
        "{}",
        ran.stderr
    );
    let report = sandbox.json("r.json");
    let last = text.lines().count();
    assert_eq!(report["outliers"]["count"], 1);
    assert_eq!(report["outliers"]["indices"][0], last);
    assert_eq!(report["input"]["points"], last + 1);
    assert!(report["surface"]["faces"].as_u64() > Some(1000));
    let points = sandbox.geometry("p.ply");
    assert_eq!(points.points.len(), last + 1);
    sandbox.done(&format!("{line} --outliers keep"));
    let report = sandbox.json("r.json");
    assert_eq!(report["outliers"]["count"], 0);
    assert!(report["grid"]["spacing"].as_f64() > Some(1.0));
}

#[test]
fn trim_opens_the_mesh_and_a_sheet_has_a_closed_shell() {
    let sandbox = sphere();
    let above = sandbox.rows("cloud.ply", |p| p[2] > 0.0);
    sandbox.write("bowl.xyz", above);
    let line = "reconstruct bowl.xyz -q --padding 0.3 --walls closed --report r.json --mesh m.ply";
    let closed = |more: &str| {
        sandbox.done(&format!("{line} {more}"));
        let report = sandbox.json("r.json");
        (
            report["surface"]["closed"].as_bool(),
            report["trim"].clone(),
        )
    };
    assert_eq!(closed(""), (Some(true), serde_json::Value::Null));
    let (is_closed, trim) = closed("--trim 0.1");
    assert_eq!(
        (is_closed, trim["distance"].as_f64()),
        (Some(false), Some(0.1))
    );
    assert!(trim["faces"].as_u64() > Some(10));
    assert_eq!(closed("--sheet 0.2").0, Some(true));
    for (option, text) in [
        ("--trim none", "trim is 'none'"),
        ("--sheet=-1", "sheet is '-1'"),
    ] {
        let ran = sandbox.run(&format!("{line} {option}"));
        assert_eq!(ran.status, Some(2));
        assert!(ran.stderr.contains(text), "{}", ran.stderr);
    }
}

#[test]
fn coordinates_far_from_the_origin_are_computed_in_double_and_it_says_so() {
    let sandbox = sphere();
    let near = sandbox.geometry("cloud.ply");
    let far: String = near
        .points
        .iter()
        .map(|[x, y, z]| format!("{:?} {:?} {:?}\n", x + 1e6, y - 1e6, z + 1e6))
        .collect();
    sandbox.write("far.xyz", far);
    sandbox.says("0 reconstruct far.xyz --mesh m.ply --sdf s.npz --report r.json --resolution 32 | computed in f64 | 1.000e6");
    let field = sandbox.field("s.npz");
    assert_eq!(field.dtype, Dtype::F64);
    let report = String::from_utf8(sandbox.read("r.json")).expect("text");
    assert!(report.contains("computed in f64"));
    let mesh = sandbox.mesh("m.ply");
    let radius = |v: &[f64; 3]| isograd_element::vector::norm([v[0] - 1e6, v[1] + 1e6, v[2] - 1e6]);
    // A tenth of a cell, which is 1.25/32.
    assert!(mesh.points.iter().all(|v| (radius(v) - 0.5).abs() < 4e-3));
}

#[test]
fn a_mesh_can_be_sampled_instead_of_its_vertices() {
    let sandbox = sphere();
    sandbox.done("reconstruct cloud.ply --mesh m.obj --resolution 24 -q");
    sandbox
        .done("reconstruct m.obj --sample 4000 --points p.npz --resolution 24 -q --orient given");
    let points = sandbox.geometry("p.npz").points;
    assert_eq!(points.len(), 4000);
    sandbox.says("1 reconstruct cloud.ply -o out --sample 10 | cloud.ply | no faces");
}

#[test]
fn quiet_says_nothing_and_verbose_says_each_stage() {
    let sandbox = sphere();
    let quiet = sandbox.done("reconstruct cloud.ply -o out --resolution 24 -q");
    assert!(
        quiet.stdout.is_empty() && quiet.stderr.is_empty(),
        "{quiet:?}"
    );
    let verbose = sandbox.done("reconstruct cloud.ply -o out --resolution 24 -v");
    for stage in "read normals orient splat poisson isosurface distance".split(' ') {
        assert!(
            verbose.stderr.lines().any(|l| l.starts_with(stage)),
            "{stage}: {verbose:?}"
        );
    }
}

#[test]
fn warnings_are_on_standard_error_and_in_the_report() {
    let sandbox = Sandbox::with("sample sphere -n 3000 -o a.xyz");
    let text = String::from_utf8(sandbox.read("a.xyz")).expect("text");
    // The upper half alone: open.
    let half: String = text
        .lines()
        .filter(|l| {
            !l.split_whitespace()
                .nth(2)
                .is_some_and(|z| z.starts_with('-'))
        })
        .map(|l| format!("{l}\n"))
        .collect();
    sandbox.write("half.xyz", half);
    let run = sandbox.run("reconstruct half.xyz -o out --resolution 32");
    run.says(0, &["warning: ", "open"]);
    let last = run.stdout.lines().last().unwrap_or_default();
    assert!(last.starts_with("verdict: bad: open (try: "), "{run:?}");
    assert!(last.contains("--sheet"), "{last}");
    let report = sandbox.json("out/report.json");
    assert_eq!(report["verdict"], "bad");
    let open = &report["warnings"][0];
    assert_keys(open, "code severity text try samples guessed");
    assert_eq!(
        (&open["code"], &open["severity"]),
        (&"open".into(), &"bad".into())
    );
    assert!(open["samples"].as_u64() > Some(20), "{open}");

    // The outputs are there, and the status says that they are bad.
    sandbox.says("3 reconstruct half.xyz --mesh m.ply --resolution 32 --strict -q | half.xyz | verdict: bad: open");
    assert!(!sandbox.mesh("m.ply").points.is_empty());
    sandbox.says("0 reconstruct a.xyz --mesh m.ply --resolution 32 --strict");
}

#[test]
fn the_last_line_of_a_good_result_is_its_verdict() {
    let run = sphere().done("reconstruct cloud.ply -o out --resolution 24");
    assert_eq!(run.stdout.lines().last(), Some("verdict: good"));
}

#[test]
fn every_warning_has_its_section_on_the_page() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/bad-results.md");
    let Ok(page) = std::fs::read_to_string(page) else {
        println!("SKIPPED: docs/bad-results.md is absent");
        return;
    };
    for code in isograd::Warning::CODES {
        assert!(page.contains(&format!("\n## `{code}`: ")), "{code}");
    }
    let sections = page.matches("\n## `").count();
    assert_eq!(
        sections,
        isograd::Warning::CODES.len(),
        "a code that does not exist"
    );
}
