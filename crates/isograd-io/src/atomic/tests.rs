//! Files that are complete, unchanged or absent.

use super::*;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("folder")
        .map(|entry| entry.expect("entry").file_name().to_string_lossy().into())
        .collect();
    names.sort();
    names
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.txt");
    write(&path, |out| out.write_all(b"old")).expect("writes");
    let failed = write(&path, |out| {
        out.write_all(&[b'x'; 1 << 18])?;
        Err(io::ErrorKind::StorageFull.into())
    });
    let message = failed.expect_err("fails").to_string();
    assert!(
        message.contains("a.txt") && message.contains("space"),
        "{message}"
    );
    assert_eq!(fs::read(&path).expect("still there"), b"old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_finished_write_replaces_the_old_file() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.txt");
    for content in [b"first".as_slice(), b"second"] {
        write(&path, |out| out.write_all(content)).expect("writes");
        assert_eq!(fs::read(&path).expect("there"), content);
    }
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (file, link) = (folder.path().join("file"), folder.path().join("link"));
    fs::write(&file, b"old").expect("writes");
    std::os::unix::fs::symlink(&file, &link).expect("links");
    write(&link, |out| out.write_all(b"new")).expect("writes");
    assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
    assert_eq!(fs::read(&file).expect("there"), b"new");
}

#[cfg(unix)]
#[test]
fn a_link_to_a_missing_file_stays_a_link() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let place = |name: &str| folder.path().join(name);
    fs::create_dir(place("inner")).expect("creates");
    std::os::unix::fs::symlink("inner/second", place("first")).expect("links");
    std::os::unix::fs::symlink("../file", place("inner/second")).expect("links");
    write(&place("first"), |out| out.write_all(b"new")).expect("writes");
    for link in ["first", "inner/second"] {
        let metadata = fs::symlink_metadata(place(link)).expect("there");
        assert!(metadata.is_symlink(), "{link}");
    }
    assert_eq!(fs::read(place("file")).expect("there"), b"new");
    assert_eq!(names(folder.path()), ["file", "first", "inner"]);
}

#[cfg(unix)]
#[test]
fn links_in_a_circle_are_an_error_and_stay() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    std::os::unix::fs::symlink(&a, &b).expect("links");
    std::os::unix::fs::symlink(&b, &a).expect("links");
    write(&a, |out| out.write_all(b"new")).expect_err("no file is there");
    assert_eq!(names(folder.path()), ["a", "b"]);
}

#[test]
fn a_name_may_be_as_long_as_the_file_system_permits() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("n".repeat(255));
    write(&path, |out| out.write_all(b"new")).expect("writes");
    assert_eq!(fs::read(&path).expect("there"), b"new");
}

#[test]
fn a_temporary_file_that_is_locked_is_in_use_and_any_other_is_stale() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let place = |name: &str| folder.path().join(name);
    let stale = [".isograd-1-0.tmp", ".isograd-4194305-17.tmp"];
    let others = [".isograd-1-1", "isograd-1-1.tmp", "a.tmp"];
    for name in stale.iter().chain(&others) {
        fs::write(place(name), b"half").expect("writes");
    }
    fs::create_dir(place(".isograd-3-0.tmp")).expect("creates");
    let used = File::create(place(".isograd-2-0.tmp")).expect("creates");
    used.lock().expect("locks");
    write(&place("a"), |out| {
        // The temporary file of this write is not stale.
        temporary::remove_stale(folder.path(), &[]);
        out.write_all(b"new")
    })
    .expect("writes");
    assert_eq!(
        names(folder.path()),
        [
            ".isograd-1-1",
            ".isograd-2-0.tmp",
            ".isograd-3-0.tmp",
            "a",
            "a.tmp",
            "isograd-1-1.tmp"
        ]
    );
}

#[test]
fn a_missing_folder_says_what_to_do() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("missing/a.txt");
    let message = write(&path, |_| Ok(())).expect_err("fails").to_string();
    assert!(message.contains("create its folder"), "{message}");
    assert!(names(folder.path()).is_empty());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_stays_a_device() {
    use std::os::unix::fs::FileTypeExt;
    let full = Path::new("/dev/full");
    let message = write(full, |out| out.write_all(b"x"))
        .expect_err("full")
        .to_string();
    assert!(message.contains("free some space"), "{message}");
    assert!(
        fs::metadata(full)
            .expect("there")
            .file_type()
            .is_char_device()
    );
}
