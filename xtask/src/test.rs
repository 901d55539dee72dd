//! `cargo xtask test [--all]`: everything a change must pass, cheapest first.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

use crate::examples;
use crate::fuzz;
use crate::limits;
use crate::links;
use crate::nvrtc::Nvrtc;
use crate::packages;
use crate::pages;
use crate::process::{self, Outcome};
use crate::programs;
use crate::python;
use crate::readme;
use crate::steps::Steps;
use crate::tally::Tally;
use crate::workspace::Workspace;

/// Which packages and features a run covers.
///
/// Every cargo command of a run selects the same packages and features, so that each dependency is built once: cargo
/// builds a crate anew wherever its features differ.
#[derive(Clone, Copy, PartialEq)]
pub enum Scope {
    /// The default members of the workspace, without GPU kernels.
    Default,
    /// All members; kernels on Vulkan and as PTX, PyTorch, packages.
    All,
}

impl Scope {
    /// `cargo COMMAND` on the packages of this scope.
    fn cargo(self, command: &str) -> Command {
        let mut cargo = process::cargo([command]);
        if self == Self::All {
            cargo.arg("--workspace");
        }
        cargo
    }

    /// `cargo COMMAND` with the features that are built, not only checked.
    fn cargo_built(self, command: &str) -> Command {
        let mut cargo = self.cargo(command);
        if self == Self::All {
            cargo.args(["--features", "isograd-cli/vulkan,isograd-python/vulkan"]);
        }
        cargo
    }

    /// `cargo COMMAND` with the features that are checked.
    fn cargo_checked(self, command: &str) -> Command {
        let mut cargo = self.cargo(command);
        if self == Self::All {
            cargo.arg("--all-features");
        }
        cargo
    }

    /// Builds libraries, programs, examples and tests, in the dev profile.
    pub fn build(self) -> Outcome<Vec<String>> {
        build(&mut self.cargo_built("build"))?;
        Ok(Vec::new())
    }
}

/// Builds the default members and one more package, with the features of the former.
pub fn build_default_and(package: &str) -> Outcome {
    let mut command = process::cargo(["build", "--package", package]);
    for name in Workspace::load()?.default_members {
        command.args(["--package", &name]);
    }
    build(&mut command)
}

/// Runs `cargo build …` for libraries, programs, examples and tests. With other targets, features would differ.
fn build(command: &mut Command) -> Outcome {
    process::run(command.args(["--lib", "--bins", "--examples", "--tests"]))
}

/// All steps, a summary, and the count of tests as the last line.
pub fn run(scope: Scope) -> Outcome {
    let mut steps = Steps::default();
    let mut tally = Tally::default();
    let result = run_steps(scope, &mut steps, &mut tally);
    steps.summarize();
    if result.is_ok() || tally.counted() > 0 {
        println!("{}", tally.summary());
    }
    result
}

/// The tests of the Python package.
pub fn python() -> Outcome {
    let mut tally = Tally::default();
    Scope::Default.build()?;
    python::run(Scope::Default, &mut tally)?;
    println!("{}", tally.summary());
    Ok(())
}

/// Format, limits, links and clippy.
pub fn lint() -> Outcome {
    lint_steps(Scope::All, &mut Steps::default())
}

fn run_steps(scope: Scope, steps: &mut Steps, tally: &mut Tally) -> Outcome {
    lint_steps(scope, steps)?;
    thread::scope(|threads| {
        // Installing packages waits for the network, and uses one core.
        threads.spawn(|| python::install(scope));
        steps.step("docs", || docs(scope))?;
        steps.step("build", || scope.build())
    })?;
    let nvrtc = (scope == Scope::All).then(Nvrtc::fetch).and_then(|nvrtc| {
        nvrtc
            .inspect_err(|reason| println!("PTX tests are skipped: {reason}"))
            .ok()
    });
    steps.step("tests", || tests(scope, tally, nvrtc.as_ref()))?;
    steps.step("doc tests", || doc_tests(scope, tally))?;
    steps.step("Python", || python::run(scope, tally))?;
    steps.step("examples", examples::run)?;
    steps.step("README commands", readme::run)?;
    match scope {
        Scope::Default => Ok(()),
        Scope::All => steps_of_packages(steps),
    }
}

fn steps_of_packages(steps: &mut Steps) -> Outcome {
    thread::scope(|threads| {
        // They are silent, build in a folder of their own, and use one core, as fuzz does.
        let others = threads.spawn(|| (packages::source_distribution(), pages::check()));
        steps.step("fuzz", fuzz::short)?;
        steps.step("crates", packages::crates)?;
        let (distribution, pages) = others.join().map_err(|_| "a step panicked".to_owned())?;
        steps.step("source distribution", || distribution)?;
        steps.step("pages", || pages)
    })
}

fn lint_steps(scope: Scope, steps: &mut Steps) -> Outcome {
    steps.step("format", format)?;
    steps.step("limits", limits::run)?;
    steps.step("links", links::run)?;
    steps.step("clippy", || clippy(scope))
}

fn format() -> Outcome<Vec<String>> {
    process::run(&mut process::cargo(["fmt", "--all", "--check"]))
        .map_err(|failure| format!("{failure}; run `cargo fmt`"))?;
    Ok(Vec::new())
}

fn clippy(scope: Scope) -> Outcome<Vec<String>> {
    let mut clippy = scope.cargo_checked("clippy");
    process::run(clippy.args(["--all-targets", "--", "-D", "warnings"]))?;
    Ok(Vec::new())
}

/// As clippy ran before, it has checked all that `cargo doc` needs: with its driver in place of the compiler, nothing is
/// checked twice.
fn docs(scope: Scope) -> Outcome<Vec<String>> {
    let mut docs = scope.cargo_checked("doc");
    docs.arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings");
    if let Some(driver) = clippy_driver() {
        // As `cargo clippy -- -D warnings` sets them; with others, cargo would check everything again.
        docs.env("RUSTC_WORKSPACE_WRAPPER", driver);
        let arguments = "-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__";
        docs.env("CLIPPY_ARGS", arguments);
    }
    process::run(&mut docs)?;
    Ok(Vec::new())
}

/// The compiler with clippy's lints, where it is installed.
fn clippy_driver() -> Option<PathBuf> {
    let output = Command::new("rustc").args(["--print", "sysroot"]).output();
    let sysroot = String::from_utf8(output.ok()?.stdout).ok()?;
    let name = format!("clippy-driver{}", std::env::consts::EXE_SUFFIX);
    let driver = Path::new(sysroot.trim()).join("bin").join(name);
    driver.is_file().then_some(driver)
}

/// Runs test programs, and returns the `SKIPPED` lines of this call.
fn tests(scope: Scope, tally: &mut Tally, nvrtc: Option<&Nvrtc>) -> Outcome<Vec<String>> {
    let before = tally.skipped_lines().len();
    let prepare = |program: &mut Command| {
        if let Some(nvrtc) = nvrtc {
            nvrtc.set_paths(program);
        }
    };
    let mut command = scope.cargo_built("test");
    programs::run(command.arg("--tests"), prepare, |line| read(tally, line))?;
    Ok(tally.skipped_lines().split_off(before))
}

/// Runs doc tests, and returns the `SKIPPED` lines of this call.
fn doc_tests(scope: Scope, tally: &mut Tally) -> Outcome<Vec<String>> {
    let before = tally.skipped_lines().len();
    let mut command = scope.cargo_built("test");
    command.args(["--no-fail-fast", "--doc", "--", "--show-output"]);
    process::run_by_line(&mut command, |line| read(tally, line))?;
    Ok(tally.skipped_lines().split_off(before))
}

fn read(tally: &mut Tally, line: &str) {
    if tally.read(line) {
        println!("{line}");
    }
}
