//! `cargo xtask test`: everything a change must pass, cheapest first.

use crate::examples;
use crate::links;
use crate::nvrtc::Nvrtc;
use crate::process::{self, Outcome};
use crate::python;
use crate::readme;
use crate::steps::Steps;
use crate::tally::Tally;

/// Features of the tests: the kernels are built for their own tests in any case.
pub const FEATURES: &str = "isograd-cli/vulkan,isograd-python/vulkan";

/// All steps, a summary, and the count of tests as the last line.
pub fn all() -> Outcome {
    let mut steps = Steps::default();
    let mut tally = Tally::default();
    let result = run(&mut steps, &mut tally);
    steps.summarize();
    if result.is_ok() || tally.counted() > 0 {
        println!("{}", tally.summary());
    }
    result
}

/// The tests of the Python package.
pub fn python() -> Outcome {
    let mut tally = Tally::default();
    python::run(&mut tally)?;
    println!("{}", tally.summary());
    Ok(())
}

/// Format, links and clippy.
pub fn lint() -> Outcome {
    let mut steps = Steps::default();
    lint_steps(&mut steps)
}

fn run(steps: &mut Steps, tally: &mut Tally) -> Outcome {
    lint_steps(steps)?;
    steps.step("docs", docs)?;
    steps.step("tests", || {
        let nvrtc = Nvrtc::fetch()
            .inspect_err(|reason| println!("PTX tests are left out: {reason}"))
            .ok();
        tests(tally, &["--tests"], nvrtc.as_ref())
    })?;
    steps.step("doc tests", || tests(tally, &["--doc"], None))?;
    steps.step("Python", || python::run(tally))?;
    steps.step("examples", examples::run)?;
    steps.step("README commands", readme::run)
}

fn lint_steps(steps: &mut Steps) -> Outcome {
    steps.step("format", format)?;
    steps.step("links", links::run)?;
    steps.step("clippy", clippy)
}

fn format() -> Outcome<Vec<String>> {
    process::run(&mut process::cargo(["fmt", "--all", "--check"]))
        .map_err(|failure| format!("{failure}; `cargo fmt` mends it"))?;
    Ok(Vec::new())
}

fn clippy() -> Outcome<Vec<String>> {
    process::run(&mut process::cargo([
        "clippy",
        "--workspace",
        "--all-targets",
        "--all-features",
        "--",
        "-D",
        "warnings",
    ]))?;
    Ok(Vec::new())
}

fn docs() -> Outcome<Vec<String>> {
    let mut command = process::cargo(["doc", "--workspace", "--no-deps", "--all-features"]);
    process::run(command.env("RUSTDOCFLAGS", "-D warnings"))?;
    Ok(Vec::new())
}

/// Runs tests to the end, failures or not, and returns the lines of those left out by this call.
fn tests(tally: &mut Tally, targets: &[&str], nvrtc: Option<&Nvrtc>) -> Outcome<Vec<String>> {
    let before = tally.skipped_lines().len();
    let mut command = process::cargo(["test", "--workspace", "--no-fail-fast"]);
    command.args(["--features", FEATURES]);
    command.args(targets).args(["--", "--show-output"]);
    if let Some(nvrtc) = nvrtc {
        nvrtc.tell(&mut command);
    }
    process::run_by_line(&mut command, |line| {
        if tally.read(line) {
            println!("{line}");
        }
    })?;
    Ok(tally.skipped_lines().split_off(before))
}
