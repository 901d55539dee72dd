//! Limits of memory: an error, never an abort.

use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};

use crate::sandbox::{Run, Sandbox};

/// Runs `isograd LINE` with `mebibytes` of address space; returns its signal, too.
fn limited(sandbox: &Sandbox, line: &str, mebibytes: u64) -> (Option<i32>, Run) {
    let mut command = Command::new("bash");
    let script = format!(
        "ulimit -c 0; ulimit -v {}; exec \"$0\" {line}",
        mebibytes << 10
    );
    command.args(["-c", &script, env!("CARGO_BIN_EXE_isograd")]);
    command.current_dir(sandbox.path(".")).stdin(Stdio::null());
    let output = command.output().expect("bash starts");
    (output.status.signal(), Run::new(output))
}

/// The least address space in which the program can be loaded, in MiB.
fn least(sandbox: &Sandbox) -> u64 {
    let starts = |&mebibytes: &u64| limited(sandbox, "--version", mebibytes).1.status == Some(0);
    (4..1000).find(starts).expect("it starts")
}

#[test]
fn too_little_address_space_is_an_error_of_every_command() {
    let sandbox = Sandbox::with("sample sphere -n 20000 -o a.ply -q");
    sandbox.done("reconstruct a.ply -q --mesh m.ply --sdf s.vti --resolution 96");
    let least = least(&sandbox);
    let files = sandbox.files();
    let mut failed = 0;
    for line in [
        "reconstruct a.ply -o out --resolution 96 -q",
        "reconstruct a.ply -o out --resolution 400 -q --threads 16",
        "orient a.ply -o out.ply -q",
        "sample airliner -n 100000 -o out.ply -q",
        "query m.ply --at a.ply -o out.ply -q",
        "query s.vti --at a.ply -o out.ply -q",
        "fit --target m.ply --shape sphere -n 500 --resolution 16 --epochs 1 -o out -q",
        "gradcheck a.ply --resolution 16 -q",
        "info m.ply",
    ] {
        for more in [0, 1, 3, 8, 21, 55, 144] {
            let (signal, run) = limited(&sandbox, line, least + more);
            let place = format!("{line} with {least} + {more} MiB: signal {signal:?}, {run:?}");
            // Where memory runs out in a new thread before it runs our code, the C library or Rust's ends it.
            let in_runtime = [
                "Fatal glibc error",
                "failed to allocate an alternative stack",
            ];
            let in_runtime = in_runtime.iter().any(|text| run.stderr.contains(text));
            let is_aborted = in_runtime && signal == Some(6);
            assert!(is_aborted || matches!(run.status, Some(0 | 1)), "{place}");
            if run.status == Some(1) {
                failed += 1;
                let reasons = ["memory", "are free (", "threads could not be started"];
                let says = reasons.iter().any(|reason| run.stderr.contains(reason));
                assert!(says, "{place}");
                assert!(in_runtime || !run.stderr.contains("panicked"), "{place}");
            }
            let left = sandbox.files().into_iter();
            let left = left.filter(|name| !files.contains(name));
            for name in left {
                assert!(!name.contains(".isograd-"), "{name} is left: {place}");
                std::fs::remove_file(sandbox.path(&name)).expect("removes");
            }
        }
    }
    assert!(failed > 15, "{failed} limits were too small");
}

#[test]
fn the_limit_that_is_too_small_is_named() {
    let sandbox = Sandbox::with("sample sphere -n 500 -o a.ply -q");
    let (_, run) = limited(&sandbox, "reconstruct a.ply -o out --resolution 500", 1000);
    run.says(
        1,
        &[
            "a grid of [500, 5",
            "GiB",
            "ulimit -v",
            "use a lower resolution",
        ],
    );
}
