//! Temporary files, and those that killed processes have left.
//!
//! A process holds a lock on each of its temporary files. The system releases it when the process ends, however it ends;
//! so a file without a lock is stale. Unlike the number of a process, a lock is the same in every container that shares
//! the folder.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Names of temporary files: short, so that the name of the file itself may be as long as the file system permits.
const BEGIN: &str = ".isograd-";
const END: &str = ".tmp";

/// Names that are tried. A name is taken if a process of the same number on another machine shares the folder.
const ATTEMPTS: usize = 1000;

static NEXT: AtomicU64 = AtomicU64::new(0);

/// Creates and locks a file with a new hidden name.
pub fn create(folder: &Path) -> io::Result<(PathBuf, File)> {
    for _ in 0..ATTEMPTS {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!("{BEGIN}{}-{number}{END}", std::process::id()));
        let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            result => result?,
        };
        // A file system without locks is one where stale files stay.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            continue;
        }
        // Between creation and lock another process may have taken it for stale and removed it.
        if fs::symlink_metadata(&path).is_ok() {
            return Ok((path, file));
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Removes the temporary files of dead processes. A file that can't be removed stays.
pub fn remove_stale(folder: &Path, own: &[PathBuf]) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_temporary = name
            .to_str()
            .is_some_and(|name| name.starts_with(BEGIN) && name.ends_with(END));
        let is_file = || entry.file_type().is_ok_and(|kind| kind.is_file());
        let path = entry.path();
        // On network file systems a lock may not exclude its own process.
        if !is_temporary || !is_file() || own.contains(&path) {
            continue;
        }
        let Ok(file) = OpenOptions::new().write(true).open(&path) else {
            continue;
        };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(&path);
        }
    }
}
