//! Output files: links, names, and what reaches the disk.

use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use crate::sandbox::{Run, Sandbox};

/// A sandbox with a small cloud.
fn sandbox() -> Sandbox {
    Sandbox::with("sample sphere -n 300 -o a.ply -q")
}

#[test]
fn another_name_of_the_input_is_refused() {
    let sandbox = sandbox();
    sandbox.done("reconstruct a.ply --mesh m.ply --resolution 16 -q");
    for (link, target) in [("a.ply", "hard.ply"), ("m.ply", "mesh.ply")] {
        fs::hard_link(sandbox.path(link), sandbox.path(target)).expect("links");
    }
    symlink("a.ply", sandbox.path("soft.ply")).expect("links");
    let before = sandbox.read("a.ply");
    let files = sandbox.files();
    for (line, name) in [
        ("reconstruct a.ply --points hard.ply", "hard.ply"),
        ("reconstruct a.ply --points soft.ply", "soft.ply"),
        ("reconstruct hard.ply --points a.ply", "a.ply"),
        ("orient a.ply -o hard.ply", "hard.ply"),
        ("query m.ply --at a.ply -o hard.ply", "hard.ply"),
        ("query m.ply --at a.ply -o mesh.ply", "mesh.ply"),
        ("query m.ply --at a.ply -o a.ply", "a.ply"),
        ("fit --target m.ply --shape sphere -o .", "mesh.ply"),
    ] {
        sandbox
            .run(line)
            .says(2, &[&format!("{name} is the input")]);
    }
    assert_eq!(sandbox.files(), files);
    assert_eq!(sandbox.read("a.ply"), before);
}

#[test]
fn a_link_to_a_missing_file_stays_a_link() {
    let sandbox = sandbox();
    fs::create_dir(sandbox.path("inner")).expect("creates");
    symlink("inner/real.ply", sandbox.path("m.ply")).expect("links");
    sandbox.done("reconstruct a.ply --mesh m.ply --resolution 16 -q");
    let link = fs::symlink_metadata(sandbox.path("m.ply")).expect("there");
    assert!(link.is_symlink());
    sandbox.mesh("inner/real.ply");
    symlink("none/real.ply", sandbox.path("n.ply")).expect("links");
    sandbox.says("1 reconstruct a.ply --mesh n.ply --resolution 16 | n.ply | create its folder");
    symlink("inner/new.ply", sandbox.path("p.ply")).expect("links");
    sandbox.says("2 reconstruct a.ply --mesh p.ply --points inner/new.ply | name of two outputs");
}

#[test]
fn a_name_may_be_as_long_as_the_file_system_permits() {
    let sandbox = sandbox();
    let name = format!("{}.ply", "m".repeat(251));
    sandbox.done(&format!(
        "reconstruct a.ply --mesh {name} --resolution 16 -q"
    ));
    sandbox.mesh(&name);
}

/// A library that stands before that of C: it writes the names of files that are synchronized or renamed, and lets
/// synchronization fail if `SYNC_FAILS` is set.
const RECORDER: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
static const char *base(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}
static void record(const char *what, const char *path) {
    FILE *file = fopen(getenv("RECORD"), "a");
    fprintf(file, "%s %s\n", what, base(path));
    fclose(file);
}
int fsync(int fd) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    path[length < 0 ? 0 : length] = 0;
    record("sync", path);
    if (getenv("SYNC_FAILS")) { errno = EIO; return -1; }
    return 0;
}
int rename(const char *from, const char *to) {
    record("rename", to);
    return ((int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename"))(from, to);
}
"#;

/// Runs `isograd LINE` with the recorder; returns what it has recorded.
fn recorded(sandbox: &Sandbox, line: &str, more: &[(&str, &str)]) -> (Run, Vec<String>) {
    let record = sandbox.path("record");
    let _ = fs::remove_file(&record);
    let mut command = sandbox.command(line);
    command.env("LD_PRELOAD", sandbox.path("recorder.so"));
    command.env("RECORD", &record).envs(more.iter().copied());
    let run = Run::new(command.output().expect("starts"));
    let text = fs::read_to_string(&record).expect("a record");
    (run, text.lines().map(String::from).collect())
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_is_on_the_disk_before_it_gets_its_name_and_the_name_after_that() {
    let sandbox = sandbox();
    sandbox.write("recorder.c", RECORDER);
    let compiler = Command::new("cc")
        .args([
            "-shared",
            "-fPIC",
            "-o",
            "recorder.so",
            "recorder.c",
            "-ldl",
        ])
        .current_dir(sandbox.path("."))
        .status();
    if !compiler.is_ok_and(|status| status.success()) {
        println!("SKIPPED: no C compiler is here");
        return;
    }
    fs::create_dir(sandbox.path("out")).expect("creates");
    let line = "reconstruct a.ply --mesh out/m.ply --sdf out/s.npz --resolution 16 -q";
    let (run, lines) = recorded(&sandbox, line, &[]);
    assert_eq!(run.status, Some(0), "{run:?}");
    let [
        sync_m,
        "rename m.ply",
        "sync out",
        sync_s,
        "rename s.npz",
        "sync out",
    ] = lines.iter().map(String::as_str).collect::<Vec<_>>()[..]
    else {
        panic!("{lines:?}");
    };
    for sync in [sync_m, sync_s] {
        assert!(sync.starts_with("sync .isograd-"), "{sync}");
    }
    let before = sandbox.read("out/m.ply");
    let (run, lines) = recorded(&sandbox, line, &[("SYNC_FAILS", "1")]);
    run.says(1, &["cannot write out/m.ply", "error"]);
    assert_eq!(lines.len(), 1, "it is not renamed: {lines:?}");
    assert_eq!(sandbox.read("out/m.ply"), before, "the old file stays");
    let left = fs::read_dir(sandbox.path("out")).expect("folder").count();
    assert_eq!(left, 2, "no temporary file is left");
}
