//! A program that is stopped while it writes a file.

use std::io::Write;
use std::process::Command;

/// Set in the process that is stopped: stopping ends all writing in a process.
const STOPPED: &str = "ISOGRAD_IO_TEST_STOPPED";

/// Set to the output of the process that dies.
const KILLED: &str = "ISOGRAD_IO_TEST_KILLED";

#[test]
fn the_next_write_removes_what_a_killed_process_has_left() {
    if let Some(path) = std::env::var_os(KILLED) {
        let killed = isograd_io::atomic::write(path.as_ref(), |out| {
            out.write_all(b"half")?;
            // Like a kill: nothing is dropped.
            std::process::exit(9)
        });
        unreachable!("{killed:?}");
    }
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.ply");
    let mut program = Command::new(std::env::current_exe().expect("path of this program"));
    program.args([
        "--exact",
        "stopping::the_next_write_removes_what_a_killed_process_has_left",
    ]);
    let output = program.env(KILLED, &path).output().expect("starts");
    assert!(!output.status.success(), "it is killed");
    let count = || std::fs::read_dir(folder.path()).expect("folder").count();
    assert_eq!(count(), 1, "a temporary file is left");
    assert!(!path.exists());
    isograd_io::atomic::write(&path, |out| out.write_all(b"new")).expect("writes");
    assert_eq!(std::fs::read(&path).expect("there"), b"new");
    assert_eq!(count(), 1, "the temporary file is gone");
}

#[test]
fn stopping_removes_unfinished_files_and_keeps_existing_ones() {
    if std::env::var_os(STOPPED).is_none() {
        let mut program = Command::new(std::env::current_exe().expect("path of this program"));
        program.args([
            "--exact",
            "stopping::stopping_removes_unfinished_files_and_keeps_existing_ones",
        ]);
        let output = program.env(STOPPED, "1").output().expect("starts");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success() && text.contains("1 passed"),
            "{text}"
        );
        return;
    }
    let folder = tempfile::tempdir().expect("temporary folder");
    let names = || {
        let entries = std::fs::read_dir(folder.path()).expect("folder");
        let mut names: Vec<_> = entries.map(|e| e.expect("entry").file_name()).collect();
        names.sort();
        names
    };
    let path = folder.path().join("a.ply");
    std::fs::write(&path, b"old").expect("writes");
    let result = isograd_io::atomic::write(&path, |out| {
        out.write_all(b"new")?;
        assert_eq!(names().len(), 2, "the temporary file and the old one");
        isograd_io::atomic::remove_unfinished();
        assert_eq!(names(), ["a.ply"]);
        Ok(())
    });
    assert!(result.is_err(), "a stopped writer must not finish");
    assert_eq!(std::fs::read(&path).expect("still there"), b"old");
    let later = isograd_io::atomic::write(&folder.path().join("b.ply"), |_| Ok(()));
    assert!(later.is_err(), "no writer begins after the stop");
    assert_eq!(names(), ["a.ply"]);
}
