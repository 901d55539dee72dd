//! Whether the CUDA libraries are here.
//!
//! Unsafe because loading a library runs its initializers; those of the NVIDIA driver and of NVRTC are made
//! for it, and what was loaded is let go again.
#![allow(unsafe_code)]

/// The first library that CUDA needs and the loader does not find.
pub(super) fn missing() -> Option<&'static str> {
    // SAFETY: see the head of this file.
    let (driver, compiler) = unsafe {
        (
            cudarc::driver::sys::is_culib_present(),
            cudarc::nvrtc::sys::is_culib_present(),
        )
    };
    if !driver {
        Some("libcuda")
    } else if !compiler {
        Some("libnvrtc")
    } else {
        None
    }
}
