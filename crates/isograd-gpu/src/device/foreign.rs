//! Arrays of other programs in the memory of a CUDA device, such as those of JAX and tensors of PyTorch.
//!
//! Unsafe because an address is all that such programs give; what it must be is said at [`DeviceArray::new`]. Copies are
//! queued in the owner's stream, and done when a function returns.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use cubecl::prelude::*;
use cudarc::driver::{DriverError, result, sys};

use super::{Buffer, Cuda, Device, Error};

/// An array in C order on a CUDA device, which another program owns.
#[derive(Clone, Copy, Debug)]
pub struct DeviceArray<E> {
    address: u64,
    len: usize,
    stream: usize,
    elements: PhantomData<E>,
}

impl<E: CubeElement + Default> DeviceArray<E> {
    /// The array of `len` elements at `address`, whose owner uses it in the CUDA stream `stream`, 0 for the default one.
    ///
    /// # Safety
    /// As long as this value is used there are so many elements, which nobody else writes; of one that is written to,
    /// nobody else reads them. The stream exists.
    pub unsafe fn new(address: u64, len: usize, stream: usize) -> Self {
        Self {
            address,
            len,
            stream,
            elements: PhantomData,
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has no elements.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Part `k` of `count` equal parts.
    pub fn part(&self, k: usize, count: usize) -> Self {
        let len = self.len / count;
        let address = self.address + (k * len * size_of::<E>()) as u64;
        Self {
            address,
            len,
            ..*self
        }
    }

    /// A copy in the host's memory.
    ///
    /// # Errors
    /// An address that is not of a CUDA device; errors of the driver.
    pub fn download(&self) -> Result<Vec<E>, Error> {
        let mut values = vec![E::default(); self.len];
        // SAFETY: as many values as are there, by the promise of `new`; they are written when `in_stream` returns.
        self.in_stream(|stream| unsafe {
            result::memcpy_dtoh_async(&mut values, self.address, stream)
        })?;
        Ok(values)
    }

    /// Writes values of the host.
    ///
    /// # Errors
    /// As [`Self::download`]; another number of values.
    pub fn upload(&self, values: &[E]) -> Result<(), Error> {
        self.check_length(values.len())?;
        // SAFETY: as above; the values are read when `in_stream` returns.
        self.in_stream(|stream| unsafe { result::memcpy_htod_async(self.address, values, stream) })
    }

    fn check_length(&self, found: usize) -> Result<(), Error> {
        match found == self.len {
            true => Ok(()),
            false => Err(Error::Length {
                what: "an array on the device",
                found,
                expected: self.len,
            }),
        }
    }

    /// Queues a copy in the stream of the owner, and waits for it.
    fn in_stream(
        &self,
        queue: impl FnOnce(sys::CUstream) -> Result<(), DriverError>,
    ) -> Result<(), Error> {
        if self.is_empty() {
            return Ok(());
        }
        let copy = || -> Result<(), DriverError> {
            let _current = Current::of(ordinal(self.address)?)?;
            let stream = self.stream as sys::CUstream;
            queue(stream)?;
            // SAFETY: the stream exists, by the promise of `new`.
            unsafe { result::stream::synchronize(stream) }
        };
        copy().map_err(|error| Error::Failed {
            device: "the device of an array".into(),
            reason: error.to_string(),
        })
    }
}

/// Number of the device that has an address.
fn ordinal(address: u64) -> Result<i32, DriverError> {
    let mut ordinal = -1;
    let attribute = sys::CUpointer_attribute::CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL;
    result::init()?;
    // SAFETY: this attribute is an `int`; any address may be asked about.
    unsafe {
        sys::cuPointerGetAttribute((&raw mut ordinal).cast(), attribute, address).result()?;
    }
    Ok(ordinal)
}

/// The primary context of a device, current in this thread until it is dropped.
struct Current {
    device: sys::CUdevice,
    before: sys::CUcontext,
}

impl Current {
    fn of(ordinal: i32) -> Result<Self, DriverError> {
        let before = result::ctx::get_current()?.unwrap_or(std::ptr::null_mut());
        let device = result::device::get(ordinal)?;
        // SAFETY: a device of the driver; its context is kept until this value is dropped.
        unsafe {
            let context = result::primary_ctx::retain(device)?;
            let current = Self { device, before };
            result::ctx::set_current(context)?;
            Ok(current)
        }
    }
}

impl Drop for Current {
    fn drop(&mut self) {
        // SAFETY: the context that was current, and the reference that `of` took. Neither can be mended if it fails.
        unsafe {
            let _ = result::ctx::set_current(self.before);
            let _ = result::primary_ctx::release(self.device);
        }
    }
}

/// Runtimes of a host's plans, which may share memory with other programs.
pub trait SharedMemory: Runtime {
    /// A copy of an array of another program on a device of its own.
    ///
    /// # Errors
    /// An array that is on another device, or of a runtime that is not CUDA; errors of the driver.
    fn import<E: CubeElement + Default>(
        device: &Device<Self>,
        _array: &DeviceArray<E>,
    ) -> Result<Buffer<E>, Error>
    where
        Self: Sized,
    {
        Err(elsewhere(device))
    }

    /// Writes a copy of `buffer` into an array of another program.
    ///
    /// # Errors
    /// As [`Self::import`]; another number of elements.
    fn export<E: CubeElement + Default>(
        device: &Device<Self>,
        _buffer: &Buffer<E>,
        _array: &DeviceArray<E>,
    ) -> Result<(), Error>
    where
        Self: Sized,
    {
        Err(elsewhere(device))
    }
}

fn elsewhere<R: Runtime>(device: &Device<R>) -> Error {
    Error::Elsewhere {
        device: device.name.clone(),
    }
}

#[cfg(feature = "wgpu")]
impl SharedMemory for super::Vulkan {}

impl SharedMemory for Cuda {
    fn import<E: CubeElement + Default>(
        device: &Device<Self>,
        array: &DeviceArray<E>,
    ) -> Result<Buffer<E>, Error> {
        let buffer = device.empty(array.len)?;
        let address = address(device, &buffer, array)?;
        let bytes = array.len * size_of::<E>();
        // SAFETY: both have so many bytes.
        array.in_stream(|stream| unsafe {
            result::memcpy_dtod_async(address, array.address, bytes, stream)
        })?;
        Ok(buffer)
    }

    fn export<E: CubeElement + Default>(
        device: &Device<Self>,
        buffer: &Buffer<E>,
        array: &DeviceArray<E>,
    ) -> Result<(), Error> {
        array.check_length(buffer.len())?;
        let address = address(device, buffer, array)?;
        let bytes = array.len * size_of::<E>();
        // SAFETY: as above.
        array.in_stream(|stream| unsafe {
            result::memcpy_dtod_async(array.address, address, bytes, stream)
        })
    }
}

/// Address of a buffer when all work that was queued is done, if it is on the device that has `array`.
fn address<E, F>(
    device: &Device<Cuda>,
    buffer: &Buffer<E>,
    array: &DeviceArray<F>,
) -> Result<u64, Error> {
    let resource = device.client.get_resource(buffer.handle());
    let address = resource.map_err(|e| device.failed(&e))?.resource().ptr;
    device.wait()?;
    let of = |address| ordinal(address).map_err(|e| device.failed(&e));
    match array.len == 0 || of(address)? == of(array.address)? {
        true => Ok(address),
        false => Err(elsewhere(device)),
    }
}
