//! A device that runs nothing: every kernel that is launched on it becomes CUDA C++, which is kept.
//!
//! Reading gives zeros, or what [`answer`] said beforehand: host code that asks for a count goes on with
//! that.
//!
//! Unsafe only in the signature of `launch`, which CubeCL asks for: nothing is launched.
#![allow(unsafe_code)]

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, OnceLock};

use cubecl::bytes::Bytes;
use cubecl::device::{Device, DeviceId, DeviceService};
use cubecl::future::DynFut;
use cubecl::ir::{DeviceProperties, HardwareProperties, MemoryDeviceProperties, TargetProperties};
use cubecl::prelude::*;
use cubecl::profile::{ProfileDuration, TimingMethod};
use cubecl::server::{
    Binding, ComputeServer, CopyDescriptor, KernelArguments, ProfileError, ProfilingToken,
    ServerCommunication, ServerError, ServerUtilities,
};
use cubecl::stream_id::StreamId;
use cubecl::zspace::{Shape, Strides};
use cubecl::{CubeTask, MemoryUsage};
use cubecl_cpp::cuda::{CudaDialect, mma::CudaWmmaCompiler};
use cubecl_cpp::shared::{CompilationOptions, CppCompiler};
use cubecl_runtime::allocator::ContiguousMemoryLayoutPolicy;
use cubecl_runtime::logging::ServerLogger;
use cubecl_runtime::memory_management::{ManagedMemoryHandle, MemoryAllocationMode};
use cubecl_runtime::storage::{BytesStorage, ManagedResource};

type Compiler = CppCompiler<CudaDialect<CudaWmmaCompiler>>;

static SOURCES: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());
static ANSWERS: Mutex<VecDeque<Vec<u8>>> = Mutex::new(VecDeque::new());

/// Sets the results of the next reads, in their order.
pub fn answer(values: &[&[u32]]) {
    let mut answers = ANSWERS.lock().unwrap();
    answers.extend(values.iter().map(|v| u32::as_bytes(v).to_vec()));
}

/// Forgets answers that nobody asked for.
pub fn forget_answers() {
    ANSWERS.lock().unwrap().clear();
}

/// The source of every kernel that was launched, by its name and number type.
pub fn sources() -> BTreeMap<String, String> {
    SOURCES.lock().unwrap().clone()
}

/// Kernels for NVIDIA devices that are not here.
#[derive(Clone, Debug)]
pub struct Recorder;

/// The one device of [`Recorder`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Paper;

impl Device for Paper {
    fn from_id(_: DeviceId) -> Self {
        Self
    }

    fn to_id(&self) -> DeviceId {
        DeviceId::new(0, 0)
    }
}

impl Runtime for Recorder {
    type Compiler = Compiler;
    type Server = Server;
    type Device = Paper;

    fn client(device: &Paper) -> ComputeClient<Self> {
        ComputeClient::load(device)
    }

    fn name(_: &ComputeClient<Self>) -> &'static str {
        "CUDA C++, not run"
    }

    fn require_array_lengths() -> bool {
        true
    }

    fn max_cube_count() -> (u32, u32, u32) {
        (i32::MAX as u32, 65_535, 65_535)
    }

    fn can_read_tensor(_: &Shape, _: &Strides) -> bool {
        true
    }

    fn target_properties() -> TargetProperties {
        TargetProperties::default()
    }

    fn enumerate_devices(_: u16, _: &()) -> Vec<DeviceId> {
        vec![DeviceId::new(0, 0)]
    }
}

/// Keeps the source of kernels, and no data.
#[derive(Debug)]
pub struct Server {
    utilities: Arc<ServerUtilities<Self>>,
}

impl DeviceService for Server {
    fn init(_: DeviceId) -> Self {
        static UTILITIES: OnceLock<Arc<ServerUtilities<Server>>> = OnceLock::new();
        let utilities = UTILITIES.get_or_init(|| Arc::new(utilities())).clone();
        Self { utilities }
    }

    fn utilities(&self) -> Arc<dyn std::any::Any + Send + Sync> {
        self.utilities.clone()
    }
}

/// The limits of an H100.
fn utilities() -> ServerUtilities<Server> {
    let memory = MemoryDeviceProperties {
        max_page_size: 20 << 30,
        alignment: 512,
    };
    let hardware = HardwareProperties {
        load_width: 128,
        plane_size_min: 32,
        plane_size_max: 32,
        max_bindings: 64,
        max_shared_memory_size: 227 << 10,
        max_cube_count: Recorder::max_cube_count(),
        max_units_per_cube: 1024,
        max_cube_dim: (1024, 1024, 64),
        num_streaming_multiprocessors: Some(132),
        num_tensor_cores: Some(4),
        min_tensor_cores_dim: Some(8),
        num_cpu_cores: None,
        max_vector_size: 4,
    };
    let mut properties =
        DeviceProperties::new(Default::default(), memory, hardware, TimingMethod::System);
    cubecl_cpp::register_supported_types(&mut properties);
    ServerUtilities::new(
        properties,
        Arc::new(ServerLogger::default()),
        (),
        ContiguousMemoryLayoutPolicy::new(512),
    )
}

impl ServerCommunication for Server {
    const SERVER_COMM_ENABLED: bool = false;
}

impl ComputeServer for Server {
    type Kernel = Box<dyn CubeTask<Compiler>>;
    type Info = ();
    type MemoryLayoutPolicy = ContiguousMemoryLayoutPolicy;
    type Storage = BytesStorage;

    fn initialize_memory(&mut self, _: ManagedMemoryHandle, _: u64, _: StreamId) {}

    fn logger(&self) -> Arc<ServerLogger> {
        self.utilities.logger.clone()
    }

    fn utilities(&self) -> Arc<ServerUtilities<Self>> {
        self.utilities.clone()
    }

    fn read(
        &mut self,
        descriptors: Vec<CopyDescriptor>,
        _: StreamId,
    ) -> DynFut<Result<Vec<Bytes>, ServerError>> {
        let mut answers = ANSWERS.lock().unwrap();
        let read = |d: CopyDescriptor| {
            let size = d.shape.iter().product::<usize>() * d.elem_size;
            let mut bytes = answers.pop_front().unwrap_or_default();
            bytes.resize(size, 0);
            Bytes::from_bytes_vec(bytes)
        };
        let bytes = descriptors.into_iter().map(read).collect();
        Box::pin(async move { Ok(bytes) })
    }

    fn write(&mut self, _: Vec<(CopyDescriptor, Bytes)>, _: StreamId) {}

    fn sync(&mut self, _: StreamId) -> DynFut<Result<(), ServerError>> {
        Box::pin(async { Ok(()) })
    }

    fn get_resource(
        &mut self,
        _: Binding,
        _: StreamId,
    ) -> Result<ManagedResource<cubecl_runtime::storage::BytesResource>, ServerError> {
        unimplemented!("no data here")
    }

    unsafe fn launch(
        &mut self,
        kernel: Self::Kernel,
        _: CubeCount,
        _: KernelArguments,
        mode: ExecutionMode,
        _: StreamId,
    ) {
        let options = CompilationOptions {
            warp_size: 32,
            ..Default::default()
        };
        let compiled = kernel
            .compile(
                &mut Compiler::default(),
                &options,
                mode,
                kernel.address_type(),
            )
            .unwrap_or_else(|e| panic!("{}: {e}", kernel.name()));
        let name = format!("{} {:?}", kernel.name(), kernel.id());
        SOURCES.lock().unwrap().insert(name, compiled.source);
    }

    fn flush(&mut self, _: StreamId) -> Result<(), ServerError> {
        Ok(())
    }

    fn memory_usage(&mut self, _: StreamId) -> Result<MemoryUsage, ServerError> {
        unimplemented!("no data here")
    }

    fn memory_cleanup(&mut self, _: StreamId) {}

    fn start_profile(&mut self, _: StreamId) -> Result<ProfilingToken, ServerError> {
        unimplemented!("nothing runs here")
    }

    fn end_profile(
        &mut self,
        _: StreamId,
        _: ProfilingToken,
    ) -> Result<ProfileDuration, ProfileError> {
        unimplemented!("nothing runs here")
    }

    fn allocation_mode(&mut self, _: MemoryAllocationMode, _: StreamId) {}
}
