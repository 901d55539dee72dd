//! Standard output and standard error.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use isograd_io::atomic::is_standard_output;
use isograd_io::{LONGEST_LINE, printable};

use crate::error::Error;

/// The first error of standard output. The work goes on without it: files may still have to be written.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Whether an output file is written to standard output.
static HOLDS_FILE: AtomicBool = AtomicBool::new(false);

/// Keeps standard output for a file if `path` is `-`: from now on lines go to standard error.
///
/// # Errors
/// [`Error::Usage`] for a binary file on a terminal, [`Error::Stdout`] for standard output that is closed.
pub fn reserve_stdout(path: &Path, is_text: bool) -> Result<(), Error> {
    if !is_standard_output(path) {
        return Ok(());
    }
    if crate::closed::was_closed() {
        return Err(Error::Stdout(io::Error::other("it is closed")));
    }
    if !is_text && io::stdout().is_terminal() {
        return Err(Error::Usage(
            "standard output is a terminal, and the file is binary; name a file, or add a pipe or '> FILE'".into(),
        ));
    }
    HOLDS_FILE.store(true, Ordering::Relaxed);
    Ok(())
}

/// Prints a line to standard output, or to standard error where that holds a file. [`finish`] returns the error if that
/// fails.
pub fn to_stdout(text: &str) {
    if HOLDS_FILE.load(Ordering::Relaxed) {
        return to_stderr(text);
    }
    print(|out| writeln!(out, "{}", printable(text)));
}

/// Writes bytes of this program to standard output, as they are. [`finish`] returns the error if that fails.
pub fn write_stdout(bytes: &[u8]) {
    print(|out| out.write_all(bytes));
}

/// Prints a line to standard error. If that fails, there is no place to report it.
pub fn to_stderr(text: &str) {
    let _ = writeln!(io::stderr(), "{}", printable(text));
}

/// Prints help, the version, or the error of a command line.
pub fn print_clap(error: &clap::Error) {
    if !error.use_stderr() {
        print(|_| error.print());
        return;
    }
    let text = error.render().to_string();
    match text.lines().any(|line| line.chars().count() > LONGEST_LINE) {
        true => text.lines().for_each(to_stderr),
        // In color, on a terminal.
        false => drop(error.print()),
    }
}

fn print(write: impl FnOnce(&mut io::Stdout) -> io::Result<()>) {
    let mut failed = failed();
    if failed.is_some() {
        return;
    }
    *failed = match crate::closed::was_closed() {
        true => Some(io::Error::other("it is closed")),
        false => write(&mut io::stdout()).err(),
    };
}

fn failed() -> std::sync::MutexGuard<'static, Option<io::Error>> {
    FAILED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Completes standard output.
///
/// # Errors
/// The first error since the last call.
pub fn finish() -> Result<(), Error> {
    let last = io::stdout().flush();
    match failed().take().map_or(last, Err) {
        Ok(()) => Ok(()),
        Err(source) => Err(Error::Stdout(source)),
    }
}
