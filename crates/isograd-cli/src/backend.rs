//! A reconstruction where `--backend` says.

use std::ops::ControlFlow;

use isograd::{Backend, Field, Grid, Mesh, Options, PointCloud, Reconstructor, Stage};

use crate::error::Error;

/// `f32` or `f64`.
#[cfg(feature = "gpu")]
pub use isograd_gpu::host::Number;

/// `f32` or `f64`.
#[cfg(not(feature = "gpu"))]
pub use isograd::Real as Number;

/// A plan on the CPU or on a device.
pub enum Plan<T: Number> {
    /// On the CPU; why, where that was left to the program.
    Cpu(Box<Reconstructor<T>>, Option<String>),
    /// On a device.
    #[cfg(feature = "gpu")]
    Device(Box<isograd_gpu::host::Plan<T>>),
}

/// What a plan made, there.
pub enum Made<T: Number> {
    /// On the CPU.
    Cpu(Box<isograd::Reconstruction<T>>),
    /// On a device.
    #[cfg(feature = "gpu")]
    Device(Box<isograd_gpu::host::Reconstruction<T>>),
}

/// What the command writes and says, wherever it was made.
pub struct Results<'a, T> {
    /// φ.
    pub sdf: &'a Field<T>,
    /// The surface.
    pub mesh: &'a Mesh<T>,
    /// `(N, 3)` outward normals.
    pub normals: &'a [[T; 3]],
    /// `(N,)` how sure their sides are.
    pub confidence: &'a [T],
    /// Numbers, times and warnings.
    pub report: &'a isograd::Report,
}

impl<T: Number> Plan<T> {
    /// A plan for the cloud of `file`.
    ///
    /// # Errors
    /// What the grid and the options say; a device that can't be had.
    pub fn new(
        backend: Backend,
        grid: Grid<T>,
        options: Options,
        file: &str,
    ) -> Result<Self, Error> {
        let note = match choose(backend, grid, &options)? {
            Choice::Cpu(note) => note,
            #[cfg(feature = "gpu")]
            Choice::Device(plan) => return Ok(Self::Device(plan)),
        };
        let plan = Reconstructor::new(grid, options).map_err(|source| Error::Reconstruct {
            file: file.into(),
            source,
        })?;
        Ok(Self::Cpu(Box::new(plan), note))
    }

    /// Who computes.
    pub fn name(&self) -> &str {
        match self {
            Self::Cpu(..) => "cpu",
            #[cfg(feature = "gpu")]
            Self::Device(plan) => plan.name(),
        }
    }

    /// Why it is the CPU, where that was left to the program.
    pub fn note(&self) -> Option<&str> {
        match self {
            Self::Cpu(_, note) => note.as_deref(),
            #[cfg(feature = "gpu")]
            Self::Device(_) => None,
        }
    }

    /// Runs all stages on the cloud of `file`.
    ///
    /// # Errors
    /// What a stage or the device says.
    pub fn run(
        self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
        file: &str,
    ) -> Result<Made<T>, Error> {
        match self {
            Self::Cpu(mut plan, _) => {
                let failed = |source| Error::Reconstruct {
                    file: file.into(),
                    source,
                };
                plan.reconstruct_observed(cloud, observer).map_err(failed)?;
                Ok(Made::Cpu(Box::new(plan.into_reconstruction())))
            }
            #[cfg(feature = "gpu")]
            Self::Device(mut plan) => {
                let result = plan.reconstruct_observed(cloud, observer);
                let _ = observer(Stage::Checks);
                Ok(Made::Device(Box::new(
                    result.map_err(|e| device_error(e, file))?,
                )))
            }
        }
    }
}

impl<T: Number> Made<T> {
    /// The results, in the memory of the CPU. `cloud` is what it was made of.
    ///
    /// # Errors
    /// What the device says.
    pub fn results<'a>(
        &'a self,
        #[cfg_attr(not(feature = "gpu"), allow(unused_variables))] cloud: &PointCloud<T>,
        #[cfg_attr(not(feature = "gpu"), allow(unused_variables))] file: &str,
    ) -> Result<Results<'a, T>, Error> {
        match self {
            Self::Cpu(of) => Ok(Results {
                sdf: of.sdf(),
                mesh: of.mesh(),
                normals: of.normals(),
                confidence: of.confidence(),
                report: of.report(),
            }),
            #[cfg(feature = "gpu")]
            Self::Device(of) => {
                let results = || {
                    Ok(Results {
                        sdf: of.sdf()?,
                        mesh: of.mesh()?,
                        normals: of.normals()?,
                        confidence: of.confidence()?,
                        report: of.report(cloud)?,
                    })
                };
                results().map_err(|e| device_error(e, file))
            }
        }
    }
}

#[cfg(feature = "gpu")]
use isograd_gpu::host::Choice;

#[cfg(feature = "gpu")]
fn choose<T: Number>(
    backend: Backend,
    grid: Grid<T>,
    options: &Options,
) -> Result<Choice<T>, Error> {
    isograd_gpu::host::choose(backend, grid, options).map_err(|error| match error {
        isograd_gpu::host::Error::NotBuilt(backend) => not_built(backend),
        error => Error::Backend { backend, error },
    })
}

#[cfg(feature = "gpu")]
fn device_error(error: isograd_gpu::host::Error, file: &str) -> Error {
    let file = file.into();
    match error {
        isograd_gpu::host::Error::Host(source) => Error::Reconstruct { file, source },
        source => Error::Device { file, source },
    }
}

#[cfg(not(feature = "gpu"))]
enum Choice {
    Cpu(Option<String>),
}

#[cfg(not(feature = "gpu"))]
fn choose<T>(backend: Backend, _: Grid<T>, _: &Options) -> Result<Choice, Error> {
    match backend {
        Backend::Cpu => Ok(Choice::Cpu(None)),
        Backend::Auto => Ok(Choice::Cpu(Some(
            "computed on the CPU: neither CUDA nor Vulkan is built into this program".into(),
        ))),
        backend => Err(not_built(backend)),
    }
}

fn not_built(backend: Backend) -> Error {
    let (name, feature) = match backend {
        Backend::Cuda(_) => ("CUDA", "cuda"),
        _ => ("Vulkan", "vulkan"),
    };
    Error::NotBuilt { name, feature }
}
