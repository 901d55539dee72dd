//! Plans and their results, behind `isograd.Reconstructor` and `isograd.Reconstruction`.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use isograd::data::Attribute;
use isograd::{Backend, PointCloud, Sensors};
use pyo3::prelude::*;

use crate::arrays::{self, Dtype, Either, Number};
use crate::backend::{self, Failure};
use crate::background;
use crate::errors::value;
use crate::result::{Kept, Outcome};
use crate::settings::Settings;

/// A plan for one grid and one set of options, in either number type.
#[pyclass(frozen)]
pub struct Plan {
    settings: Settings,
    single: Mutex<Option<isograd_backend::Plan<f32>>>,
    double: Mutex<Option<isograd_backend::Plan<f64>>>,
    /// Why the CPU computes, where that was left to the package.
    note: Mutex<Option<String>>,
}

/// Name, components and values of an attribute, as `isograd.Reconstructor` passes it.
pub type AttributeArray<'py> = (String, usize, Bound<'py, PyAny>);

#[pymethods]
impl Plan {
    #[new]
    fn new(py: Python<'_>, settings: &str) -> PyResult<Self> {
        let settings = Settings::parse(settings).map_err(value)?;
        settings.grid::<f64>().map_err(value)?;
        let plan = Self {
            single: Mutex::default(),
            double: Mutex::default(),
            note: Mutex::default(),
            settings,
        };
        if plan.settings.backend != Backend::Cpu {
            // An unavailable device is an error now.
            let settings = plan.settings.clone();
            let single = background::run(py, move |_| backend::plan(&settings))??;
            plan.keep(&plan.single, single);
        }
        Ok(plan)
    }

    /// Why the CPU computes, where that was left to the package; to be said once.
    fn take_note(&self) -> Option<String> {
        lock(&self.note).take()
    }

    /// Reconstructs a cloud: `points`, `normals` and `sensors` of one type.
    #[pyo3(signature = (points, normals, sensors, attributes))]
    fn reconstruct(
        &self,
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        sensors: Option<&Bound<'_, PyAny>>,
        attributes: Vec<AttributeArray<'_>>,
    ) -> PyResult<Outcome> {
        match arrays::dtype(points, "points")? {
            Dtype::F32 => {
                let cloud = seen(cloud(points, normals, attributes)?, sensors)?;
                let kept = self.run(&self.single, points.py(), cloud)?;
                Ok(Outcome(Either::F32(Arc::new(kept))))
            }
            Dtype::F64 => {
                let cloud = seen(cloud(points, normals, attributes)?, sensors)?;
                let kept = self.run(&self.double, points.py(), cloud)?;
                Ok(Outcome(Either::F64(Arc::new(kept))))
            }
        }
    }
}

impl Plan {
    /// With the plan that waits in `place`, or a new one where there is none: no lock is held meanwhile, and an
    /// interrupt leaves none behind.
    fn run<T: Number>(
        &self,
        place: &Mutex<Option<isograd_backend::Plan<T>>>,
        py: Python<'_>,
        cloud: PointCloud<T>,
    ) -> PyResult<Kept<T>> {
        let waiting = lock(place).take();
        let settings = self.settings.clone();
        let (plan, result) = background::run(py, move |stop| {
            let mut plan = match waiting {
                Some(plan) => plan,
                None => backend::plan(&settings)?,
            };
            let mut observer = |_| match stop.is_requested() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            };
            let result = plan.make(&cloud, &mut observer);
            Ok::<_, Failure>((plan, result.map(|result| Kept { cloud, result })))
        })??;
        self.keep(place, plan);
        Ok(result.map_err(Failure::from)?)
    }

    fn keep<T: Number>(
        &self,
        place: &Mutex<Option<isograd_backend::Plan<T>>>,
        mut plan: isograd_backend::Plan<T>,
    ) {
        if let Some(note) = plan.take_note() {
            *lock(&self.note) = Some(note);
        }
        *lock(place) = Some(plan);
    }
}

fn lock<V>(place: &Mutex<V>) -> MutexGuard<'_, V> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A cloud from its arrays: `points` and `normals` `(N, 3)`.
///
/// # Errors
/// Arrays of another type or shape, and values that make no cloud.
pub fn cloud<T: Number>(
    points: &Bound<'_, PyAny>,
    normals: Option<&Bound<'_, PyAny>>,
    attributes: Vec<AttributeArray<'_>>,
) -> PyResult<PointCloud<T>> {
    let mut cloud = PointCloud::new(arrays::vectors(points, "points")?).map_err(value)?;
    if let Some(normals) = normals {
        let normals = arrays::vectors(normals, "normals")?;
        cloud = cloud.with_normals(normals).map_err(value)?;
    }
    for (name, components, array) in attributes {
        let values = arrays::values(&array, &name)?;
        let attribute = Attribute {
            name,
            components,
            values,
        };
        cloud = cloud.with_attribute(attribute).map_err(value)?;
    }
    Ok(cloud)
}

/// The cloud with where it was seen from: `(N, 3)` is a place for each point, any other number of places is that
/// of all.
///
/// # Errors
/// Arrays of another type or shape, and places that are not finite.
pub fn seen<T: Number>(
    cloud: PointCloud<T>,
    sensors: Option<&Bound<'_, PyAny>>,
) -> PyResult<PointCloud<T>> {
    let Some(sensors) = sensors else {
        return Ok(cloud);
    };
    let places = arrays::vectors(sensors, "sensors")?;
    let sensors = match places.len() == cloud.len() {
        true => Sensors::Each(places),
        false => Sensors::Any(places),
    };
    cloud.with_sensors(sensors).map_err(value)
}
