//! One queue for all threads.
//!
//! CubeCL gives every thread a queue of its own, with memory of its own that is kept when the thread has ended: a host
//! that works in a new thread at every call would soon hold all memory of the device. Unsafe because CubeCL says so of
//! the choice of a queue; work of several threads in one is done in the order in which it comes.
#![allow(unsafe_code)]

use cubecl::prelude::*;
use cubecl::stream_id::StreamId;

/// Makes a client queue all its work in one place, whichever thread it comes from.
pub(super) fn share<R: Runtime>(client: &mut ComputeClient<R>) {
    // SAFETY: see the head of this file.
    unsafe { client.set_stream(StreamId { value: 0 }) };
}
