//! Atomic writing of files.
//!
//! A file is written under a temporary name in its own folder and renamed when it is complete; an existing
//! file is unchanged until then. The temporary file is removed on an error, and by [`remove_unfinished`],
//! which a program calls before it exits on Ctrl-C.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::Error;

/// Existing temporary files; `stopped` forbids new ones.
struct Unfinished {
    files: Vec<PathBuf>,
    stopped: bool,
}

static UNFINISHED: Mutex<Unfinished> = Mutex::new(Unfinished {
    files: Vec::new(),
    stopped: false,
});

static NEXT: AtomicU64 = AtomicU64::new(0);

fn unfinished() -> std::sync::MutexGuard<'static, Unfinished> {
    // The list is valid even if a thread panicked while it held the lock.
    UNFINISHED
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Removes every temporary file of this process; from now on every write fails. To be called before the
/// process exits on Ctrl-C.
pub fn remove_unfinished() {
    let mut unfinished = unfinished();
    unfinished.stopped = true;
    for file in unfinished.files.drain(..) {
        // The file may be gone already; the process exits in any case.
        let _ = fs::remove_file(file);
    }
}

/// Writes the output of `content` to `path`; the file is created or replaced only on success.
///
/// Devices and pipes (`/dev/stdout`) are written to directly; a symbolic link is followed.
///
/// # Errors
/// [`Error::Write`].
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut Output) -> io::Result<()>,
) -> Result<(), Error> {
    let failed = |source| Error::Write {
        file: path.display().to_string(),
        source,
    };
    let mut output = Output::create(path).map_err(failed)?;
    content(&mut output)
        .and_then(|()| output.commit())
        .map_err(failed)
}

/// A file that is being written.
pub struct Output {
    writer: BufWriter<File>,
    /// The temporary and the final path; `None` for a device, which is written to directly.
    rename: Option<(PathBuf, PathBuf)>,
}

impl Output {
    fn create(path: &Path) -> io::Result<Self> {
        // Follow links, so that their target is replaced.
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if let Ok(metadata) = fs::metadata(&target) {
            if metadata.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            if !metadata.is_file() {
                let file = OpenOptions::new().write(true).open(&target)?;
                return Ok(Self {
                    writer: BufWriter::new(file),
                    rename: None,
                });
            }
        }
        let temporary = temporary_name(&target)?;
        let mut unfinished = unfinished();
        if unfinished.stopped {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)?;
        unfinished.files.push(temporary.clone());
        Ok(Self {
            writer: BufWriter::with_capacity(1 << 16, file),
            rename: Some((temporary, target)),
        })
    }

    /// Moves the file to its final path.
    fn commit(mut self) -> io::Result<()> {
        self.writer.flush()?;
        let Some((temporary, target)) = &self.rename else {
            return Ok(());
        };
        if let Ok(old) = fs::metadata(target) {
            fs::set_permissions(temporary, old.permissions())?;
        }
        // The lock is held during the rename: a file is either finished or removed.
        let mut unfinished = unfinished();
        if unfinished.stopped {
            return Err(io::ErrorKind::Interrupted.into());
        }
        fs::rename(temporary, target)?;
        unfinished.files.retain(|file| file != temporary);
        drop(unfinished);
        self.rename = None;
        Ok(())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if let Some((temporary, _)) = &self.rename {
            let mut unfinished = unfinished();
            let _ = fs::remove_file(temporary);
            unfinished.files.retain(|file| file != temporary);
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// A unique hidden path in the folder of `target`.
fn temporary_name(target: &Path) -> io::Result<PathBuf> {
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}-{number}.tmp", std::process::id()));
    Ok(target.with_file_name(hidden))
}

#[cfg(test)]
mod tests {
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
}
