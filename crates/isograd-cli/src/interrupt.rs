//! Ctrl-C, and a polite kill: no half-written file stays behind, and a long run may end an epoch first.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::progress::to_stderr;

/// What a shell expects of a program that Ctrl-C stopped: 128 + SIGINT.
pub const STATUS: i32 = 130;

/// Whether the work asked to be told instead of being stopped.
static DEFERRED: AtomicBool = AtomicBool::new(false);
/// Whether it has been told.
static ASKED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C stops the program cleanly.
pub fn handle() {
    let handled = ctrlc::set_handler(|| {
        if DEFERRED.load(Ordering::SeqCst) && !ASKED.swap(true, Ordering::SeqCst) {
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

/// While this lives, the first Ctrl-C only makes [`Deferred::asked`] true.
pub struct Deferred(());

impl Deferred {
    /// From now on.
    pub fn new() -> Self {
        DEFERRED.store(true, Ordering::SeqCst);
        Self(())
    }

    /// Whether Ctrl-C was pressed.
    pub fn asked(&self) -> bool {
        ASKED.load(Ordering::SeqCst)
    }
}

impl Drop for Deferred {
    fn drop(&mut self) {
        DEFERRED.store(false, Ordering::SeqCst);
    }
}
