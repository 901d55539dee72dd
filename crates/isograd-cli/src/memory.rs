//! Allocation: the peak of the allocated memory, and the end of the program when none is left.
//!
//! Without this, a failed allocation aborts the program with SIGABRT and leaves its temporary files. `unsafe` is what
//! [`GlobalAlloc`] asks for; every call goes to [`System`] unchanged: zeroed memory is that of the kernel, not touched
//! before it is used, and large blocks grow in place.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::{Cursor, Write};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Exit status when no memory is left.
const STATUS: i32 = 1;

/// The allocator of the program.
pub struct Allocator;

/// Bytes that are allocated now.
static USED: AtomicUsize = AtomicUsize::new(0);
/// The most bytes that were allocated at once.
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Whether the process runs a command. Not so in Python, which may survive a failed allocation.
static RUNS: AtomicBool = AtomicBool::new(false);
/// Whether a thread ends the program.
static ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether it is this thread.
    static ENDS_HERE: Cell<bool> = const { Cell::new(false) };
}

impl Allocator {
    /// From now on a failed allocation ends the program with a message.
    pub fn end_on_failure(&self) {
        RUNS.store(true, Ordering::Relaxed);
    }

    /// Bytes that are allocated now.
    pub fn current_usage(&self) -> usize {
        USED.load(Ordering::Relaxed)
    }

    /// Peak of the allocated memory, in bytes.
    pub fn peak_usage(&self) -> usize {
        PEAK.load(Ordering::Relaxed)
    }

    /// Lets the peak begin anew.
    pub fn reset_peak_usage(&self) {
        PEAK.store(self.current_usage(), Ordering::Relaxed);
    }
}

// SAFETY: memory comes from `System` and goes back to it with the layout it was allocated with; a null pointer is
// returned as it is, or not at all.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those of the inner function, here and below.
        taken(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        taken(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
        USED.fetch_sub(layout.size(), Ordering::Relaxed);
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let moved = taken(unsafe { System.realloc(pointer, layout, size) }, size);
        if !moved.is_null() {
            USED.fetch_sub(layout.size(), Ordering::Relaxed);
        }
        moved
    }
}

/// Counts an allocation, or ends the program if it failed while a command runs.
fn taken(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        if RUNS.load(Ordering::Relaxed) {
            end(bytes);
        }
        return pointer;
    }
    let used = USED.fetch_add(bytes, Ordering::Relaxed) + bytes;
    if used > PEAK.load(Ordering::Relaxed) {
        PEAK.fetch_max(used, Ordering::Relaxed);
    }
    pointer
}

/// Ends the program. Nothing here allocates, except a path of more than 383 bytes.
#[cold]
fn end(bytes: usize) -> ! {
    if ENDS_HERE.replace(true) {
        // A second failure, on the way out.
        exit();
    }
    if ENDING.swap(true, Ordering::SeqCst) {
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut message = [0u8; 256];
    let mut text = Cursor::new(&mut message[..]);
    let written = writeln!(
        text,
        "error: no memory is left: {bytes} bytes could not be allocated; use a lower resolution or fewer points, or raise the limit (ulimit -v, container)"
    );
    let length = text.position() as usize;
    if written.is_ok() {
        let _ = std::io::stderr().write_all(&message[..length]);
    }
    isograd_io::atomic::remove_unfinished();
    exit();
}

/// Ends the process at once: what runs at a regular exit may allocate.
#[cfg(unix)]
fn exit() -> ! {
    // SAFETY: it has no conditions.
    unsafe { libc::_exit(STATUS) }
}

#[cfg(not(unix))]
fn exit() -> ! {
    std::process::exit(STATUS)
}
