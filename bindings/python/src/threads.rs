//! Number of threads of the work.

use std::num::NonZero;
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::available_parallelism;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::background;

/// Threads of [`set_num_threads`]; without them, rayon's own.
static POOL: RwLock<Threads> = RwLock::new(None);

/// Threads of some work; `None` for those of all.
pub type Threads = Option<Arc<ThreadPool>>;

/// Runs `work` on the threads of [`set_num_threads`].
pub fn install<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    install_on(pool().as_ref(), work)
}

/// Runs `work` on given threads, or where it is called.
pub fn install_on<R: Send>(
    threads: Option<&Arc<ThreadPool>>,
    work: impl FnOnce() -> R + Send,
) -> R {
    match threads {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Starts `n` threads, at least 1.
///
/// # Errors
/// So many threads can't be started; a forked process.
pub fn start(py: Python<'_>, n: usize) -> PyResult<Arc<ThreadPool>> {
    background::check_process()?;
    let built = py.detach(|| ThreadPoolBuilder::new().num_threads(n).build());
    let built = built.map_err(|e| {
        PyRuntimeError::new_err(format!("{n} threads could not be started: {e}; give fewer"))
    })?;
    Ok(Arc::new(built))
}

/// Starts `n` threads, at least 1, for all work that begins later.
#[pyfunction]
pub fn set_num_threads(py: Python<'_>, n: usize) -> PyResult<()> {
    *POOL.write().unwrap_or_else(PoisonError::into_inner) = Some(start(py, n)?);
    Ok(())
}

/// Number of threads of the work. Starts none.
#[pyfunction]
pub fn get_num_threads() -> usize {
    if let Some(pool) = pool() {
        return pool.current_num_threads();
    }
    // As rayon reads it; 0 is its default.
    let variable = std::env::var("RAYON_NUM_THREADS").ok();
    let given = variable.and_then(|text| text.parse().ok());
    given
        .filter(|&threads| threads > 0)
        .unwrap_or_else(|| available_parallelism().map_or(1, NonZero::get))
}

fn pool() -> Threads {
    POOL.read().unwrap_or_else(PoisonError::into_inner).clone()
}
