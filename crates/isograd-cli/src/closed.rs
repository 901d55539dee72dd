//! Whether standard output was closed when the program started (`>&-`).
//!
//! Before `main`, the standard library opens `/dev/null` in place of a closed standard output, where everything written
//! is lost without an error. So the check must come even earlier, in a function that the loader calls. `unsafe` places it in the
//! section of such functions.
#![allow(unsafe_code)]

use std::sync::atomic::{AtomicBool, Ordering};

static CLOSED: AtomicBool = AtomicBool::new(false);

/// Whether standard output was closed. Always false but on Linux, where alone this is checked.
pub fn was_closed() -> bool {
    CLOSED.load(Ordering::Relaxed)
}

// SAFETY: the section holds pointers to functions of this type, which the loader calls once. The function needs nothing
// that is set up later: it makes one system call and stores a flag.
#[cfg(target_os = "linux")]
#[used]
#[unsafe(link_section = ".init_array")]
static CHECK: extern "C" fn() = {
    extern "C" fn check() {
        // SAFETY: a question about a number; it may be that of no file.
        let flags = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) };
        CLOSED.store(flags == -1, Ordering::Relaxed);
    }
    check
};
