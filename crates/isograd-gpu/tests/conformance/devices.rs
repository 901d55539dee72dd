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

    /// So many of those.
    pub fn list<T: isograd::Real>(&mut self, count: usize) -> Vec<T> {
        (0..count).map(|_| T::of(self.signed())).collect()
    }

    /// So many vectors of those.
    pub fn vectors<T: isograd::Real>(&mut self, count: usize) -> Vec<[T; 3]> {
        self.list(3 * count).as_chunks().0.to_vec()
    }
}

/// Runs a check that is generic over the number type in single precision, and in double on devices that have it:
/// `in_each_number!(check)` calls `check::<R, T>(device)` on every device.
macro_rules! in_each_number {
    ($check:ident) => {{
        fn run<R: cubecl::prelude::Runtime>(device: &isograd_gpu::Device<R>) {
            $check::<_, f32>(device);
            match device.check_number::<f64>() {
                Ok(()) => $check::<_, f64>(device),
                Err(reason) => println!("SKIPPED in f64: {reason}"),
            }
        }
        $crate::devices::on_each_device!(run);
    }};
}

pub(crate) use in_each_number;

/// A test for each function, run by [`on_each_device`] or [`in_each_number`]: `tests! { on_each_device: first, second; }`.
macro_rules! tests {
    ($($runner:ident: $($check:ident),+;)+) => {
        mod on_devices {
            $($(
                #[test]
                fn $check() {
                    use super::$check as check;
                    $crate::devices::$runner!(check);
                }
            )+)+
        }
    };
}

pub(crate) use tests;

/// Lengths, found and expected, that an array was refused for.
pub fn refused_lengths<V>(result: Result<V, isograd_gpu::Error>) -> Option<[usize; 2]> {
    match result.err()? {
        isograd_gpu::Error::Length {
            found, expected, ..
        } => Some([found, expected]),
        _ => None,
    }
}

/// Largest difference of a stage from the CPU.
pub fn tolerance<T: isograd::Real>() -> f64 {
    if T::NAME == "f32" { 1e-4 } else { 1e-10 }
}
