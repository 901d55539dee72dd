//! Plans and their results, behind `isograd.Reconstructor` and `isograd.Reconstruction`.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use isograd::data::Attribute;
use isograd::{Backend, PointCloud, Sensors, Stage};
use pyo3::prelude::*;

use crate::arrays::{self, Dtype, Either, Number};
use crate::backend::{self, Failure};
use crate::background::{self, Stop};
use crate::errors::value;
use crate::result::{Reconstruction, ReconstructionArrays};
use crate::settings::Settings;
use crate::threads::{self, Threads};

/// A plan for one grid and one set of options, in either number type.
#[pyclass(frozen)]
pub struct Plan {
    settings: Settings,
    single: Mutex<Option<isograd_backend::Plan<f32>>>,
    double: Mutex<Option<isograd_backend::Plan<f64>>>,
    /// Why `auto` selected the CPU.
    note: Mutex<Option<String>>,
    threads: Threads,
}

/// Name, components and values of an attribute, as `isograd.Reconstructor` passes it.
pub type AttributeArray<'py> = (String, usize, Bound<'py, PyAny>);

#[pymethods]
impl Plan {
    #[new]
    #[pyo3(signature = (settings, threads=None))]
    fn new(py: Python<'_>, settings: &str, threads: Option<usize>) -> PyResult<Self> {
        let settings = Settings::parse(settings).map_err(value)?;
        settings.grid::<f64>().map_err(value)?;
        let plan = Self {
            single: Mutex::default(),
            double: Mutex::default(),
            note: Mutex::default(),
            threads: threads.map(|n| threads::start(py, n)).transpose()?,
            settings,
        };
        if plan.settings.backend != Backend::Cpu {
            // An unavailable device is an error now.
            let settings = plan.settings.clone();
            let single = background::run(py, move |_| backend::plan(&settings))??;
            plan.store(&plan.single, single);
        }
        Ok(plan)
    }

    /// Why `auto` selected the CPU; once.
    fn take_note(&self) -> Option<String> {
        lock(&self.note).take()
    }

    /// Reconstructs a cloud: `points`, `normals` and `sensors` of one type. `progress` is called with the name of each
    /// stage, before it.
    #[pyo3(signature = (points, normals, sensors, attributes, progress=None))]
    fn reconstruct(
        &self,
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        sensors: Option<&Bound<'_, PyAny>>,
        attributes: Vec<AttributeArray<'_>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ReconstructionArrays> {
        let py = points.py();
        let observe = |stage: Stage| match progress {
            Some(progress) => progress.call1((stage.name(),)).map(drop),
            None => Ok(()),
        };
        match arrays::dtype(points, "points")? {
            Dtype::F32 => {
                let cloud = with_sensors(cloud(points, normals, attributes)?, sensors)?;
                let result = self.run(&self.single, py, cloud, observe)?;
                Ok(ReconstructionArrays(Either::F32(Arc::new(result))))
            }
            Dtype::F64 => {
                let cloud = with_sensors(cloud(points, normals, attributes)?, sensors)?;
                let result = self.run(&self.double, py, cloud, observe)?;
                Ok(ReconstructionArrays(Either::F64(Arc::new(result))))
            }
        }
    }
}

impl Plan {
    /// Reconstructs with the idle plan in `place`, or a new one. No lock is held during the work, and an interrupt drops
    /// the plan.
    fn run<T: Number>(
        &self,
        place: &Mutex<Option<isograd_backend::Plan<T>>>,
        py: Python<'_>,
        cloud: PointCloud<T>,
        observe: impl FnMut(Stage) -> PyResult<()>,
    ) -> PyResult<Reconstruction<T>> {
        let idle = lock(place).take();
        let (settings, threads) = (self.settings.clone(), self.threads.clone());
        let work = move |stop: &Stop, report: &(dyn Fn(Stage) + Sync)| {
            let mut plan = match idle {
                Some(plan) => plan,
                None => backend::plan(&settings)?,
            };
            let mut observer = |stage| match stop.is_requested() {
                true => ControlFlow::Break(()),
                false => {
                    report(stage);
                    ControlFlow::Continue(())
                }
            };
            let made = threads::install_on(threads.as_ref(), || plan.make(&cloud, &mut observer));
            let result = made.map(|result| Reconstruction {
                cloud,
                result,
                threads,
            });
            Ok::<_, Failure>((plan, result))
        };
        let (plan, result) = background::run_with_messages(py, work, observe)??;
        self.store(place, plan);
        Ok(result.map_err(Failure::from)?)
    }

    fn store<T: Number>(
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
/// Arrays of another type or shape, and invalid clouds.
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

/// The cloud with the positions of its sensors: `(N, 3)` is one for each point, any other number is for all points.
///
/// # Errors
/// Arrays of another type or shape, and positions that are not finite.
pub fn with_sensors<T: Number>(
    cloud: PointCloud<T>,
    sensors: Option<&Bound<'_, PyAny>>,
) -> PyResult<PointCloud<T>> {
    let Some(sensors) = sensors else {
        return Ok(cloud);
    };
    let positions = arrays::vectors(sensors, "sensors")?;
    let sensors = match positions.len() == cloud.len() {
        true => Sensors::Each(positions),
        false => Sensors::Any(positions),
    };
    cloud.with_sensors(sensors).map_err(value)
}
