//! Ctrl-C and SIGTERM: partially written files are removed, and a fit may complete its epoch.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::progress::to_stderr;

/// Exit status after Ctrl-C: 128 + SIGINT, by convention.
pub const STATUS: i32 = 130;

/// Whether a signal only sets [`REQUESTED`].
static DEFERRED: AtomicBool = AtomicBool::new(false);
/// Whether a stop was requested.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Installs the signal handler.
pub fn handle() {
    let handled = ctrlc::set_handler(|| {
        if DEFERRED.load(Ordering::SeqCst) && !REQUESTED.swap(true, Ordering::SeqCst) {
            to_stderr("stopping after this epoch; once more to stop at once");
            return;
        }
        isograd_io::atomic::remove_unfinished();
        to_stderr("stopped");
        std::process::exit(STATUS);
    });
    if handled.is_err() {
        to_stderr("warning: Ctrl-C can't be handled here; a temporary file may stay behind");
    }
}

/// While this value exists, the first Ctrl-C only makes [`Deferred::is_requested`] true.
pub struct Deferred(());

impl Deferred {
    /// Starts deferring.
    pub fn new() -> Self {
        DEFERRED.store(true, Ordering::SeqCst);
        Self(())
    }

    /// Whether Ctrl-C was pressed.
    pub fn is_requested(&self) -> bool {
        REQUESTED.load(Ordering::SeqCst)
    }
}

impl Drop for Deferred {
    fn drop(&mut self) {
        DEFERRED.store(false, Ordering::SeqCst);
    }
}
