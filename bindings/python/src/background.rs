//! Long work on a thread of its own, so that the interpreter is free meanwhile and Ctrl-C is heard at once.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How often Ctrl-C is looked for.
const LISTEN: Duration = Duration::from_millis(50);

/// The process in which threads were first started; 0 for none yet.
static PROCESS: AtomicU32 = AtomicU32::new(0);

/// Whether the work is no longer wanted.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Whether to stop.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Does `work` without the interpreter. Where Ctrl-C is pressed, or a signal's handler raises, that is raised
/// at once; the work is told to stop, and ends by itself.
///
/// # Errors
/// What a signal's handler raises; a panic of the work as `RuntimeError`; a forked process.
pub fn run<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> R + Send + 'static,
) -> PyResult<R> {
    check_process()?;
    let stop = Stop::default();
    let (sender, receiver) = mpsc::channel();
    let heard = stop.clone();
    let spawned = thread::Builder::new()
        .name("isograd".into())
        .spawn(move || {
            let result = catch_unwind(AssertUnwindSafe(|| work(&heard)));
            // Nobody listens after an interrupt.
            let _ = sender.send(result);
        });
    spawned.map_err(|e| PyRuntimeError::new_err(format!("no thread could be started: {e}")))?;
    let mut receiver = receiver;
    loop {
        let (back, received) = py.detach(move || {
            let received = receiver.recv_timeout(LISTEN);
            (receiver, received)
        });
        receiver = back;
        match received {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => return Err(defect(&*panic)),
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

/// Threads do not survive a fork: work would wait for them for ever.
fn check_process() -> PyResult<()> {
    let here = std::process::id();
    let first = PROCESS.compare_exchange(0, here, Ordering::Relaxed, Ordering::Relaxed);
    match first {
        Err(first) if first != here => Err(PyRuntimeError::new_err(
            "isograd was used before this process was forked, and its threads are gone; start processes with multiprocessing's 'spawn' or 'forkserver'",
        )),
        _ => Ok(()),
    }
}

fn defect(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<&str>().map(|s| s.to_string());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    PyRuntimeError::new_err(format!(
        "a defect of isograd, please report it: {}",
        text.unwrap_or_default()
    ))
}
