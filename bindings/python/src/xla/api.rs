//! XLA's C interface for custom calls, as `xla/ffi/api/c_api.h` lays it out: only what is used, in its names
//! without the prefix `XLA_FFI_`.
//!
//! This is the one place of the package with `unsafe` code, for XLA calls functions of the C ABI with pointers to
//! C structures. A [`CallFrame`] is trusted to be what its header says: every pointer valid for the duration of the
//! call, buffers dense and in C order, results not shared with anything. What can be checked (type, alignment,
//! number of dimensions, text encoding) is, before a slice is made.
#![allow(unsafe_code)]

mod layout;

use std::ffi::{CString, c_int, c_void};
use std::mem::offset_of;
use std::ptr;

#[cfg(feature = "cuda")]
use isograd_backend::DeviceArray;
use pyo3::prelude::*;

use super::Target;
use super::buffers::{Array, Batch, Data, DataMut};
#[cfg(feature = "cuda")]
use super::cuda::Pointer;
use crate::backend::Failure;
use crate::background::guard;
pub use layout::CallFrame;
use layout::*;

/// Return value of a handler: null, or an error that belongs to XLA.
pub type Status = *mut c_void;

/// A function that XLA calls.
pub type Handler = unsafe extern "C" fn(*mut CallFrame) -> Status;

/// Handles a call of XLA: a query for the version, or a call of the target. A panic becomes an error.
///
/// # Safety
/// `frame` is what XLA passes to a handler.
pub unsafe extern "C" fn handler<W: Target>(frame: *mut CallFrame) -> Status {
    // SAFETY: the caller's promise; the frame and all it points to outlive this call.
    unsafe { (*frame).handle(|frame| W::run_batch(frame.batch(Place::Host)?)) }
}

/// [`handler`] of calls with arrays on a CUDA device.
///
/// # Safety
/// As for [`handler`].
#[cfg(feature = "cuda")]
pub unsafe extern "C" fn handler_on_cuda<W: Target>(frame: *mut CallFrame) -> Status {
    // SAFETY: as for `handler`.
    unsafe {
        (*frame).handle(|frame| {
            let stream = frame.stream()?;
            W::run_on_cuda(frame.batch(Place::Cuda(stream))?)
        })
    }
}

/// Memory that the arrays of a call are in.
#[derive(Clone, Copy)]
enum Place {
    Host,
    /// Of a CUDA device, with the stream of the call.
    #[cfg(feature = "cuda")]
    Cuda(usize),
}

impl CallFrame {
    /// Answers a query for the version, or does the work.
    unsafe fn handle(&self, work: impl FnOnce(&Self) -> Result<(), Failure>) -> Status {
        // SAFETY: the frame and all it points to are XLA's, and outlive this call.
        if let Some(metadata) = unsafe { self.metadata() } {
            return unsafe { self.write_version(metadata) };
        }
        if self.stage != STAGE_EXECUTE {
            return self.error(INTERNAL, "isograd's handlers can only be executed");
        }
        match guard(|| work(self)) {
            Ok(Ok(())) => ptr::null_mut(),
            Ok(Err(Failure::Value(text))) => self.error(INVALID_ARGUMENT, &text),
            Ok(Err(Failure::Device(text))) => self.error(INTERNAL, &text),
            Err(defect) => self.error(INTERNAL, &defect),
        }
    }

    /// The CUDA stream of the call.
    #[cfg(feature = "cuda")]
    unsafe fn stream(&self) -> Result<usize, String> {
        let mut args = StreamGet {
            struct_size: size_of::<StreamGet>(),
            extension: ptr::null_mut(),
            context: self.context,
            stream: ptr::null_mut(),
        };
        // SAFETY: XLA's function with its own structure.
        match unsafe { ((*self.api).stream_get)(&mut args) }.is_null() {
            true => Ok(args.stream as usize),
            false => Err("XLA has no stream for this call".into()),
        }
    }

    /// The structure for the version, if XLA queries it.
    unsafe fn metadata(&self) -> Option<*mut Metadata> {
        let mut extension = self.extension;
        // SAFETY: a list that XLA made, each entry with the header of `Extension`.
        while let Some(found) = unsafe { extension.as_ref() } {
            if found.kind == EXTENSION_METADATA {
                let found: *const MetadataExtension = extension.cast();
                return Some(unsafe { (*found).metadata });
            }
            extension = found.next;
        }
        None
    }

    unsafe fn write_version(&self, metadata: *mut Metadata) -> Status {
        // SAFETY: XLA's own structure, of at least these fields; the runtime's version may be left out.
        unsafe {
            let theirs = self.api.as_ref().map_or(MINOR, |api| api.version.minor);
            (*metadata).version.major = MAJOR;
            (*metadata).version.minor = MINOR.min(theirs);
            (*metadata).traits = 0;
        }
        ptr::null_mut()
    }

    fn error(&self, code: c_int, text: &str) -> Status {
        let message = CString::new(text.replace('\0', " ")).unwrap_or_default();
        let mut args = ErrorCreate {
            struct_size: offset_of!(ErrorCreate, code) + size_of::<c_int>(),
            extension: ptr::null_mut(),
            message: message.as_ptr(),
            code,
        };
        // SAFETY: XLA's function with its own structure; it copies the text.
        unsafe { ((*self.api).error_create)(&mut args) }
    }

    unsafe fn batch(&self, place: Place) -> Result<Batch<'_>, String> {
        // SAFETY: the frame's arrays are as long as it says, and its results are borrowed nowhere else.
        unsafe {
            let inputs = self.arguments.iter().map(|buffer| (*buffer?).input(place));
            let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
            let outputs = self.results.iter().map(|buffer| (*buffer?).output(place));
            let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
            let settings = self.attributes.find("settings", STRING);
            let settings = settings.ok_or("the attribute 'settings' is missing")?;
            let band = match self.attributes.find("band", SCALAR) {
                Some(scalar) => Some((*scalar.cast::<Scalar>()).f64()?),
                None => None,
            };
            let settings = (*settings.cast::<ByteSpan>()).text()?;
            Ok(Batch {
                settings,
                band,
                inside: self.attributes.find("inside", SCALAR).is_some(),
                inputs,
                outputs,
            })
        }
    }
}

impl Buffers {
    unsafe fn iter(&self) -> impl Iterator<Item = Result<*const Buffer, String>> {
        // SAFETY: both arrays have `size` entries.
        (0..self.size.max(0) as usize).map(|i| unsafe {
            match *self.types.add(i) {
                BUFFER => Ok((*self.values.add(i)).cast_const().cast::<Buffer>()),
                kind => Err(format!("argument {i} is no array but of kind {kind}")),
            }
        })
    }
}

impl Buffer {
    unsafe fn input<'a>(&self, place: Place) -> Result<Array<Data<'a>>, String> {
        // SAFETY: `data` has as many entries as the dimensions say.
        let data = unsafe {
            match place {
                Place::Host => match self.dtype {
                    F32 => Data::F32(self.slice()?),
                    F64 => Data::F64(self.slice()?),
                    U32 => Data::U32(self.slice()?),
                    other => return Err(unknown(other)),
                },
                #[cfg(feature = "cuda")]
                Place::Cuda(stream) => Data::OnDevice(self.pointer(stream)?),
            }
        };
        Ok(Array {
            dims: unsafe { self.dims() },
            data,
        })
    }

    unsafe fn output<'a>(&self, place: Place) -> Result<Array<DataMut<'a>>, String> {
        // SAFETY: as for the inputs, and a result is given to nobody else during the call.
        let data = unsafe {
            match place {
                Place::Host => match self.dtype {
                    F32 => DataMut::F32(self.slice_mut()?),
                    F64 => DataMut::F64(self.slice_mut()?),
                    U32 => DataMut::U32(self.slice_mut()?),
                    other => return Err(unknown(other)),
                },
                #[cfg(feature = "cuda")]
                Place::Cuda(stream) => DataMut::OnDevice(self.pointer(stream)?),
            }
        };
        Ok(Array {
            dims: unsafe { self.dims() },
            data,
        })
    }

    /// The array, on a CUDA device.
    #[cfg(feature = "cuda")]
    unsafe fn pointer(&self, stream: usize) -> Result<Pointer, String> {
        let kind = match self.dtype {
            F32 => "float32",
            F64 => "float64",
            U32 => "uint32",
            other => return Err(unknown(other)),
        };
        // SAFETY: XLA's own dimensions.
        let dims = unsafe { self.dims() };
        let pointer = pointer(self.data as u64, &dims, kind, stream);
        pointer.ok_or_else(|| unknown(self.dtype))
    }

    unsafe fn dims(&self) -> Vec<usize> {
        let axes = 0..self.rank.max(0) as usize;
        // SAFETY: `dims` has `rank` entries.
        axes.map(|a| unsafe { (*self.dims.add(a)).max(0) as usize })
            .collect()
    }

    unsafe fn slice<'a, E>(&self) -> Result<&'a [E], String> {
        let length = unsafe { self.dims() }.iter().product::<usize>();
        if length == 0 {
            return Ok(&[]);
        }
        // SAFETY: dense, of that length, aligned, and not written during the call.
        Ok(unsafe { std::slice::from_raw_parts(self.aligned::<E>()?, length) })
    }

    unsafe fn slice_mut<'a, E>(&self) -> Result<&'a mut [E], String> {
        let length = unsafe { self.dims() }.iter().product::<usize>();
        if length == 0 {
            return Ok(&mut []);
        }
        // SAFETY: dense, of that length, aligned, and nobody else's during the call.
        Ok(unsafe { std::slice::from_raw_parts_mut(self.aligned::<E>()?, length) })
    }

    fn aligned<E>(&self) -> Result<*mut E, String> {
        let data = self.data.cast::<E>();
        match !data.is_null() && data.is_aligned() {
            true => Ok(data),
            false => Err("XLA passed an array that is not aligned".into()),
        }
    }
}

impl Attributes {
    /// The value of the attribute of that name and kind.
    unsafe fn find(&self, name: &str, kind: c_int) -> Option<*const c_void> {
        let mut places = 0..self.size.max(0) as usize;
        // SAFETY: all three arrays have `size` entries.
        unsafe {
            let place = places.find(|&i| {
                *self.types.add(i) == kind && (**self.names.add(i)).text() == Ok(name)
            })?;
            Some(*self.values.add(place))
        }
    }
}

impl ByteSpan {
    unsafe fn text<'a>(&self) -> Result<&'a str, String> {
        if self.length == 0 {
            return Ok("");
        }
        // SAFETY: `length` bytes that live as long as the call.
        let bytes = unsafe { std::slice::from_raw_parts(self.start.cast::<u8>(), self.length) };
        std::str::from_utf8(bytes).map_err(|error| format!("an attribute is no text: {error}"))
    }
}

impl Scalar {
    unsafe fn f64(&self) -> Result<f64, String> {
        match self.dtype {
            // SAFETY: the type says what the value is.
            F64 => Ok(unsafe { self.value.cast::<f64>().read_unaligned() }),
            other => Err(unknown(other)),
        }
    }
}

fn unknown(dtype: c_int) -> String {
    format!("XLA passed an array or number of its type {dtype}; give float32 or float64")
}

/// An array on a CUDA device, whose caller promises what [`DeviceArray::new`] asks for; `None` for another type.
#[cfg(feature = "cuda")]
pub fn pointer(address: u64, dims: &[usize], kind: &str, stream: usize) -> Option<Pointer> {
    let length = dims.iter().product();
    // SAFETY: what XLA and PyTorch say of their arrays during a call.
    unsafe {
        match kind {
            "float32" => Some(Pointer::F32(DeviceArray::new(address, length, stream))),
            "float64" => Some(Pointer::F64(DeviceArray::new(address, length, stream))),
            "uint32" => Some(Pointer::U32(DeviceArray::new(address, length, stream))),
            _ => None,
        }
    }
}

/// A handler as `jax.ffi.register_ffi_target` takes it: an unnamed capsule that holds the function itself.
pub fn capsule(py: Python<'_>, handler: Handler) -> PyResult<Bound<'_, PyAny>> {
    // SAFETY: a function is valid for ever, and the capsule owns nothing.
    unsafe {
        let capsule = pyo3::ffi::PyCapsule_New(handler as *mut c_void, ptr::null(), None);
        Bound::from_owned_ptr_or_err(py, capsule)
    }
}
