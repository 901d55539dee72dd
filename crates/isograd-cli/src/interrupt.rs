//! Ctrl-C, SIGTERM and SIGHUP: partially written files are removed, and a fit may complete its epoch.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use crate::streams::to_stderr;

/// 128 + SIGINT: the exit status after Ctrl-C, by convention.
const CTRL_C: u8 = 130;

/// Whether a signal only sets [`REQUESTED`].
static DEFERRED: AtomicBool = AtomicBool::new(false);
/// Whether a stop was requested.
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether the program is being ended by a signal.
static STOPPING: AtomicBool = AtomicBool::new(false);
/// Exit status of the last signal.
static STATUS: AtomicU8 = AtomicU8::new(CTRL_C);

/// Exit status after a signal: 128 and its number.
pub fn status() -> u8 {
    STATUS.load(Ordering::SeqCst)
}

/// Handles signals from now on.
pub fn handle() {
    if handle_signals().is_err() {
        to_stderr("warning: signals can't be handled here; a temporary file may stay behind");
    }
}

/// Waits for signals in a thread of its own.
#[cfg(unix)]
fn handle_signals() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    let handled = [SIGINT, SIGTERM, SIGHUP].into_iter();
    let handled = handled.filter(|&signal| !is_ignored(signal));
    let mut signals = signal_hook::iterator::Signals::new(handled)?;
    let wait = move || {
        for signal in signals.forever() {
            stop(128 + signal as u8);
        }
    };
    let thread = std::thread::Builder::new().name("signals".into());
    thread.spawn(wait).map(drop)
}

/// Whether a signal was ignored when the program started, as `nohup` does with SIGHUP. This stays so.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(not(unix))]
fn handle_signals() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| stop(CTRL_C))
}

fn stop(status: u8) {
    STATUS.store(status, Ordering::SeqCst);
    if DEFERRED.load(Ordering::SeqCst) && !REQUESTED.swap(true, Ordering::SeqCst) {
        to_stderr("stopping after this epoch; once more to stop at once");
        return;
    }
    STOPPING.store(true, Ordering::SeqCst);
    isograd_io::atomic::remove_unfinished();
    to_stderr("stopped");
    std::process::exit(status.into());
}

/// Waits for the end if a signal is ending the program: writes fail then, and the status is that of the signal.
pub fn wait_if_stopping() {
    while STOPPING.load(Ordering::SeqCst) {
        std::thread::park();
    }
}

/// While this value exists, the first signal only makes [`Deferred::is_requested`] true.
pub struct Deferred(());

impl Deferred {
    /// Starts deferring.
    pub fn new() -> Self {
        DEFERRED.store(true, Ordering::SeqCst);
        Self(())
    }

    /// Whether a signal came.
    pub fn is_requested(&self) -> bool {
        REQUESTED.load(Ordering::SeqCst)
    }
}

impl Drop for Deferred {
    fn drop(&mut self) {
        DEFERRED.store(false, Ordering::SeqCst);
    }
}
