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

use crate::threads;

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

/// Message of the worker thread.
enum Event<M, R> {
    Message(M),
    /// The result, or the message of a panic.
    Done(Result<R, String>),
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
    run_with_messages(py, move |stop, _| work(stop), |(): ()| Ok(()))
}

/// Like [`run`], where `work` can send messages. The calling thread passes them to `receive`, and an exception that this
/// raises is raised at once, too.
///
/// # Errors
/// As [`run`], and the exceptions of `receive`.
pub fn run_with_messages<M: Send + 'static, R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop, &(dyn Fn(M) + Sync)) -> R + Send + 'static,
    mut receive: impl FnMut(M) -> PyResult<()>,
) -> PyResult<R> {
    check_process()?;
    let stop = Stop::default();
    let (sender, receiver) = mpsc::channel();
    let observed = stop.clone();
    let spawned = thread::Builder::new()
        .name("isograd".into())
        .spawn(move || {
            // After an interrupt there is no receiver.
            let send = |event| _ = sender.send(event);
            let report = |message| send(Event::Message(message));
            let result = guard(|| threads::install(|| work(&observed, &report)));
            send(Event::Done(result));
        });
    spawned.map_err(|e| PyRuntimeError::new_err(format!("no thread could be started: {e}")))?;
    let mut receiver = receiver;
    loop {
        let (back, received) = py.detach(move || {
            let received = receiver.recv_timeout(POLL);
            (receiver, received)
        });
        receiver = back;
        let going_on = match received {
            Ok(Event::Done(Ok(result))) => return Ok(result),
            Ok(Event::Done(Err(panic))) => return Err(PyRuntimeError::new_err(panic)),
            Ok(Event::Message(message)) => receive(message),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
            Err(RecvTimeoutError::Timeout) => py.check_signals(),
        };
        if let Err(raised) = going_on {
            stop.0.store(true, Ordering::Relaxed);
            return Err(raised);
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
