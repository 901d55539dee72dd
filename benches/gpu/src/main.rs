//! Measures time and memory on a GPU, and writes `docs/gpu.json` and the part of `docs/gpu.md` that is about speed:
//! `cargo xtask gpu`.
//!
//! Times are those of a GPU or of nothing: a driver that computes on the CPU says how much memory the paper's fish
//! takes, which hardly depends on who computes.

mod page;
mod problem;
mod study;

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use isograd_gpu::Device;
use isograd_page::program::{Outcome, run};

use study::Results;

fn main() -> ExitCode {
    run(|folder, _| {
        let results = measure()?;
        let json = serde_json::to_string_pretty(&results)?;
        fs::write(folder.join("gpu.json"), json + "\n")?;
        write_page(&folder.join("gpu.md"), &results)?;
        println!("{}", folder.join("gpu.md").display());
        Ok(())
    })
}

/// On the best device there is.
fn measure() -> Outcome<Results> {
    #[cfg(feature = "cuda")]
    match Device::cuda(0) {
        Ok(device) => return study::all(&device, "CUDA"),
        Err(error) => eprintln!("{error}"),
    }
    match Device::vulkan_gpu() {
        Ok(device) => return study::all(&device, "Vulkan"),
        Err(error) => eprintln!("{error}"),
    }
    study::memory_alone(&Device::vulkan()?)
}

/// Puts the results between the marks of the page.
fn write_page(path: &Path, results: &Results) -> Outcome {
    let page = fs::read_to_string(path)?;
    let (before, rest) = page
        .split_once(page::BEGIN)
        .ok_or("the page has no place")?;
    let (_, after) = rest.split_once(page::END).ok_or("the place has no end")?;
    let text = page::speed(results);
    let (begin, end) = (page::BEGIN, page::END);
    fs::write(path, format!("{before}{begin}{text}{end}{after}"))?;
    Ok(())
}
