//! Choice of the backend.

use isograd::{Backend, Grid, Options};

use super::{Error, Number, Plan};

/// The CPU or a device.
pub enum Choice<T: Number> {
    /// The CPU, by [`isograd::Reconstructor`]; with [`Backend::Auto`], the reason.
    Cpu(Option<String>),
    /// A device.
    Device(Box<Plan<T>>),
}

/// A plan where `backend` says. With [`Backend::Auto`] that is CUDA or Vulkan, where this program has it, a GPU is
/// there for it and can do what the options ask for; else the CPU. A Vulkan driver that computes on the CPU is no GPU:
/// the CPU's own code is faster.
///
/// Devices are looked for, and the libraries that this takes are loaded, only where `backend` may mean one.
///
/// # Errors
/// As [`Plan::new`], but with [`Backend::Auto`].
pub fn choose<T: Number>(
    backend: Backend,
    grid: Grid<T>,
    options: &Options,
) -> Result<Choice<T>, Error> {
    let plan = |backend| Plan::new(backend, grid, options.clone()).map(Box::new);
    match backend {
        Backend::Cpu => Ok(Choice::Cpu(None)),
        Backend::Cuda(_) | Backend::Vulkan => Ok(Choice::Device(plan(backend)?)),
        Backend::Auto => {
            let mut reasons = Vec::new();
            for (backend, found) in [(Backend::Cuda(0), cuda()), (Backend::Vulkan, vulkan())] {
                match found.and_then(|()| plan(backend)) {
                    Ok(plan) => return Ok(Choice::Device(plan)),
                    Err(error) => reasons.push(error.to_string()),
                }
            }
            Ok(Choice::Cpu(Some(format!(
                "computed on the CPU: {}",
                reasons.join("; ")
            ))))
        }
    }
}

/// Whether there is a CUDA device.
#[cfg(feature = "cuda")]
fn cuda() -> Result<(), Error> {
    Ok(crate::Device::cuda(0).map(|_| ())?)
}

#[cfg(not(feature = "cuda"))]
fn cuda() -> Result<(), Error> {
    Err(Error::NotBuilt(Backend::Cuda(0)))
}

/// Whether there is a Vulkan device that is a GPU.
#[cfg(feature = "wgpu")]
fn vulkan() -> Result<(), Error> {
    Ok(crate::Device::vulkan_gpu().map(|_| ())?)
}

#[cfg(not(feature = "wgpu"))]
fn vulkan() -> Result<(), Error> {
    Err(Error::NotBuilt(Backend::Vulkan))
}
