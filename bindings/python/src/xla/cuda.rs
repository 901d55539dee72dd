//! Arrays on a CUDA device: those of XLA on such a device, and tensors of PyTorch.
//!
//! A target copies them to the host's memory and its results back, unless it keeps the large ones where they are.

use isograd_backend::DeviceArray;

use super::buffers::{Array, Batch, Call, Data, DataMut};
use super::common::Float;
use crate::backend::Failure;
use crate::settings::Settings;

/// Values of an input or an output.
#[derive(Clone, Copy)]
pub enum Pointer {
    /// `float32`
    F32(DeviceArray<f32>),
    /// `float64`
    F64(DeviceArray<f64>),
    /// `uint32`
    U32(DeviceArray<u32>),
}

/// A copy in the host's memory.
enum Copied {
    F32(Vec<f32>),
    F64(Vec<f64>),
    U32(Vec<u32>),
}

impl Pointer {
    /// Part `k` of `count` equal parts.
    pub fn part(&self, k: usize, count: usize) -> Self {
        match self {
            Self::F32(all) => Self::F32(all.part(k, count)),
            Self::F64(all) => Self::F64(all.part(k, count)),
            Self::U32(all) => Self::U32(all.part(k, count)),
        }
    }

    fn download(&self) -> Result<Copied, Failure> {
        Ok(match self {
            Self::F32(all) => Copied::F32(all.download().map_err(failure)?),
            Self::F64(all) => Copied::F64(all.download().map_err(failure)?),
            Self::U32(all) => Copied::U32(all.download().map_err(failure)?),
        })
    }

    fn zeros(&self) -> Copied {
        match self {
            Self::F32(all) => Copied::F32(vec![0.0; all.len()]),
            Self::F64(all) => Copied::F64(vec![0.0; all.len()]),
            Self::U32(all) => Copied::U32(vec![0; all.len()]),
        }
    }

    fn upload(&self, values: &Copied) -> Result<(), Failure> {
        let done = match (self, values) {
            (Self::F32(all), Copied::F32(values)) => all.upload(values),
            (Self::F64(all), Copied::F64(values)) => all.upload(values),
            (Self::U32(all), Copied::U32(values)) => all.upload(values),
            _ => return Err("an output is of another type".into()),
        };
        done.map_err(failure)
    }
}

impl Copied {
    fn input(&self) -> Data<'_> {
        match self {
            Self::F32(values) => Data::F32(values),
            Self::F64(values) => Data::F64(values),
            Self::U32(values) => Data::U32(values),
        }
    }

    fn output(&mut self) -> DataMut<'_> {
        match self {
            Self::F32(values) => DataMut::F32(values),
            Self::F64(values) => DataMut::F64(values),
            Self::U32(values) => DataMut::U32(values),
        }
    }
}

/// Checks that the plan computes on a CUDA device, as the arrays are on one.
///
/// # Errors
/// Another backend.
pub fn check_backend(settings: &str) -> Result<(), Failure> {
    let backend = Settings::parse(settings)?.backend;
    match backend {
        isograd::Backend::Cuda(_) => Ok(()),
        other => Err(Failure::Value(format!(
            "the arrays are on a CUDA device and backend is \"{other}\": pass backend=\"cuda\" or arrays of the CPU; for JAX, ISOGRAD_JAX_CALLBACK=1 in the environment has them copied"
        ))),
    }
}

/// Runs a target on copies of all arrays in the host's memory.
///
/// # Errors
/// Errors of the target and of the device.
pub fn by_copies(
    batch: Batch<'_>,
    run: impl FnOnce(Batch<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let Batch {
        settings,
        band,
        inside,
        inputs,
        outputs,
    } = batch;
    let inputs = inputs.into_iter().map(|Array { dims, data }| match data {
        Data::OnDevice(pointer) => Ok((dims, pointer.download()?)),
        _ => Err(on_host()),
    });
    let outputs = outputs.into_iter().map(|Array { dims, data }| match data {
        DataMut::OnDevice(pointer) => Ok((dims, pointer, pointer.zeros())),
        _ => Err(on_host()),
    });
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let mut outputs = outputs.collect::<Result<Vec<_>, _>>()?;
    let of_inputs = inputs.iter().map(|(dims, copy)| Array {
        dims: dims.clone(),
        data: copy.input(),
    });
    let of_outputs = outputs.iter_mut().map(|(dims, _, copy)| Array {
        dims: dims.clone(),
        data: copy.output(),
    });
    run(Batch {
        settings,
        band,
        inside,
        inputs: of_inputs.collect(),
        outputs: of_outputs.collect(),
    })?;
    outputs
        .iter()
        .try_for_each(|(_, pointer, copy)| pointer.upload(copy))
}

fn on_host() -> Failure {
    "an array is in the host's memory, and others on a device".into()
}

impl Call<'_> {
    /// A copy of the next input in the host's memory, as `(N, 3)` vectors.
    ///
    /// # Errors
    /// A missing array, or one of another type or shape; errors of the device.
    pub fn vectors_from_device<T: Float>(&mut self, name: &str) -> Result<Vec<[T; 3]>, Failure> {
        let array = self.input_on_device::<T>(name, 2)?;
        let values = array.download().map_err(failure)?;
        match values.len().is_multiple_of(3) {
            true => Ok(values.as_chunks().0.to_vec()),
            false => Err(format!("the array for {name} must end in 3").into()),
        }
    }

    /// A copy of the normals of the cloud: the last input, where one is left.
    ///
    /// # Errors
    /// As [`Self::vectors_from_device`].
    pub fn normals_from_device<T: Float>(&mut self) -> Result<Option<Vec<[T; 3]>>, Failure> {
        match self.inputs_left() {
            0 => Ok(None),
            _ => self.vectors_from_device("the given normals").map(Some),
        }
    }
}

/// An error of the device.
pub fn failure(error: impl std::fmt::Display) -> Failure {
    Failure::Device(error.to_string())
}
