//! Devices are looked for before CubeCL is made to open one: it panics where there is none.

use super::{Device, Error};

#[cfg(feature = "wgpu")]
pub use vulkan::Vulkan;

#[cfg(feature = "cuda")]
pub use cuda::Cuda;

#[cfg(feature = "wgpu")]
mod vulkan {
    use cubecl::prelude::*;
    use cubecl::wgpu::{RuntimeOptions, WgpuDevice, WgpuRuntime, init_setup};

    use super::{Device, Error};

    /// Kernels as WGSL, through Vulkan.
    pub type Vulkan = WgpuRuntime;

    const REMEDY: &str = "install a Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1 has one that needs no GPU)";

    impl Device<Vulkan> {
        /// The fastest Vulkan device.
        ///
        /// # Errors
        /// [`Error::NoDevice`].
        pub fn vulkan() -> Result<Self, Error> {
            // One device for the process: CubeCL keeps its own, and opening twice would leak the first.
            static NAME: std::sync::OnceLock<Option<String>> = std::sync::OnceLock::new();
            let name = NAME.get_or_init(open).clone();
            let name = name.ok_or_else(|| Error::NoDevice {
                backend: "Vulkan",
                reason: "the loader lists none".into(),
                remedy: REMEDY,
            })?;
            let client = WgpuRuntime::client(&WgpuDevice::DefaultDevice);
            Ok(Self::new(client, name))
        }
    }

    /// Opens the default device; its name, if there is one.
    fn open() -> Option<String> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapters =
            cubecl::future::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        if adapters.is_empty() {
            return None;
        }
        let setup = init_setup::<cubecl::wgpu::Vulkan>(
            &WgpuDevice::DefaultDevice,
            RuntimeOptions::default(),
        );
        Some(setup.adapter.get_info().name)
    }
}

#[cfg(feature = "cuda")]
mod cuda {
    use cubecl::cuda::{CudaDevice, CudaRuntime};
    use cubecl::prelude::*;
    use cudarc::driver::result;

    use super::super::libraries;
    use super::{Device, Error};

    /// Kernels as CUDA C++, compiled by NVRTC.
    pub type Cuda = CudaRuntime;

    const REMEDY: &str = "install the NVIDIA driver and NVRTC of CUDA 12 where the loader finds them (LD_LIBRARY_PATH)";

    impl Device<Cuda> {
        /// The CUDA device of this number. The CUDA libraries are loaded here, and nowhere before.
        ///
        /// # Errors
        /// [`Error::NoDevice`].
        pub fn cuda(index: usize) -> Result<Self, Error> {
            let name = name(index).map_err(|reason| Error::NoDevice {
                backend: "CUDA",
                reason,
                remedy: REMEDY,
            })?;
            let client = CudaRuntime::client(&CudaDevice::new(index));
            Ok(Self::new(client, name).with_f64())
        }
    }

    /// The name of the device, or why there is none.
    fn name(index: usize) -> Result<String, String> {
        if let Some(library) = libraries::missing() {
            return Err(format!("the library {library} is not here"));
        }
        let say = |e: cudarc::driver::DriverError| format!("the driver says: {e}");
        result::init().map_err(say)?;
        let count = result::device::get_count().map_err(say)?;
        let index = i32::try_from(index).unwrap_or(i32::MAX);
        if index >= count {
            return Err(format!(
                "there are {count}, and number {index} was asked for"
            ));
        }
        let device = result::device::get(index).map_err(say)?;
        result::device::get_name(device).map_err(say)
    }
}
