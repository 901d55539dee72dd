//! One call for a kernel.

/// Queues a kernel with a unit for each of `units` items, in groups of `block`:
/// `launch!(device, kernel::<T>, units, block, arguments…)`.
macro_rules! launch {
    ($device:expr, $kernel:ident $(::<$($number:ty),+>)?, $units:expr, $block:expr $(, $argument:expr)* $(,)?) => {
        $kernel::launch::<$($($number,)+)? _>(
            $device.client(),
            $device.groups($units, $block),
            cubecl::prelude::CubeDim::new_1d($block),
            $($argument),*
        )
    };
}

pub(crate) use launch;
