//! `cargo xtask gpu --pack`: tests and benchmarks for a machine that has an NVIDIA driver, but neither Rust nor network.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::environment::{self, Obstacle};
use crate::nvrtc::Nvrtc;
use crate::process::{self, Outcome};
use crate::python;
use crate::workspace::Workspace;

/// A profile like `release` that builds in less time.
const PROFILE: &str = "gpu-kit";
const LIMIT_MIB: u64 = 60;
/// Of NVRTC; its `alt` libraries are a second build of the same.
const LIBRARIES: [&str; 2] = ["libnvrtc.so.12", "libnvrtc-builtins.so.12.9"];

/// Builds the folder `isograd-gpu-kit` below the target folder, and an archive of it.
pub fn pack() -> Outcome {
    let target = Workspace::load()?.target;
    let kit = target.join("isograd-gpu-kit");
    let nvrtc = Nvrtc::fetch()?;
    let programs = build(&target)?;
    environment::remove_folder(&kit)?;
    for folder in ["bin", "cuda/lib"] {
        let folder = kit.join(folder);
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    for (name, program) in ["conformance", "gpu-times"].iter().zip(programs) {
        environment::copy(&program, &kit.join("bin").join(name))?;
    }
    let nvidia = nvrtc.folder.join("nvidia");
    for name in LIBRARIES {
        let library = nvidia.join("cuda_nvrtc/lib").join(name);
        environment::copy(&library, &kit.join("cuda/lib").join(name))?;
    }
    environment::copy_folder(
        &nvidia.join("cuda_runtime/include"),
        &kit.join("cuda/include"),
    )?;
    let scripts = process::root().join("scripts");
    environment::copy(&scripts.join("gpu_kit.sh"), &kit.join("run.sh"))?;
    environment::copy(&scripts.join("gpu_kit_wheel.py"), &kit.join("try_wheel.py"))?;
    match wheel(&target, &kit) {
        Ok(()) => {}
        Err(Obstacle::Absent(reason)) => println!("SKIPPED wheel: {reason}"),
        Err(Obstacle::Failure(failure)) => return Err(failure),
    }
    archive(&kit)
}

/// Builds with CUDA and returns the paths of the conformance tests and the benchmark.
fn build(target: &Path) -> Outcome<[PathBuf; 2]> {
    let mut cargo = process::cargo(["build", "--profile", PROFILE, "--message-format=json"]);
    for package in ["isograd-gpu", "isograd-benches", "isograd-python"] {
        cargo.args(["--package", package]);
    }
    cargo.args([
        "--features",
        "isograd-gpu/cuda,isograd-benches/cuda,isograd-python/cuda",
    ]);
    cargo.args(["--lib", "--test", "conformance", "--bin", "gpu-times"]);
    let mut conformance = None;
    process::run_by_line(cargo.env("CARGO_TARGET_DIR", target), |line| {
        let message: Value = serde_json::from_str(line).unwrap_or_default();
        if message["target"]["name"] == "conformance" {
            conformance = message["executable"].as_str().map(PathBuf::from);
        }
    })?;
    let conformance = conformance.ok_or("cargo built no conformance tests")?;
    Ok([conformance, target.join(PROFILE).join("gpu-times")])
}

/// Packs the Python package with CUDA as a wheel into the kit.
fn wheel(target: &Path, kit: &Path) -> Result<(), Obstacle> {
    let environment = python::environment(target)?;
    environment.install(&[&"wheel>=0.45"], &[])?;
    let package = target.join("xtask/python/kit");
    python::assemble_package(&environment, &target.join(PROFILE), &package)?;
    let mut pack = environment.module("wheel", &["pack", "--dest-dir"]);
    environment::capture(pack.arg(kit).arg(package))?;
    Ok(())
}

/// Packs the folder as `isograd-gpu-kit.tar.xz` beside it.
fn archive(kit: &Path) -> Outcome {
    let file = kit.with_extension("tar.xz");
    let mut tar = Command::new("tar");
    tar.arg("-cJf").arg(&file);
    tar.arg("-C")
        .arg(kit.with_file_name(""))
        .args(kit.file_name());
    process::run(&mut tar)?;
    let bytes = fs::metadata(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mib = bytes.len() >> 20;
    println!("{}: {mib} MiB; unpack it and start run.sh", file.display());
    if mib > LIMIT_MIB {
        return Err(format!("the kit has {mib} MiB, more than {LIMIT_MIB}"));
    }
    Ok(())
}

/// Puts the benchmark and the test results of a kit's run into `docs/gpu.json`.
pub fn import(file: &str) -> Outcome {
    let text = fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let mut run: Value = serde_json::from_str(&text).map_err(|e| format!("{file}: {e}"))?;
    let mut results = run["benchmark"].take();
    if !results.is_object() {
        return Err(format!("{file} has no benchmark: the kit's run failed"));
    }
    for key in ["driver", "conformance", "sanitizer", "wheel"] {
        results[key] = run[key].take();
    }
    let path = process::root().join("docs/gpu.json");
    let text = serde_json::to_string_pretty(&results).map_err(|e| e.to_string())? + "\n";
    fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}
