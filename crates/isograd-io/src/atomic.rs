//! Atomic writing of files.
//!
//! A file is written under a temporary name in its own folder and renamed when it is complete and on the disk; an existing
//! file is unchanged until then. The temporary file is removed on an error, and by [`remove_unfinished`], which a program
//! calls before it ends early. Temporary files of processes that were killed are removed by the next write into
//! their folder.

mod temporary;

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use crate::error::Error;

/// Links that [`resolve`] follows at most, as many as Linux does.
const MAX_LINKS: usize = 40;

/// Existing temporary files; `stopped` forbids new ones.
struct Unfinished {
    files: Vec<PathBuf>,
    /// Folders from which temporary files of dead processes were removed.
    clean: Vec<PathBuf>,
    stopped: bool,
}

static UNFINISHED: Mutex<Unfinished> = Mutex::new(Unfinished {
    files: Vec::new(),
    clean: Vec::new(),
    stopped: false,
});

fn unfinished() -> MutexGuard<'static, Unfinished> {
    // The list is valid even if a thread panicked while it held the lock.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every temporary file of this process; from now on every write fails. To be called before the
/// process ends early: on a signal, or when no memory is left.
pub fn remove_unfinished() {
    // A thread that waits for memory may hold the lock for ever, and never for long otherwise.
    let mut unfinished = (0..500).find_map(|_| match UNFINISHED.try_lock() {
        Ok(unfinished) => Some(unfinished),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => {
            std::thread::sleep(Duration::from_millis(2));
            None
        }
    });
    let Some(unfinished) = &mut unfinished else {
        return;
    };
    unfinished.stopped = true;
    for file in unfinished.files.drain(..) {
        // The file may be gone already; the process exits in any case.
        let _ = fs::remove_file(file);
    }
}

/// Writes the output of `content` to `path`; the file is created or replaced only on success, when its content is on
/// the disk.
///
/// Standard output (`-`), devices and pipes are written to directly; a symbolic link is followed, also where its target does
/// not exist yet.
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut Output) -> io::Result<()>,
) -> Result<(), Error> {
    let failed = |source| Error::Write {
        file: match is_standard_output(path) {
            true => "standard output".into(),
            false => path.display().to_string(),
        },
        source,
    };
    let mut output = Output::create(path).map_err(failed)?;
    content(&mut output)
        .and_then(|()| output.commit())
        .map_err(failed)
}

/// The file that `path` leads to, which may not exist yet: links are followed, the last one also if its target is missing.
///
/// # Errors
/// A missing folder, and errors of the operating system.
pub fn resolve(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        match fs::canonicalize(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            found => return found,
        }
        let folder = fs::canonicalize(folder_of(&path))?;
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let file = folder.join(name);
        match fs::read_link(&file) {
            Ok(target) => path = folder.join(target),
            Err(_) => return Ok(file),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    let folder = path.parent();
    let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Removes temporary files of dead processes, once per folder.
fn clean(folder: &Path) {
    let mut unfinished = unfinished();
    if unfinished.clean.iter().any(|clean| clean == folder) {
        return;
    }
    unfinished.clean.push(folder.to_path_buf());
    let own = unfinished.files.clone();
    drop(unfinished);
    temporary::remove_stale(folder, &own);
}

/// A file that is being written.
pub struct Output {
    writer: BufWriter<File>,
    /// The temporary and the final path; `None` for a device or standard output, which are written to directly.
    rename: Option<(PathBuf, PathBuf)>,
}

impl Output {
    fn create(path: &Path) -> io::Result<Self> {
        if is_standard_output(path) {
            return Ok(Self {
                writer: BufWriter::with_capacity(1 << 16, standard_output()?),
                rename: None,
            });
        }
        match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => Ok(Self {
                writer: BufWriter::new(OpenOptions::new().write(true).open(path)?),
                rename: None,
            }),
            // Links are followed, so that their target is replaced.
            _ => Self::replacing(resolve(path)?),
        }
    }

    fn replacing(target: PathBuf) -> io::Result<Self> {
        let folder = folder_of(&target);
        clean(folder);
        let mut unfinished = unfinished();
        if unfinished.stopped {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let (temporary, file) = temporary::create(folder)?;
        unfinished.files.push(temporary.clone());
        Ok(Self {
            writer: BufWriter::with_capacity(1 << 16, file),
            rename: Some((temporary, target)),
        })
    }

    /// Moves the file to its final path, once its content is on the disk.
    fn commit(mut self) -> io::Result<()> {
        self.writer.flush()?;
        let Some((temporary, target)) = &self.rename else {
            return Ok(());
        };
        if let Ok(old) = fs::metadata(target) {
            self.writer.get_ref().set_permissions(old.permissions())?;
        }
        sync(self.writer.get_ref())?;
        // The lock is held during the rename: a file is either finished or removed.
        let mut unfinished = unfinished();
        if unfinished.stopped {
            return Err(io::ErrorKind::Interrupted.into());
        }
        fs::rename(temporary, target)?;
        unfinished.files.retain(|file| file != temporary);
        drop(unfinished);
        let renamed = sync_folder(folder_of(target));
        self.rename = None;
        renamed
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

/// Whether a path, `-`, stands for standard output.
pub fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

/// Standard output without its line buffer.
#[cfg(unix)]
fn standard_output() -> io::Result<File> {
    use std::os::fd::AsFd;
    io::stdout().flush()?;
    Ok(io::stdout().as_fd().try_clone_to_owned()?.into())
}

/// Standard output without its line buffer.
#[cfg(windows)]
fn standard_output() -> io::Result<File> {
    use std::os::windows::io::AsHandle;
    io::stdout().flush()?;
    Ok(io::stdout().as_handle().try_clone_to_owned()?.into())
}

/// Standard output can't be written as a file here.
#[cfg(not(any(unix, windows)))]
fn standard_output() -> io::Result<File> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Waits until the content of a file is on the disk, if its file system can do that.
fn sync(file: &File) -> io::Result<()> {
    match file.sync_all() {
        Err(error) if is_unsupported(&error) => Ok(()),
        result => result,
    }
}

fn is_unsupported(error: &io::Error) -> bool {
    use io::ErrorKind::{InvalidInput, Unsupported};
    matches!(error.kind(), InvalidInput | Unsupported)
}

/// Waits until the names in a folder are on the disk, if it can be opened for that.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    // A folder may permit new files and no reading.
    File::open(folder).map_or(Ok(()), |folder| sync(&folder))
}

/// Folders can't be opened as files here; the file system keeps the order of renames.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests;
