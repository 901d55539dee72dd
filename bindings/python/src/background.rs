//! Long work on its own thread, so that the interpreter stays free and Ctrl-C interrupts at once.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Interval at which signals are checked.
const POLL: Duration = Duration::from_millis(50);

/// The process in which threads were first started; 0 for none yet.
static PROCESS: AtomicU32 = AtomicU32::new(0);

/// A request to stop, shared with the work.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Whether a stop was requested.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs `work` with the interpreter released. An exception raised by a signal handler, such as that of Ctrl-C, is
/// raised at once; the work gets a request to stop, and ends on its own thread.
///
/// # Errors
/// The exception of a signal handler; a panic of the work as `RuntimeError`; a forked process.
pub fn run<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> R + Send + 'static,
) -> PyResult<R> {
    check_process()?;
    let stop = Stop::default();
    let (sender, receiver) = mpsc::channel();
    let observed = stop.clone();
    let spawned = thread::Builder::new()
        .name("isograd".into())
        .spawn(move || {
            let result = guard(|| work(&observed));
            // After an interrupt there is no receiver.
            let _ = sender.send(result);
        });
    spawned.map_err(|e| PyRuntimeError::new_err(format!("no thread could be started: {e}")))?;
    let mut receiver = receiver;
    loop {
        let (back, received) = py.detach(move || {
            let received = receiver.recv_timeout(POLL);
            (receiver, received)
        });
        receiver = back;
        match received {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => return Err(PyRuntimeError::new_err(panic)),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    stop.0.store(true, Ordering::Relaxed);
                    return Err(raised);
                }
            }
        }
    }
}

/// Checks that the process was not forked after threads were started: they do not survive a fork, and work would wait
/// for them forever.
///
/// # Errors
/// A forked process.
pub fn check_process() -> PyResult<()> {
    let here = std::process::id();
    let first = PROCESS.compare_exchange(0, here, Ordering::Relaxed, Ordering::Relaxed);
    match first {
        Err(first) if first != here => Err(PyRuntimeError::new_err(
            "isograd was used before this process was forked, and its threads are gone; start processes with multiprocessing's 'spawn' or 'forkserver'",
        )),
        _ => Ok(()),
    }
}

/// The result of `work`, or the message of its panic.
///
/// # Errors
/// A panic: a defect of isograd.
pub fn guard<R>(work: impl FnOnce() -> R) -> Result<R, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic: Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<&str>().map(|s| s.to_string());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let text = text.unwrap_or_default();
        format!("a defect of isograd, please report it: {text}")
    })
}
