//! A program that is stopped while it writes a file.

use std::io::Write;
use std::process::Command;

/// Set in the process that is stopped: stopping ends all writing in a process.
const STOPPED: &str = "ISOGRAD_IO_TEST_STOPPED";

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
