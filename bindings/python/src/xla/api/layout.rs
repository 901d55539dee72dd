//! Structures and constants of the interface.

use std::ffi::{c_char, c_int, c_void};

use super::Status;

/// The oldest version with everything used here; a newer runtime takes it, too.
pub(super) const MAJOR: c_int = 0;
pub(super) const MINOR: c_int = 1;

pub(super) const EXTENSION_METADATA: c_int = 1;
pub(super) const STAGE_EXECUTE: c_int = 3;
pub(super) const BUFFER: c_int = 1;
pub(super) const SCALAR: c_int = 3;
pub(super) const STRING: c_int = 4;
pub(super) const U32: c_int = 8;
pub(super) const F32: c_int = 11;
pub(super) const F64: c_int = 12;
pub(super) const INVALID_ARGUMENT: c_int = 3;
pub(super) const INTERNAL: c_int = 13;

#[repr(C)]
pub(super) struct Extension {
    pub(super) struct_size: usize,
    pub(super) kind: c_int,
    pub(super) next: *mut Extension,
}

#[repr(C)]
pub(super) struct ApiVersion {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) major: c_int,
    pub(super) minor: c_int,
}

#[repr(C)]
pub(super) struct Metadata {
    pub(super) struct_size: usize,
    pub(super) version: ApiVersion,
    pub(super) traits: u32,
}

#[repr(C)]
pub(super) struct MetadataExtension {
    pub(super) base: Extension,
    pub(super) metadata: *mut Metadata,
}

#[repr(C)]
pub(super) struct Buffer {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) dtype: c_int,
    pub(super) data: *mut c_void,
    pub(super) rank: i64,
    pub(super) dims: *const i64,
}

#[repr(C)]
pub(super) struct ByteSpan {
    pub(super) start: *const c_char,
    pub(super) length: usize,
}

#[repr(C)]
pub(super) struct Scalar {
    pub(super) dtype: c_int,
    pub(super) value: *const c_void,
}

/// Arguments, or results.
#[repr(C)]
pub(super) struct Buffers {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) size: i64,
    pub(super) types: *const c_int,
    pub(super) values: *const *mut c_void,
}

#[repr(C)]
pub(super) struct Attributes {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) size: i64,
    pub(super) types: *const c_int,
    pub(super) names: *const *const ByteSpan,
    pub(super) values: *const *const c_void,
}

/// Argument of a handler.
#[repr(C)]
pub struct CallFrame {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) api: *const Api,
    pub(super) context: *mut c_void,
    pub(super) stage: c_int,
    pub(super) arguments: Buffers,
    pub(super) results: Buffers,
    pub(super) attributes: Attributes,
}

#[repr(C)]
pub(super) struct ErrorCreate {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) message: *const c_char,
    pub(super) code: c_int,
}

/// Table of XLA's functions, up to the one that is called here.
#[repr(C)]
pub(super) struct Api {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) version: ApiVersion,
    pub(super) internal: *const c_void,
    pub(super) error_create: unsafe extern "C" fn(*mut ErrorCreate) -> Status,
    #[cfg(feature = "cuda")]
    pub(super) others: [*const c_void; 3],
    #[cfg(feature = "cuda")]
    pub(super) stream_get: unsafe extern "C" fn(*mut StreamGet) -> Status,
}

#[cfg(feature = "cuda")]
#[repr(C)]
pub(super) struct StreamGet {
    pub(super) struct_size: usize,
    pub(super) extension: *mut Extension,
    pub(super) context: *mut c_void,
    pub(super) stream: *mut c_void,
}
