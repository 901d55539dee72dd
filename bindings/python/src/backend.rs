//! A plan, and what it makes, where `backend` says.

use std::ops::ControlFlow;

use isograd::distance::extend;
use isograd::{
    Attribute, Backend, CloudCotangent, Cotangent, PointCloud, Reconstruction, Reconstructor,
    Report, Stage,
};
use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

use crate::arrays::Number;
use crate::settings::Settings;

/// `f32` or `f64`, wherever there are plans for it.
#[cfg(feature = "gpu")]
pub use isograd_gpu::host::Number as Scalar;

/// `f32` or `f64`, wherever there are plans for it.
#[cfg(not(feature = "gpu"))]
pub use isograd::Real as Scalar;

/// Why there is no result.
#[derive(Debug)]
pub enum Failure {
    /// What was given makes none.
    Value(String),
    /// A device can't be had, or fails.
    Device(String),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Value(text) => PyValueError::new_err(text),
            Failure::Device(text) => PyRuntimeError::new_err(text),
        }
    }
}

/// A plan on the CPU or on a device.
pub enum Plan<T: Number> {
    /// On the CPU; why, where that was left to the package.
    Cpu(Box<Reconstructor<T>>, Option<String>),
    /// On a device.
    #[cfg(feature = "gpu")]
    Device(Box<isograd_gpu::host::Plan<T>>),
}

/// What a plan made, there.
pub enum Made<T: Number> {
    /// On the CPU.
    Cpu(Box<Reconstruction<T>>),
    /// On a device, and its name.
    #[cfg(feature = "gpu")]
    Device(Box<isograd_gpu::host::Reconstruction<T>>, String),
}

impl<T: Number> Plan<T> {
    /// A plan for grid, options and backend.
    ///
    /// # Errors
    /// What the grid, the options or the device say.
    pub fn new(settings: &Settings) -> Result<Self, Failure> {
        let note = match choose(settings)? {
            Choice::Cpu(note) => note,
            #[cfg(feature = "gpu")]
            Choice::Device(plan) => return Ok(Self::Device(plan)),
        };
        let plan = settings.plan().map_err(Failure::Value)?;
        Ok(Self::Cpu(Box::new(plan), note))
    }

    /// Why it is the CPU, where that was left to the package: once.
    pub fn take_note(&mut self) -> Option<String> {
        match self {
            Self::Cpu(_, note) => note.take(),
            #[cfg(feature = "gpu")]
            Self::Device(_) => None,
        }
    }

    /// Runs all stages.
    ///
    /// # Errors
    /// What a stage or the device says.
    pub fn run(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Made<T>, Failure> {
        match self {
            Self::Cpu(plan, _) => match plan.reconstruct_observed(cloud, observer) {
                Ok(result) => Ok(Made::Cpu(Box::new(result.clone()))),
                Err(error) => Err(Failure::Value(error.to_string())),
            },
            #[cfg(feature = "gpu")]
            Self::Device(plan) => {
                let result = plan.reconstruct_observed(cloud, observer)?;
                Ok(Made::Device(Box::new(result), plan.name().into()))
            }
        }
    }
}

/// The same of a result on the CPU and of one on a device, which may fail.
macro_rules! of_either {
    ($(#[$doc:meta])* $name:ident -> $kind:ty, $cpu:ident => $on_cpu:expr, $device:ident => $on_device:expr) => {
        $(#[$doc])*
        ///
        /// # Errors
        /// What the device says.
        pub fn $name(&self) -> Result<$kind, Failure> {
            match self {
                Self::Cpu($cpu) => Ok($on_cpu),
                #[cfg(feature = "gpu")]
                Self::Device($device, _) => Ok($on_device),
            }
        }
    };
}

impl<T: Number> Made<T> {
    of_either!(/// φ.
        sdf -> &[T], of => of.sdf().values(), of => of.sdf()?.values());
    of_either!(/// χ.
        indicator -> &[T], of => of.indicator().values(), of => of.indicator()?.values());
    of_either!(/// The level of the surface.
        iso_value -> T, of => of.iso_value(), of => of.iso_value()?);
    of_either!(/// The surface.
        mesh -> &isograd::Mesh<T>, of => of.mesh(), of => of.mesh()?);
    of_either!(/// Closest faces.
        closest -> &[u32], of => of.closest(), of => of.closest()?);
    of_either!(/// Outward normals.
        normals -> &[[T; 3]], of => of.normals(), of => of.normals()?);
    of_either!(/// Areas.
        areas -> &[T], of => of.areas(), of => of.areas()?);

    of_either!(/// How sure the sides are.
        confidence -> &[T], of => of.confidence(), of => of.confidence()?);

    of_either!(/// Samples in each neighbourhood.
        neighbour_counts -> &[u32], of => of.neighbour_counts(), of => of.neighbour_counts()?);

    /// Cells of the grid along each axis.
    pub fn shape(&self) -> [usize; 3] {
        match self {
            Self::Cpu(of) => of.sdf().grid().shape(),
            #[cfg(feature = "gpu")]
            Self::Device(of, _) => of.grid().shape(),
        }
    }

    /// Who computed: `cpu`, or a backend and its device.
    pub fn backend(&self) -> &str {
        match self {
            Self::Cpu(_) => "cpu",
            #[cfg(feature = "gpu")]
            Self::Device(_, name) => name,
        }
    }

    /// An attribute on the surface and round it, and what its pullback needs.
    ///
    /// # Errors
    /// What the stage or the device says.
    pub fn extend(
        &self,
        attribute: &Attribute<T>,
        band_cells: f64,
    ) -> Result<(extend::Extension<T>, extend::Residual<T>), Failure> {
        match self {
            Self::Cpu(of) => {
                let (mut residual, mut extension) = Default::default();
                let scratch = &mut extend::Scratch::default();
                of.extend_into(
                    attribute,
                    band_cells,
                    scratch,
                    &mut residual,
                    &mut extension,
                )
                .map_err(|error| Failure::Value(error.to_string()))?;
                Ok((extension, residual))
            }
            #[cfg(feature = "gpu")]
            Self::Device(of, _) => Ok(of.extend_with_residual(attribute, band_cells)?),
        }
    }

    /// Numbers, times and warnings.
    ///
    /// # Errors
    /// What the device says.
    pub fn report(
        &self,
        #[cfg_attr(not(feature = "gpu"), allow(unused_variables))] cloud: &PointCloud<T>,
    ) -> Result<&Report, Failure> {
        match self {
            Self::Cpu(of) => Ok(of.report()),
            #[cfg(feature = "gpu")]
            Self::Device(of, _) => Ok(of.report(cloud)?),
        }
    }

    /// Cotangents of the inputs.
    ///
    /// # Errors
    /// Cotangents that are not those of this result; what the device says.
    pub fn pullback(
        &self,
        cloud: &PointCloud<T>,
        cotangent: &Cotangent<'_, T>,
    ) -> Result<CloudCotangent<T>, Failure> {
        match self {
            Self::Cpu(of) => {
                let back = of.pullback(cloud, cotangent);
                back.map_err(|error| Failure::Value(error.to_string()))
            }
            #[cfg(feature = "gpu")]
            Self::Device(of, _) => Ok(of.pullback(cotangent)?),
        }
    }
}

#[cfg(feature = "gpu")]
use isograd_gpu::host::Choice;

#[cfg(feature = "gpu")]
fn choose<T: Number>(settings: &Settings) -> Result<Choice<T>, Failure> {
    use isograd_gpu::host::{self, Error};
    let grid = settings.grid::<T>();
    let grid = grid.map_err(|error| Failure::Value(error.to_string()))?;
    match host::choose(settings.backend()?, grid, &settings.options()) {
        Err(Error::NotBuilt(backend)) => Err(not_built(backend)),
        chosen => Ok(chosen?),
    }
}

#[cfg(feature = "gpu")]
impl From<isograd_gpu::host::Error> for Failure {
    fn from(error: isograd_gpu::host::Error) -> Self {
        use isograd_gpu::host::Error;
        let text = error.to_string();
        match error {
            Error::NotBuilt(_) | Error::Device(_) | Error::Result { .. } => Self::Device(text),
            _ => Self::Value(text),
        }
    }
}

#[cfg(not(feature = "gpu"))]
enum Choice {
    Cpu(Option<String>),
}

#[cfg(not(feature = "gpu"))]
fn choose(settings: &Settings) -> Result<Choice, Failure> {
    match settings.backend()? {
        Backend::Cpu => Ok(Choice::Cpu(None)),
        Backend::Auto => Ok(Choice::Cpu(Some(
            "computed on the CPU: neither CUDA nor Vulkan is built into this package".into(),
        ))),
        backend => Err(not_built(backend)),
    }
}

fn not_built(backend: Backend) -> Failure {
    let (name, feature) = match backend {
        Backend::Cuda(_) => ("CUDA", "cuda"),
        _ => ("Vulkan", "vulkan"),
    };
    Failure::Device(format!(
        "this package was built without {name}: build it with `MATURIN_PEP517_ARGS=\"--features pyo3/extension-module,{feature}\" pip install .`, or compute with backend=\"cpu\""
    ))
}
