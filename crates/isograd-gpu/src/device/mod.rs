//! A device, and memory on it.

mod buffer;
mod effort;
#[cfg(feature = "cuda")]
mod foreign;
mod launch;
#[cfg(feature = "cuda")]
mod libraries;
mod open;
mod stream;

use cubecl::prelude::*;

use effort::Counts;
pub(crate) use launch::{argument, launch};

pub use buffer::Buffer;
pub use effort::Effort;
#[cfg(feature = "cuda")]
pub use foreign::{DeviceArray, SharedMemory};
pub(crate) use launch::{Argument, BLOCK, Ready};
#[cfg(feature = "cuda")]
pub use open::Cuda;
#[cfg(feature = "wgpu")]
pub use open::Vulkan;

/// `f32` or `f64`, on the host and on a device.
pub trait Scalar: isograd::Pipeline + Float + CubeElement {}

impl Scalar for f32 {}
impl Scalar for f64 {}

/// Errors of a device.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There is no such device here.
    #[error("no {backend} device: {reason}; {remedy}")]
    NoDevice {
        /// `Vulkan` or `CUDA`.
        backend: &'static str,
        /// Reason, such as a missing library.
        reason: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The device has no double precision.
    #[error("{device} has no {number}; use f32, or the CPU")]
    NoNumber {
        /// Name of the device.
        device: String,
        /// Name of the number type.
        number: &'static str,
    },
    /// An array is longer than the device can bind to a kernel.
    #[error(
        "an array of {bytes} bytes is more than the {limit} that {device} binds to a kernel; use a coarser grid, or the CPU"
    )]
    TooLarge {
        /// Name of the device.
        device: String,
        /// Size of the array in bytes.
        bytes: u64,
        /// Most that one array may have.
        limit: u64,
    },
    /// Array lengths that do not match.
    #[error("{what} has {found} elements, but {expected} are needed")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// The smoothing is negative or not finite.
    #[error("the smoothing is {smoothing} cells; it must be finite and 0 or more")]
    Smoothing {
        /// Smoothing passed by the caller, in cells.
        smoothing: f64,
    },
    /// An array is on another device.
    #[error("an array is on another device than {device}, which was to compute; use that device")]
    Elsewhere {
        /// Name of the device.
        device: String,
    },
    /// The device failed while it worked.
    #[error("{device} failed: {reason}")]
    Failed {
        /// Name of the device.
        device: String,
        /// Message of the driver.
        reason: String,
    },
}

/// Memory of a device that this program has, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// In arrays.
    pub in_use: u64,
    /// In arrays, and kept for others.
    pub reserved: u64,
}

/// An open device: what kernels are launched on.
///
/// Work is queued in the order of the calls, and a call returns before the device has done it;
/// [`Self::download`] and [`Self::wait`] wait.
#[derive(Clone)]
pub struct Device<R: Runtime> {
    client: ComputeClient<R>,
    name: String,
    has_f64: bool,
    counts: Counts,
}

impl<R: Runtime> Device<R> {
    /// A device of any runtime of CubeCL.
    pub fn new(mut client: ComputeClient<R>, name: String) -> Self {
        stream::share(&mut client);
        let double = f64::as_type_native_unchecked().elem_type();
        Self {
            has_f64: client.properties().supports_type(double),
            client,
            name,
            counts: Counts::default(),
        }
    }

    /// This device, marked as having double precision: CubeCL does not list it for CUDA, where every device has it.
    pub fn with_f64(self) -> Self {
        Self {
            has_f64: true,
            ..self
        }
    }

    /// The name that its driver gives the device.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where a kernel is launched, which counts.
    pub(crate) fn client(&self) -> &ComputeClient<R> {
        self.counts.launch();
        &self.client
    }

    /// Whether kernels of this number type run here.
    ///
    /// # Errors
    /// [`Error::NoNumber`] if they don't.
    pub fn check_number<T: Scalar>(&self) -> Result<(), Error> {
        if T::NAME == "f32" || self.has_f64 {
            Ok(())
        } else {
            Err(Error::NoNumber {
                device: self.name.clone(),
                number: T::NAME,
            })
        }
    }

    /// An array of `len` elements that hold anything.
    pub fn empty<E: CubeElement>(&self, len: usize) -> Result<Buffer<E>, Error> {
        let bytes = self.check_size::<E>(len)?;
        Ok(Buffer::from_handle(self.client.empty(bytes), len))
    }

    /// A copy of `values` on the device.
    pub fn upload<E: CubeElement>(&self, values: &[E]) -> Result<Buffer<E>, Error> {
        if values.is_empty() {
            return self.empty(0);
        }
        self.check_size::<E>(values.len())?;
        let handle = self.client.create_from_slice(E::as_bytes(values));
        Ok(Buffer::from_handle(handle, values.len()))
    }

    /// A copy of an array in the host's memory. Waits for the work that makes it.
    pub fn download<E: CubeElement>(&self, buffer: &Buffer<E>) -> Result<Vec<E>, Error> {
        if buffer.is_empty() {
            return Ok(Vec::new());
        }
        // Reading alone does not say that a kernel before it failed.
        self.wait()?;
        let bytes = self.client.read_one(buffer.handle());
        let bytes = bytes.map_err(|e| self.failed(&e))?;
        let mut values = E::from_bytes(&bytes).to_vec();
        values.truncate(buffer.len());
        Ok(values)
    }

    /// Waits until all that was queued is done.
    pub fn wait(&self) -> Result<(), Error> {
        self.counts.wait();
        cubecl::future::block_on(self.client.sync()).map_err(|e| self.failed(&e))
    }

    /// Launches and waits since the device was opened, by this value and its clones.
    pub fn effort(&self) -> Effort {
        self.counts.effort()
    }

    /// Bytes that the units of a group can share.
    pub(crate) fn shared_memory(&self) -> usize {
        self.client.properties().hardware.max_shared_memory_size
    }

    /// Device memory held by this program.
    pub fn memory(&self) -> Result<Memory, Error> {
        let usage = self.client.memory_usage().map_err(|e| self.failed(&e))?;
        Ok(Memory {
            in_use: usage.bytes_in_use,
            reserved: usage.bytes_reserved,
        })
    }

    /// Gives memory that no array uses back to the driver, as far as it takes it. Waits for all that was queued.
    pub fn release(&self) -> Result<(), Error> {
        self.wait()?;
        self.client.memory_cleanup();
        self.wait()
    }

    /// Groups of `block` units for at least `count` units, as many along y as it takes to stay within the
    /// limit along x. Kernels compare `ABSOLUTE_POS` with their number of elements.
    pub(crate) fn groups(&self, count: usize, block: u32) -> CubeCount {
        let groups = count.div_ceil(block as usize) as u64;
        let limit = u64::from(self.client.properties().hardware.max_cube_count.0);
        let rows = groups.div_ceil(limit).max(1);
        CubeCount::Static(groups.div_ceil(rows).max(1) as u32, rows as u32, 1)
    }

    /// Bytes of an array of at least one element (devices have no empty ones).
    fn check_size<E: CubeElement>(&self, len: usize) -> Result<usize, Error> {
        let bytes = len.max(1).saturating_mul(size_of::<E>());
        let limit = self.client.properties().memory.max_page_size;
        if bytes as u64 > limit {
            return Err(Error::TooLarge {
                device: self.name.clone(),
                bytes: bytes as u64,
                limit,
            });
        }
        Ok(bytes)
    }

    fn failed(&self, error: &dyn std::fmt::Debug) -> Error {
        Error::Failed {
            device: self.name.clone(),
            reason: format!("{error:?}"),
        }
    }
}

/// An array must have the length that the others call for.
pub(crate) fn check_length<E>(
    what: &'static str,
    buffer: &Buffer<E>,
    expected: usize,
) -> Result<(), Error> {
    if buffer.len() == expected {
        Ok(())
    } else {
        Err(Error::Length {
            what,
            found: buffer.len(),
            expected,
        })
    }
}
