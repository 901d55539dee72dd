//! A pool of idle plans. A plan holds Fourier tables and all memory of a reconstruction: making one costs more than a
//! call, and functional interfaces have no place to store it.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

use isograd::{CloudCotangent, PointCloud, Real, Saved};
use isograd_backend::View;
use pyo3::prelude::*;

use crate::arrays::Number;
use crate::backend::{self, Failure};
use crate::background;
use crate::settings::Settings;

/// Capacity of the pool; the plan that has been idle longest is dropped first.
const CAPACITY: usize = 4;

/// A plan, the cloud of its last result, and the buffers of its pullbacks.
pub struct Plan<T: Number> {
    plan: isograd_backend::Plan<T>,
    last: Option<PointCloud<T>>,
    bar: CloudCotangent<T>,
}

impl<T: Number> Plan<T> {
    /// The reconstruction of a cloud.
    ///
    /// # Errors
    /// Errors of a stage or of the device.
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<View<'_, T>, Failure> {
        self.last = None;
        let result = self.plan.reconstruct(cloud)?;
        self.last = Some(cloud.clone());
        Ok(result)
    }

    /// The reconstruction of a cloud from what was saved of it, and the output of its pullback. Nothing is computed again
    /// for the cloud of the last call, as in an optimizer, or with a checkpoint.
    ///
    /// # Errors
    /// Errors of a stage or of the device; arrays saved from another result.
    pub fn restore(
        &mut self,
        cloud: &PointCloud<T>,
        saved: &Saved<'_, T>,
    ) -> Result<(View<'_, T>, &mut CloudCotangent<T>), Failure> {
        let Self { plan, last, bar } = self;
        let is_last = last.take().is_some_and(|last| is_same(&last, cloud));
        let result = plan.restore(cloud, saved, is_last)?;
        *last = Some(cloud.clone());
        Ok((result, bar))
    }
}

/// Whether two clouds have the same points and normals, to the bit.
fn is_same<T: Real>(a: &PointCloud<T>, b: &PointCloud<T>) -> bool {
    let bits = |x: &T| x.f64().to_bits();
    let are_same = |a: &[[T; 3]], b: &[[T; 3]]| {
        let [a, b] = [a, b].map(|rows| rows.as_flattened().iter().map(bits));
        a.eq(b)
    };
    let have_same_normals = match (a.normals(), b.normals()) {
        (Some(a), Some(b)) => are_same(a, b),
        (a, b) => a.is_none() && b.is_none(),
    };
    are_same(a.points(), b.points()) && have_same_normals
}

/// An idle plan, its settings and its number type.
struct Idle {
    settings: String,
    type_name: &'static str,
    plan: Box<dyn Any + Send>,
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
    plan.plan.release();
    put_back(settings, plan);
    Ok(result)
}

fn create<T: Number>(settings: &str) -> Result<Plan<T>, Failure> {
    Ok(Plan {
        plan: backend::plan(&Settings::parse(settings)?)?,
        last: None,
        bar: CloudCotangent::default(),
    })
}

fn take<T: Number>(settings: &str) -> Option<Box<Plan<T>>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = |idle: &Idle| idle.settings == settings && idle.type_name == T::NAME;
    let place = pool.iter().rposition(fits)?;
    pool.remove(place).plan.downcast().ok()
}

fn put_back<T: Number>(settings: &str, plan: Box<Plan<T>>) {
    let idle = Idle {
        settings: settings.into(),
        type_name: T::NAME,
        plan,
    };
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
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
