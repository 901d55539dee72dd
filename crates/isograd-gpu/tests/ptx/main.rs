//! Every kernel as CUDA C++, compiled to PTX for sm_90 by NVRTC: no GPU is needed for that.
//!
//! `cargo xtask test --all` fetches NVRTC from PyPI and sets `ISOGRAD_CUDA_INCLUDE` to the folder of its headers.

mod recorder;
mod stages;

use cubecl::prelude::*;
use cudarc::nvrtc::{CompileOptions, compile_ptx_with_opts};
use isograd_gpu::Device;
use recorder::{Paper, Recorder, sources};

#[test]
fn every_kernel_becomes_ptx() {
    let device = Device::new(Recorder::client(&Paper), "an H100 on paper".into()).with_f64();
    stages::launch_all::<f32>(&device);
    stages::launch_all::<f64>(&device);
    device.wait().unwrap();
    let sources = sources();
    let launched: Vec<&str> = sources.keys().map(String::as_str).collect();
    for kernel in kernels_of_the_crate() {
        assert!(
            launched.iter().any(|name| name.contains(&kernel)),
            "no stage launched {kernel}: add its call to tests/ptx/stages.rs"
        );
    }
    let Ok(include) = std::env::var("ISOGRAD_CUDA_INCLUDE") else {
        println!("SKIPPED PTX: ISOGRAD_CUDA_INCLUDE is not set; `cargo xtask test --all` sets it");
        return;
    };
    let sources: Vec<_> = sources.iter().collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for part in sources.chunks(sources.len().div_ceil(threads)) {
            scope.spawn(|| {
                part.iter()
                    .for_each(|(name, text)| compile(name, text, &include))
            });
        }
    });
    println!("{} kernels became PTX", sources.len());
}

fn compile(name: &str, source: &str, include: &str) {
    let options = CompileOptions {
        arch: Some("sm_90"),
        include_paths: vec![include.into(), format!("{include}/cccl")],
        ..Default::default()
    };
    if let Err(error) = compile_ptx_with_opts(source, options) {
        panic!("{name}: {error:?}\n{source}");
    }
}

/// The names of all `#[cube(launch)]` functions below `src`.
fn kernels_of_the_crate() -> Vec<String> {
    let mut folders = vec![std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src")];
    let mut names = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let text = std::fs::read_to_string(path).unwrap();
                for part in text.split("#[cube(launch)]").skip(1) {
                    let name = part.split("fn ").nth(1).unwrap();
                    let end = name.find(|c: char| !c.is_alphanumeric() && c != '_');
                    names.push(name[..end.unwrap()].to_string());
                }
            }
        }
    }
    assert!(names.len() > 5, "found only {names:?}");
    names
}
