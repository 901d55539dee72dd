//! The program among others: signals, standard output, threads, and what it prints to a terminal.

use std::fs::OpenOptions;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::sandbox::{Run, Sandbox};

/// Bytes that a pipe holds on Linux.
const PIPE_SIZE: usize = 1 << 16;

/// A sandbox with a small cloud.
fn sandbox() -> Sandbox {
    Sandbox::with("sample sphere -n 300 -o a.ply -q")
}

/// A line of `/proc/PID/status`, as a number.
fn status_line(child: &Child, name: &str) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{}/status", child.id())).expect("it runs");
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    u64::from_str_radix(line.expect("a line").trim(), 16).expect("a number")
}

/// A child that waits for its standard input, and handles or ignores SIGHUP, SIGINT and SIGTERM.
fn waiting(command: Command) -> Child {
    waiting_with(command, Stdio::piped())
}

/// Like [`waiting`], with this standard error.
fn waiting_with(mut command: Command, stderr: Stdio) -> Child {
    const SIGNALS: u64 = 1 | 1 << 1 | 1 << 14;
    command.stdin(Stdio::piped()).stdout(Stdio::null());
    let child = command.stderr(stderr).spawn().expect("starts");
    let is_ready = |masks: [u64; 2]| (masks[0] | masks[1]) & SIGNALS == SIGNALS;
    while !is_ready(["SigCgt:", "SigIgn:"].map(|name| status_line(&child, name))) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// The exit status of a waiting child after a signal.
fn stopped(mut child: Child, signal: &str) -> Option<i32> {
    // Kept open, or `wait` would close it, and the end of the input could be first.
    let input = child.stdin.take();
    kill(&child, signal);
    let status = child.wait().expect("it ends");
    drop(input);
    status.code()
}

fn kill(child: &Child, signal: &str) {
    let mut kill = Command::new("kill");
    kill.args([signal, &child.id().to_string()]);
    assert!(kill.status().expect("kill is there").success());
}

/// Runs a script of bash, where `$0` is the program.
fn bash(sandbox: &Sandbox, script: &str) -> Run {
    let mut command = Command::new("bash");
    command.args(["-c", script, env!("CARGO_BIN_EXE_isograd")]);
    command.current_dir(sandbox.path("."));
    Run::new(command.output().expect("bash starts"))
}

#[test]
fn each_signal_ends_with_128_and_its_number() {
    let sandbox = Sandbox::new();
    for (signal, status) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let child = waiting(sandbox.command("reconstruct - -o out"));
        if status_line(&child, "SigIgn:") >> (status - 129) & 1 == 1 {
            println!("SKIPPED: {signal} is ignored here, as under nohup");
            stopped(child, "-KILL");
            continue;
        }
        assert_eq!(stopped(child, signal), Some(status));
    }
    assert!(sandbox.files().is_empty());
}

#[test]
fn work_that_ends_after_a_signal_leaves_the_status_to_it() {
    let sandbox = Sandbox::new();
    // Standard error is full, so the thread of signals waits before it ends the program, and the work ends first.
    let (mut reader, mut writer) = std::io::pipe().expect("a pipe");
    writer.write_all(&[b'.'; PIPE_SIZE]).expect("writes");
    let mut child = waiting_with(sandbox.command("info -"), writer.into());
    kill(&child, "-TERM");
    let mut input = child.stdin.take().expect("piped");
    // Nothing shows when the thread has woken up; if the work ended before that, its status would count.
    std::thread::sleep(Duration::from_secs(1));
    input.write_all(b"0 0 0\n1 0 0\n0 1 0\n").expect("writes");
    drop(input);
    // Time for the work to end, without which the test passes in any case.
    std::thread::sleep(Duration::from_millis(300));
    std::io::copy(&mut reader, &mut std::io::sink()).expect("reads");
    assert_eq!(child.wait().expect("it ends").code(), Some(143));
}

#[test]
fn a_signal_that_was_ignored_at_the_start_stays_ignored() {
    let sandbox = Sandbox::new();
    let mut command = Command::new("bash");
    let script = "trap '' HUP; exec \"$0\" reconstruct - -o out";
    command.args(["-c", script, env!("CARGO_BIN_EXE_isograd")]);
    let child = waiting(command);
    assert_eq!(status_line(&child, "SigIgn:") & 1, 1);
    assert_eq!(status_line(&child, "SigCgt:") & 1, 0);
    kill(&child, "-HUP");
    assert_eq!(stopped(child, "-TERM"), Some(143));
    assert!(sandbox.files().is_empty());
}

#[test]
fn output_that_is_full_or_closed_is_an_error() {
    let sandbox = sandbox();
    for line in [
        "info a.ply",
        "sample --list",
        "--help",
        "--version",
        "sample sphere -n 5 -o b.ply",
    ] {
        bash(&sandbox, &format!("\"$0\" {line} > /dev/full"))
            .says(1, &["error: cannot write to standard output", "space"]);
        bash(&sandbox, &format!("\"$0\" {line} >&-"))
            .says(1, &["error: cannot write to standard output", "closed"]);
        bash(&sandbox, &format!("\"$0\" {line} > /dev/null")).says(0, &[]);
    }
    let quiet = bash(&sandbox, "\"$0\" sample sphere -n 5 -o c.ply -q >&-");
    assert_eq!((quiet.status, &*quiet.stderr), (Some(0), ""));
}

#[test]
fn files_are_complete_where_standard_output_is_full() {
    let sandbox = sandbox();
    bash(
        &sandbox,
        "\"$0\" reconstruct a.ply -o out --resolution 16 > /dev/full",
    )
    .says(1, &["error: cannot write to standard output"]);
    let files: Vec<String> = sandbox.files();
    assert_eq!(files.len(), 6, "{files:?}");
}

#[test]
fn a_pipe_without_a_reader_ends_quietly_with_141() {
    let sandbox = sandbox();
    for line in ["sample --list", "info a.ply", "--help"] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = sandbox.command(line);
        let output = command.stdout(writer).output().expect("starts");
        assert_eq!(output.status.code(), Some(141), "{line}");
        assert!(output.stderr.is_empty(), "{line}");
    }
}

#[test]
fn the_error_of_the_work_comes_before_that_of_standard_output() {
    let sandbox = sandbox();
    let run = bash(&sandbox, "\"$0\" info none.ply > /dev/full");
    run.says(1, &["none.ply"]);
    let mut command = sandbox.command("reconstruct a.ply --mesh");
    command.arg("no\u{1b}[31m");
    let full = OpenOptions::new().write(true).open("/dev/full");
    let output = command.stdout(full.expect("opens")).output();
    assert_eq!(output.expect("starts").status.code(), Some(2));
}

#[test]
fn control_characters_from_files_do_not_reach_the_terminal() {
    let sandbox = sandbox();
    let name = "a\u{1b}[31m\nwarning: b\u{202e}.xyz";
    sandbox.write(name, "0 0 zero\n");
    let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float w\u{1b}[2J\nend_header\n1 2 3 4\n";
    sandbox.write("b.ply", header);
    for arguments in [
        &["info", name][..],
        &["reconstruct", name, "-o", "out"],
        &["reconstruct", "none.ply", "-o", "out", name],
        &["reconstruct", "a.ply", "--mesh", name],
        &["info", "b.ply"],
    ] {
        let output = sandbox.command("").args(arguments).output();
        let output = output.expect("starts");
        for bytes in [&output.stdout, &output.stderr] {
            let text = String::from_utf8_lossy(bytes);
            let bad = |c: char| c != '\n' && (c.is_control() || c == '\u{202e}');
            assert!(!text.contains(bad), "{text:?}");
            assert!(!text.contains("\nwarning:"), "{text:?}");
        }
        let all = [output.stdout, output.stderr].concat();
        assert!(
            String::from_utf8_lossy(&all).contains("\\u{1b}["),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&all)
        );
    }
}

#[test]
fn lines_are_cut_at_500_characters() {
    let sandbox = sandbox();
    let path = "./".repeat(800);
    for line in [
        format!("info {path}none.ply"),
        format!("reconstruct {path}a.ply -o {path}a.ply"),
    ] {
        let run = sandbox.run(&line);
        assert!(matches!(run.status, Some(1 | 2)), "{run:?}");
        assert!(run.stderr.contains('…'), "{run:?}");
        let lengths = run.stderr.lines().map(|line| line.chars().count());
        assert!(lengths.max() <= Some(500), "{run:?}");
    }
}

#[test]
fn no_more_threads_are_started_than_are_useful() {
    let sandbox = Sandbox::new();
    let child = waiting(sandbox.command("reconstruct - -o out --threads 1024"));
    let threads = || {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", child.id()));
        tasks.expect("it runs").count()
    };
    // Until no more are started.
    let (mut count, mut unchanged) = (threads(), 0);
    while unchanged < 50 || count < 3 {
        std::thread::sleep(Duration::from_millis(10));
        let now = threads();
        unchanged = if now == count { unchanged + 1 } else { 0 };
        count = now;
    }
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    // Its own, that of signals, and those of the pool.
    assert!(count <= 2 + cores.max(16), "{count}");
    assert_eq!(stopped(child, "-TERM"), Some(143));
}
