//! Memory on a device.
//!
//! Unsafe because a kernel is handed an array as a handle and a length, and only whoever
//! made the handle knows that the length is right. Here both are set together, once.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use cubecl::prelude::*;
use cubecl::server::Handle;

/// An array of elements on a device. Clones share its memory, as with `Arc`.
#[derive(Clone, Debug)]
pub struct Buffer<E> {
    handle: Handle,
    len: usize,
    elements: PhantomData<E>,
}

impl<E> Buffer<E> {
    /// `len` is the number of elements that were allocated for `handle`.
    pub(super) fn from_handle(handle: Handle, len: usize) -> Self {
        Self {
            handle,
            len,
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

    pub(super) fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// The array as an argument of a kernel.
    pub(crate) fn arg<R: Runtime>(&self) -> ArrayArg<R> {
        // SAFETY: the length is that of the allocation, at least one element of which exists.
        unsafe { ArrayArg::from_raw_parts(self.handle.clone(), self.len.max(1)) }
    }
}
