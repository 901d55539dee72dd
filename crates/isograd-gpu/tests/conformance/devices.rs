//! The devices that are here.

/// Runs a function that is generic over the runtime on every device that is here:
/// `on_each_device!(function)` calls `function(&device)`, and prints which devices are not here.
macro_rules! on_each_device {
    ($function:path) => {{
        #[cfg(feature = "wgpu")]
        match isograd_gpu::Device::vulkan() {
            Ok(device) => $function(&device),
            Err(reason) => println!("SKIPPED on Vulkan: {reason}"),
        }
        #[cfg(feature = "cuda")]
        match isograd_gpu::Device::cuda(0) {
            Ok(device) => $function(&device),
            Err(reason) => println!("SKIPPED on CUDA: {reason}"),
        }
    }};
}

pub(crate) use on_each_device;

/// Numbers that look random, the same every time: splitmix64.
pub struct Numbers(pub u64);

impl Numbers {
    /// The next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 32) as u32
    }

    /// Between 0 and 1.
    pub fn unit(&mut self) -> f64 {
        f64::from(self.bits()) / 4_294_967_296.0
    }

    /// Between −1 and 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }
}

/// Runs a function that is generic over the number type in single precision, to 1e-4, and where the device has
/// it in double, to 1e-10: `in_both_numbers!(device, function)` calls `function::<R, T>(device, tolerance)`.
macro_rules! in_both_numbers {
    ($device:expr, $function:ident) => {{
        $function::<R, f32>($device, $crate::devices::tolerance::<f32>());
        match $device.check_number::<f64>() {
            Ok(()) => $function::<R, f64>($device, $crate::devices::tolerance::<f64>()),
            Err(reason) => println!("SKIPPED in f64: {reason}"),
        }
    }};
}

pub(crate) use in_both_numbers;

/// Runs a check that is generic over the number type in single precision, and where the device has it in
/// double: `in_each_number!(device, check)` calls `check::<R, T>(device)`; without a device, on all of them.
macro_rules! in_each_number {
    ($check:ident) => {{
        fn run<R: cubecl::prelude::Runtime>(device: &isograd_gpu::Device<R>) {
            $crate::devices::in_each_number!(device, $check);
        }
        $crate::devices::on_each_device!(run);
    }};
    ($device:expr, $check:ident) => {{
        $check::<_, f32>($device);
        match $device.check_number::<f64>() {
            Ok(()) => $check::<_, f64>($device),
            Err(reason) => println!("SKIPPED in f64: {reason}"),
        }
    }};
}

pub(crate) use in_each_number;

/// What a stage may differ by from the CPU.
pub fn tolerance<T: isograd::Real>() -> f64 {
    if T::NAME == "f32" { 1e-4 } else { 1e-10 }
}
