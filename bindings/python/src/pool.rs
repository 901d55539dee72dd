//! A pool of idle plans. A plan holds Fourier tables and all memory of a reconstruction: making one costs more than a
//! call, and functional interfaces have no place to store it.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

use isograd::CloudCotangent;
use pyo3::prelude::*;

use crate::arrays::Number;
use crate::backend::{self, Failure};
use crate::background;
use crate::settings::Settings;

/// Capacity of the pool; the plan that has been idle longest is dropped first.
const CAPACITY: usize = 4;

/// A plan and the buffers of its pullbacks.
pub struct Plan<T: Number> {
    /// The plan.
    pub plan: isograd_backend::Plan<T>,
    /// Output of the pullback.
    pub bar: CloudCotangent<T>,
}

/// An idle plan, its settings and its number type.
struct Idle {
    settings: String,
    type_name: &'static str,
    plan: Box<dyn Pooled>,
}

/// A plan of either number type.
trait Pooled: Send {
    /// Lets go of the last result on a device.
    fn release(&mut self);

    fn into_any(self: Box<Self>) -> Box<dyn Any>;
}

impl<T: Number> Pooled for Plan<T> {
    fn release(&mut self) {
        self.plan.release();
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

static POOL: Mutex<Vec<Idle>> = Mutex::new(Vec::new());

/// Passes a plan for `settings`, from the pool or new, to `work`, and returns it to the pool. No lock is held during
/// the work. A panic drops the plan.
///
/// # Errors
/// Invalid settings; an unavailable device.
pub fn with_plan<T: Number, R>(
    settings: &str,
    work: impl FnOnce(&mut Plan<T>) -> R,
) -> Result<R, Failure> {
    let mut plan = match take::<T>(settings) {
        Some(plan) => plan,
        None => Box::new(create::<T>(settings)?),
    };
    let result = work(&mut plan);
    put_back(settings, plan);
    Ok(result)
}

fn create<T: Number>(settings: &str) -> Result<Plan<T>, Failure> {
    Ok(Plan {
        plan: backend::plan(&Settings::parse(settings)?)?,
        bar: CloudCotangent::default(),
    })
}

fn take<T: Number>(settings: &str) -> Option<Box<Plan<T>>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = |idle: &Idle| idle.settings == settings && idle.type_name == T::NAME;
    let place = pool.iter().rposition(fits)?;
    pool.remove(place).plan.into_any().downcast().ok()
}

fn put_back<T: Number>(settings: &str, plan: Box<Plan<T>>) {
    let idle = Idle {
        settings: settings.into(),
        type_name: T::NAME,
        plan,
    };
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    // One result is enough: of two, the memory may be wanted.
    for other in pool.iter_mut() {
        other.plan.release();
    }
    pool.push(idle);
    // Dropped after the lock: a plan is large.
    let oldest = (pool.len() > CAPACITY).then(|| pool.remove(0));
    drop(pool);
    drop(oldest);
}

/// Makes the plan of these settings, in either number type, and adds it to the pool, so that an unavailable device is
/// an error now. Returns why the CPU computes, where `backend` is `auto`.
#[pyfunction]
pub fn open_backend(py: Python<'_>, settings: String, double: bool) -> PyResult<Option<String>> {
    let opened = background::run(py, move |_| match double {
        true => with_plan::<f64, _>(&settings, |plan| plan.plan.take_note()),
        false => with_plan::<f32, _>(&settings, |plan| plan.plan.take_note()),
    })?;
    Ok(opened?)
}
