//! `isograd reconstruct --backend`.

use crate::sandbox::Sandbox;

fn sphere() -> Sandbox {
    Sandbox::with("sample sphere -n 2000 -o cloud.ply")
}

#[test]
fn a_backend_that_was_left_out_says_how_to_build_with_it() {
    let sandbox = sphere();
    let lines = [
        #[cfg(not(feature = "cuda"))]
        ("cuda", "built without CUDA"),
        #[cfg(not(feature = "cuda"))]
        ("cuda:1", "--features cuda"),
        #[cfg(not(feature = "vulkan"))]
        ("vulkan", "built without Vulkan"),
        #[cfg(not(feature = "vulkan"))]
        ("vulkan", "--features vulkan"),
    ];
    let lines: &[(&str, &str)] = &lines;
    for (backend, part) in lines {
        let line = format!("reconstruct cloud.ply --mesh m.ply --backend {backend}");
        sandbox.run(&line).says(1, &[part, "--backend cpu"]);
        let line = format!("fit --target cloud.ply --shape sphere -o fit --backend {backend}");
        sandbox.run(&line).says(1, &[part, "--backend cpu"]);
    }
    assert_eq!(sandbox.files(), ["cloud.ply"]);
}

#[test]
fn a_backend_that_is_none_is_a_wrong_command_line() {
    let run = sphere().run("reconstruct cloud.ply --mesh m.ply --backend gpu");
    run.says(2, &["cpu, cuda (or cuda:1", "vulkan or auto"]);
}

#[test]
fn the_report_says_that_the_cpu_did_it() {
    let sandbox = sphere();
    sandbox.done("reconstruct cloud.ply --report r.json --resolution 24 -q");
    assert_eq!(sandbox.json("r.json")["backend"], "cpu");
}

#[test]
fn a_fit_says_who_computed() {
    let sandbox = sphere();
    let line = "fit --target cloud.ply --shape sphere --param radius=0.9 -n 1000 --resolution 20 --epochs 1 -o";
    sandbox.done(&format!("{line} cpu --pictures-at 0"));
    assert_eq!(sandbox.json("cpu/fit.json")["backend"], "cpu");
    let run = sandbox.done(&format!("{line} auto --pictures-at 0 --backend auto"));
    match sandbox.json("auto/fit.json")["backend"]
        .as_str()
        .expect("a text")
    {
        "cpu" => run.says(0, &["computed on the CPU: "]),
        device => println!("there is a GPU: {device}"),
    }
}

#[test]
fn auto_takes_a_gpu_or_the_cpu_and_then_says_why() {
    let sandbox = sphere();
    let line = "reconstruct cloud.ply --report r.json --resolution 24 --backend auto";
    let run = sandbox.done(line);
    let report = sandbox.json("r.json");
    match report["backend"].as_str().expect("a text") {
        "cpu" => run.says(0, &["computed on the CPU: ", "built into this program"]),
        device => println!("there is a GPU: {device}"),
    }
}

#[cfg(feature = "vulkan")]
mod vulkan {
    use serde_json::Value;

    use super::{Sandbox, sphere};

    const METHOD: &str = "--resolution 32 --surface grid --walls free";

    /// Whether there is a device.
    fn is_here() -> bool {
        let grid = isograd::Grid::<f32>::new([0.0; 3], 1.0, [8; 3]).expect("a grid");
        let options = isograd::Options::default();
        match isograd_backend::Plan::new(isograd::Backend::Vulkan, grid, options) {
            Ok(_) => true,
            Err(error) => {
                println!("SKIPPED: {error}");
                false
            }
        }
    }

    fn numbers(sandbox: &Sandbox, name: &str) -> Vec<f64> {
        let field = sandbox.field(name);
        field.field.values().to_vec()
    }

    #[test]
    fn the_outputs_are_those_of_the_cpu() {
        if !is_here() {
            return;
        }
        let sandbox = sphere();
        sandbox.done(&format!("reconstruct cloud.ply -o cpu {METHOD}"));
        let run = sandbox.done(&format!(
            "reconstruct cloud.ply -o gpu {METHOD} --backend vulkan"
        ));
        // Mesa's layers may have something to say of the session.
        assert!(!run.stderr.contains("warning"), "{run:?}");
        let files = sandbox.files();
        let of = |folder: &str| {
            let names = files.iter().filter_map(|f| f.strip_prefix(folder));
            names.map(String::from).collect::<Vec<_>>()
        };
        assert_eq!(of("gpu/"), of("cpu/"));
        let (cpu, gpu) = (
            numbers(&sandbox, "cpu/sdf.vti"),
            numbers(&sandbox, "gpu/sdf.vti"),
        );
        let largest = cpu.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let pairs = cpu.iter().zip(&gpu);
        let difference = pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(difference < 2e-4 * largest, "{difference:e}");
        let mesh = |name: &str| sandbox.mesh(name);
        assert_eq!(mesh("gpu/mesh.ply").faces, mesh("cpu/mesh.ply").faces);
        let points = |name: &str| sandbox.geometry(name);
        let (cpu, gpu) = (points("cpu/points.ply"), points("gpu/points.ply"));
        assert_eq!((gpu.points, gpu.attributes), (cpu.points, cpu.attributes));
        assert!(gpu.normals.is_some());
        same_report(
            &sandbox.json("cpu/report.json"),
            &sandbox.json("gpu/report.json"),
        );
    }

    fn same_report(cpu: &Value, gpu: &Value) {
        let backend = gpu["backend"].as_str().expect("a text");
        assert!(backend.starts_with("vulkan: "), "{backend}");
        for part in "version input grid normals orientation warnings".split(' ') {
            assert_eq!(cpu[part], gpu[part], "{part}");
        }
        for part in ["faces", "components", "euler", "closed"] {
            assert_eq!(cpu["surface"][part], gpu["surface"][part], "{part}");
        }
        for part in "normals orient splat poisson isosurface distance".split(' ') {
            assert!(gpu["seconds"][part].as_f64() > Some(0.0), "{part}");
        }
    }

    #[test]
    fn given_normals_are_taken_and_auto_says_where_it_went() {
        if !is_here() {
            return;
        }
        let sandbox = sphere();
        let line = "reconstruct cloud.ply --report r.json --resolution 24 --orient given";
        sandbox.done(&format!("{line} --backend vulkan"));
        let found = sandbox.json("r.json");
        assert_eq!(found["orientation"]["method"], "given");
        assert!(found["backend"].as_str().unwrap().starts_with("vulkan: "));
        let run = sandbox.done(&format!("{line} --backend auto"));
        if sandbox.json("r.json")["backend"] == "cpu" {
            run.says(0, &["computed on the CPU: "]);
        }
    }

    #[test]
    fn what_is_wrong_with_a_cloud_is_said_as_on_the_cpu() {
        if !is_here() {
            return;
        }
        let sandbox = sphere();
        let line = "reconstruct cloud.ply --mesh m.ply --resolution 24 --bounds 0 0 0 1 1 1";
        sandbox
            .run(line)
            .says(1, &["cloud.ply: ", "use more padding"]);
        let run = sandbox.run(&format!("{line} --backend vulkan"));
        run.says(1, &["cloud.ply: ", "use more padding"]);
    }
}
