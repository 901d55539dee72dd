//! Time and memory on a GPU, as JSON: `gpu-times [--any-device] [FILE]` writes FILE, or else prints to standard output.
//!
//! CUDA is tried first, if built in, then Vulkan. With `--any-device`, a Vulkan driver that computes on the CPU is accepted:
//! then only memory, kernels and waits are measured. Exit status: 0 done, 1 a measurement failed, 3 no device.

use std::fs;
use std::process::ExitCode;

use isograd_benches::gpu::{Results, memory, time_and_memory};
use isograd_benches::output::Outcome;
use isograd_gpu::Device;

const NO_DEVICE: u8 = 3;

fn main() -> ExitCode {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let any_device = arguments.iter().any(|argument| argument == "--any-device");
    arguments.retain(|argument| argument != "--any-device");
    let mut reasons = Vec::new();
    let Some(results) = on_any_device(any_device, &mut reasons) else {
        eprintln!("error: no GPU\n  {}", reasons.join("\n  "));
        return ExitCode::from(NO_DEVICE);
    };
    match results.and_then(|results| write(&results, arguments.first())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn write(results: &Results, file: Option<&String>) -> Outcome {
    let text = serde_json::to_string_pretty(results)? + "\n";
    match file {
        Some(file) => fs::write(file, text)?,
        None => print!("{text}"),
    }
    Ok(())
}

/// Measures on the first device that is available, or collects the reasons why none is.
fn on_any_device(any_device: bool, reasons: &mut Vec<String>) -> Option<Outcome<Results>> {
    #[cfg(feature = "cuda")]
    match Device::cuda(0) {
        Ok(device) => return Some(time_and_memory(&device, "CUDA")),
        Err(error) => reasons.push(error.to_string()),
    }
    match Device::vulkan_gpu() {
        Ok(device) => return Some(time_and_memory(&device, "Vulkan")),
        Err(error) => reasons.push(error.to_string()),
    }
    if !any_device {
        return None;
    }
    match Device::vulkan() {
        Ok(device) => Some(memory(&device)),
        Err(error) => {
            reasons.push(error.to_string());
            None
        }
    }
}
