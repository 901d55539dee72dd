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

    /// The open device, as its driver describes it.
    struct Opened {
        name: String,
        /// It computes on the CPU.
        is_software: bool,
    }

    impl Device<Vulkan> {
        /// The fastest Vulkan device.
        pub fn vulkan() -> Result<Self, Error> {
            let name = opened()?.name.clone();
            let client = WgpuRuntime::client(&WgpuDevice::DefaultDevice);
            Ok(Self::new(client, name))
        }

        /// [`Self::vulkan`], but only on a GPU: a driver that computes on the CPU is slower than the CPU's own code.
        pub fn vulkan_gpu() -> Result<Self, Error> {
            let opened = opened()?;
            if opened.is_software {
                return Err(Error::NoDevice {
                    backend: "Vulkan",
                    reason: format!("the only one, {}, computes on the CPU", opened.name),
                    remedy: "install the driver of the GPU",
                });
            }
            Self::vulkan()
        }
    }

    /// One device for the process: CubeCL keeps its own, and opening twice would leak the first.
    fn opened() -> Result<&'static Opened, Error> {
        static OPENED: std::sync::OnceLock<Option<Opened>> = std::sync::OnceLock::new();
        let opened = OPENED.get_or_init(open).as_ref();
        opened.ok_or_else(|| Error::NoDevice {
            backend: "Vulkan",
            reason: "the loader lists none".into(),
            remedy: REMEDY,
        })
    }

    /// Opens the default device, if there is one.
    fn open() -> Option<Opened> {
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
        let info = setup.adapter.get_info();
        Some(Opened {
            is_software: info.device_type == wgpu::DeviceType::Cpu,
            name: info.name,
        })
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
