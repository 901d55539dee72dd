//! What happens to a file that is being written when the program is told to stop. One test alone: it
//! ends all writing in this process.

use std::io::Write;

#[test]
fn stopping_removes_what_is_unfinished_and_keeps_what_was_there() {
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
        assert_eq!(
            names().len(),
            2,
            "the temporary file stands beside the old one"
        );
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
