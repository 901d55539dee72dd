//! Plans that wait for their next call. A plan holds Fourier tables and all memory of a reconstruction: making
//! one costs more than a call needs, and functional interfaces have no place to keep it.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

use isograd::{CloudCotangent, PullbackScratch};

use crate::arrays::Number;
use crate::backend::{self, Failure};
use crate::settings::Settings;

/// Plans that are kept at most; the one that has waited longest goes first.
const KEPT: usize = 4;

/// A plan and the memory of its pullbacks.
pub struct Plan<T: Number> {
    /// The plan.
    pub plan: isograd_backend::Plan<T>,
    /// For [`isograd_backend::View::pullback_into`].
    pub scratch: PullbackScratch<T>,
    /// What that writes.
    pub bar: CloudCotangent<T>,
}

/// A plan, what it is for, and in which number type.
struct Waiting {
    settings: String,
    type_name: &'static str,
    plan: Box<dyn Any + Send>,
}

static POOL: Mutex<Vec<Waiting>> = Mutex::new(Vec::new());

/// Does `work` with a plan for `settings`, one that waits or a new one, which then waits for the next call. No
/// lock is held meanwhile. A panic drops the plan.
///
/// # Errors
/// Settings that make no plan, and devices that can't be had.
pub fn with_plan<T: Number, R>(
    settings: &str,
    work: impl FnOnce(&mut Plan<T>) -> R,
) -> Result<R, Failure> {
    let mut plan = match take::<T>(settings) {
        Some(plan) => plan,
        None => Box::new(create::<T>(settings)?),
    };
    let result = work(&mut plan);
    plan.plan.release();
    put_back(settings, plan);
    Ok(result)
}

fn create<T: Number>(settings: &str) -> Result<Plan<T>, Failure> {
    Ok(Plan {
        plan: backend::plan(&Settings::parse(settings)?)?,
        scratch: PullbackScratch::default(),
        bar: CloudCotangent::default(),
    })
}

fn take<T: Number>(settings: &str) -> Option<Box<Plan<T>>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = |waiting: &Waiting| waiting.settings == settings && waiting.type_name == T::NAME;
    let place = pool.iter().rposition(fits)?;
    pool.remove(place).plan.downcast().ok()
}

fn put_back<T: Number>(settings: &str, plan: Box<Plan<T>>) {
    let waiting = Waiting {
        settings: settings.into(),
        type_name: T::NAME,
        plan,
    };
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    pool.push(waiting);
    // Dropped after the lock: a plan is large.
    let first = (pool.len() > KEPT).then(|| pool.remove(0));
    drop(pool);
    drop(first);
}
