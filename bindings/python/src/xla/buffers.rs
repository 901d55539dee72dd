//! Arrays of a call, as slices with their dimensions. Leading dimensions that all arrays share are a batch.

use std::vec::IntoIter;

#[cfg(feature = "cuda")]
use isograd_backend::DeviceArray;

#[cfg(feature = "cuda")]
use super::cuda::Pointer;
use crate::backend::Failure;

/// Values of an input.
pub enum Data<'a> {
    /// `float32`
    F32(&'a [f32]),
    /// `float64`
    F64(&'a [f64]),
    /// `uint32`
    U32(&'a [u32]),
    /// On a CUDA device.
    #[cfg(feature = "cuda")]
    OnDevice(Pointer),
}

/// Values of an output.
pub enum DataMut<'a> {
    /// `float32`
    F32(&'a mut [f32]),
    /// `float64`
    F64(&'a mut [f64]),
    /// `uint32`
    U32(&'a mut [u32]),
    /// On a CUDA device.
    #[cfg(feature = "cuda")]
    OnDevice(Pointer),
}

/// An array in C order: its dimensions, and as many values as their product.
pub struct Array<D> {
    /// Dimensions, those of the batch first.
    pub dims: Vec<usize>,
    /// Values.
    pub data: D,
}

impl<'a> Data<'a> {
    /// Part `k` of `count` equal parts.
    fn part(&self, k: usize, count: usize) -> Data<'a> {
        fn part<E>(all: &[E], k: usize, count: usize) -> &[E] {
            let size = all.len() / count;
            &all[k * size..][..size]
        }
        match self {
            Self::F32(all) => Data::F32(part(all, k, count)),
            Self::F64(all) => Data::F64(part(all, k, count)),
            Self::U32(all) => Data::U32(part(all, k, count)),
            #[cfg(feature = "cuda")]
            Self::OnDevice(all) => Data::OnDevice(all.part(k, count)),
        }
    }
}

impl DataMut<'_> {
    /// Part `k` of `count` equal parts.
    fn part(&mut self, k: usize, count: usize) -> DataMut<'_> {
        fn part<E>(all: &mut [E], k: usize, count: usize) -> &mut [E] {
            let size = all.len() / count;
            &mut all[k * size..][..size]
        }
        match self {
            Self::F32(all) => DataMut::F32(part(all, k, count)),
            Self::F64(all) => DataMut::F64(part(all, k, count)),
            Self::U32(all) => DataMut::U32(part(all, k, count)),
            #[cfg(feature = "cuda")]
            Self::OnDevice(all) => DataMut::OnDevice(all.part(k, count)),
        }
    }
}

/// Type of the values of an array.
pub trait Element: Copy {
    /// Name in error messages.
    const NAME: &'static str;
    /// The values of an input of this type.
    fn slice<'a>(data: Data<'a>) -> Option<&'a [Self]>;
    /// The values of an output of this type.
    fn slice_mut<'a>(data: DataMut<'a>) -> Option<&'a mut [Self]>;
    /// An array of this type on a device.
    #[cfg(feature = "cuda")]
    fn on_device(pointer: Pointer) -> Option<DeviceArray<Self>>;
}

macro_rules! element {
    ($type:ty, $variant:ident, $name:literal) => {
        impl Element for $type {
            const NAME: &'static str = $name;
            fn slice<'a>(data: Data<'a>) -> Option<&'a [Self]> {
                match data {
                    Data::$variant(values) => Some(values),
                    _ => None,
                }
            }
            fn slice_mut<'a>(data: DataMut<'a>) -> Option<&'a mut [Self]> {
                match data {
                    DataMut::$variant(values) => Some(values),
                    _ => None,
                }
            }
            #[cfg(feature = "cuda")]
            fn on_device(pointer: Pointer) -> Option<DeviceArray<Self>> {
                match pointer {
                    Pointer::$variant(array) => Some(array),
                    _ => None,
                }
            }
        }
    };
}
element!(f32, F32, "float32");
element!(f64, F64, "float64");
element!(u32, U32, "uint32");

/// Arrays and attributes of a call, for all clouds of a batch.
pub struct Batch<'a> {
    /// Grid, options and backend: see [`Settings`](crate::settings::Settings).
    pub settings: &'a str,
    /// Half the width of the band that an attribute is extended to, in the unit of the points.
    pub band: Option<f64>,
    /// Whether an attribute is extended to all cells inside.
    pub inside: bool,
    /// Inputs, the points first.
    pub inputs: Vec<Array<Data<'a>>>,
    /// Outputs.
    pub outputs: Vec<Array<DataMut<'a>>>,
}

impl Batch<'_> {
    /// Whether the first input, the points, is `float64`.
    pub fn is_double(&self) -> bool {
        match self.inputs.first().map(|input| &input.data) {
            Some(Data::F64(_)) => true,
            #[cfg(feature = "cuda")]
            Some(Data::OnDevice(Pointer::F64(_))) => true,
            _ => false,
        }
    }

    /// Calls `work` for each cloud of the batch, in order.
    ///
    /// # Errors
    /// Arrays that differ in their leading dimensions; errors of `work`, with the index of the cloud where there are
    /// several.
    pub fn for_each(
        mut self,
        work: impl Fn(Call<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let points = self.inputs.first().map_or(&[][..], |points| &points.dims);
        let Some(rank) = points.len().checked_sub(2) else {
            return Err(format!("the points have the shape {points:?}; give (N, 3)").into());
        };
        let leading = points[..rank].to_vec();
        let inputs = self.inputs.iter().map(|input| &input.dims);
        let mut all = inputs.chain(self.outputs.iter().map(|output| &output.dims));
        if let Some(dims) = all.find(|dims| !dims.starts_with(&leading)) {
            return Err(format!(
                "an array has the shape {dims:?}; its leading dimensions must be {leading:?}"
            )
            .into());
        }
        let count = leading.iter().product::<usize>();
        (0..count).try_for_each(|k| {
            let inputs = self.inputs.iter().map(|array| Array {
                dims: array.dims[rank..].to_vec(),
                data: array.data.part(k, count),
            });
            let outputs = self.outputs.iter_mut().map(|array| Array {
                dims: array.dims[rank..].to_vec(),
                data: array.data.part(k, count),
            });
            let call = Call {
                settings: self.settings,
                band: self.band,
                inside: self.inside,
                inputs: inputs.collect::<Vec<_>>().into_iter(),
                outputs: outputs.collect::<Vec<_>>().into_iter(),
            };
            work(call).map_err(|failure| match count {
                1 => failure,
                _ => failure.with_context(&format!("cloud {k} of the batch")),
            })
        })
    }
}

/// A call for one cloud: a target takes its arrays in order.
pub struct Call<'a> {
    /// See [`Batch::settings`].
    pub settings: &'a str,
    /// See [`Batch::band`].
    pub band: Option<f64>,
    /// See [`Batch::inside`].
    pub inside: bool,
    inputs: IntoIter<Array<Data<'a>>>,
    outputs: IntoIter<Array<DataMut<'a>>>,
}

impl<'a> Call<'a> {
    /// Number of outputs that have not been taken.
    pub fn outputs_left(&self) -> usize {
        self.outputs.len()
    }

    /// The next input, of `rank` dimensions.
    ///
    /// # Errors
    /// A missing array, or one of another type or rank.
    pub fn input<E: Element>(&mut self, name: &str, rank: usize) -> Result<&'a [E], String> {
        let input = self.inputs.next().ok_or_else(|| missing(name))?;
        check_rank(name, &input.dims, rank)?;
        E::slice(input.data).ok_or_else(|| wrong_type::<E>(name))
    }

    /// The next output, of `rank` dimensions.
    pub fn output<E: Element>(&mut self, name: &str, rank: usize) -> Result<&'a mut [E], String> {
        let output = self.outputs.next().ok_or_else(|| missing(name))?;
        check_rank(name, &output.dims, rank)?;
        E::slice_mut(output.data).ok_or_else(|| wrong_type::<E>(name))
    }

    /// The next input, of `rank` dimensions, on a device.
    ///
    /// # Errors
    /// As [`Self::input`].
    #[cfg(feature = "cuda")]
    pub fn input_on_device<E: Element>(
        &mut self,
        name: &str,
        rank: usize,
    ) -> Result<DeviceArray<E>, String> {
        let input = self.inputs.next().ok_or_else(|| missing(name))?;
        check_rank(name, &input.dims, rank)?;
        match input.data {
            Data::OnDevice(pointer) => E::on_device(pointer),
            _ => None,
        }
        .ok_or_else(|| wrong_type::<E>(name))
    }

    /// The next output, of `rank` dimensions, on a device.
    #[cfg(feature = "cuda")]
    pub fn output_on_device<E: Element>(
        &mut self,
        name: &str,
        rank: usize,
    ) -> Result<DeviceArray<E>, String> {
        let output = self.outputs.next().ok_or_else(|| missing(name))?;
        check_rank(name, &output.dims, rank)?;
        match output.data {
            DataMut::OnDevice(pointer) => E::on_device(pointer),
            _ => None,
        }
        .ok_or_else(|| wrong_type::<E>(name))
    }

    /// Number of inputs that have not been taken.
    #[cfg(feature = "cuda")]
    pub fn inputs_left(&self) -> usize {
        self.inputs.len()
    }

    /// The next input as `(N, 3)` vectors.
    ///
    /// # Errors
    /// As [`Self::input`], and another last dimension.
    pub fn vectors<E: Element>(&mut self, name: &str) -> Result<&'a [[E; 3]], String> {
        check_three(name, self.inputs.as_slice().first())?;
        Ok(self.input::<E>(name, 2)?.as_chunks().0)
    }

    /// The next output as `(N, 3)` vectors.
    pub fn vectors_out<E: Element>(&mut self, name: &str) -> Result<&'a mut [[E; 3]], String> {
        check_three(name, self.outputs.as_slice().first())?;
        Ok(self.output::<E>(name, 2)?.as_chunks_mut().0)
    }

    /// The normals of the cloud: the last input, where one is left.
    pub fn normals<E: Element>(&mut self) -> Result<Option<&'a [[E; 3]]>, String> {
        match self.inputs.len() {
            0 => Ok(None),
            _ => self.vectors("the given normals").map(Some),
        }
    }

    /// Checks that every array has been taken.
    ///
    /// # Errors
    /// Arrays that are left.
    pub fn check_all_taken(&self) -> Result<(), Failure> {
        match self.inputs.len() + self.outputs.len() {
            0 => Ok(()),
            _ => Err("more arrays were passed than are used".into()),
        }
    }
}

fn missing(name: &str) -> String {
    format!("there is no array for {name}")
}

fn wrong_type<E: Element>(name: &str) -> String {
    format!("the array for {name} must be of {}", E::NAME)
}

fn check_rank(name: &str, dims: &[usize], rank: usize) -> Result<(), String> {
    match dims.len() == rank {
        true => Ok(()),
        false => Err(format!(
            "the array for {name} has the shape {dims:?} and must have {rank} dimensions"
        )),
    }
}

fn check_three<D>(name: &str, array: Option<&Array<D>>) -> Result<(), String> {
    match array {
        Some(Array { dims, .. }) if dims.last() != Some(&3) => Err(format!(
            "the array for {name} has the shape {dims:?} and must end in 3"
        )),
        _ => Ok(()),
    }
}
