//! The arrays of a call, as slices with their dimensions. Leading dimensions that all arrays share are a batch.

use crate::backend::Failure;
use std::vec::IntoIter;

/// Values of one of the three types in use.
pub enum Data<'a> {
    /// `float32`
    F32(&'a [f32]),
    /// `float64`
    F64(&'a [f64]),
    /// `uint32`
    U32(&'a [u32]),
}

/// The same, to be written.
pub enum DataMut<'a> {
    /// `float32`
    F32(&'a mut [f32]),
    /// `float64`
    F64(&'a mut [f64]),
    /// `uint32`
    U32(&'a mut [u32]),
}

/// An array in C order.
pub struct Input<'a> {
    /// Its dimensions.
    pub dims: Vec<usize>,
    /// As many values as these say.
    pub data: Data<'a>,
}

/// The same, to be written.
pub struct Output<'a> {
    /// Its dimensions.
    pub dims: Vec<usize>,
    /// As many values as these say.
    pub data: DataMut<'a>,
}

/// A type of array.
pub trait Element: Copy {
    /// Its name in errors.
    const NAME: &'static str;
    /// The values, where they are of this type.
    fn of<'a>(data: &Data<'a>) -> Option<&'a [Self]>;
    /// The same, to be written.
    fn of_mut(data: DataMut<'_>) -> Option<&mut [Self]>;
}

macro_rules! element {
    ($type:ty, $variant:ident, $name:literal) => {
        impl Element for $type {
            const NAME: &'static str = $name;
            fn of<'a>(data: &Data<'a>) -> Option<&'a [Self]> {
                match data {
                    Data::$variant(values) => Some(values),
                    _ => None,
                }
            }
            fn of_mut(data: DataMut<'_>) -> Option<&mut [Self]> {
                match data {
                    DataMut::$variant(values) => Some(values),
                    _ => None,
                }
            }
        }
    };
}
element!(f32, F32, "float32");
element!(f64, F64, "float64");
element!(u32, U32, "uint32");

/// One call: what a handler takes its arrays from, in order.
pub struct Call<'a> {
    /// Grid and options: see [`Settings`](crate::settings::Settings).
    pub settings: &'a str,
    /// Half the width of the band that an attribute is extended to, in cells.
    pub band: Option<f64>,
    inputs: IntoIter<Input<'a>>,
    outputs: IntoIter<Output<'a>>,
    /// Leading dimensions of the first input, which all others must have.
    batch: Option<Vec<usize>>,
}

impl<'a> Call<'a> {
    /// A call with these arrays.
    pub fn new(
        settings: &'a str,
        band: Option<f64>,
        inputs: Vec<Input<'a>>,
        outputs: Vec<Output<'a>>,
    ) -> Self {
        Self {
            settings,
            band,
            inputs: inputs.into_iter(),
            outputs: outputs.into_iter(),
            batch: None,
        }
    }

    /// Whether the first input, the points, is of double precision.
    pub fn is_double(&self) -> bool {
        let first = self.inputs.as_slice().first();
        matches!(first, Some(input) if matches!(input.data, Data::F64(_)))
    }

    /// Whether inputs are left.
    pub fn has_input(&self) -> bool {
        self.inputs.len() > 0
    }

    /// How many outputs are left.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// The next input, of so many dimensions besides those of the batch.
    ///
    /// # Errors
    /// It is missing, or of another type or shape.
    pub fn input<E: Element>(&mut self, what: &str, rank: usize) -> Result<Batch<'a, E>, String> {
        let input = self.inputs.next();
        let input = input.ok_or_else(|| format!("there is no array for {what}"))?;
        let each = self.size_of_item(what, &input.dims, rank)?;
        let values = E::of(&input.data).ok_or_else(|| wrong_type::<E>(what))?;
        Ok(Batch { values, each })
    }

    /// The next output, likewise.
    ///
    /// # Errors
    /// As [`Self::input`].
    pub fn output<E: Element>(
        &mut self,
        what: &str,
        rank: usize,
    ) -> Result<BatchMut<'a, E>, String> {
        let output = self.outputs.next();
        let output = output.ok_or_else(|| format!("there is no array for {what}"))?;
        let each = self.size_of_item(what, &output.dims, rank)?;
        let values = E::of_mut(output.data).ok_or_else(|| wrong_type::<E>(what))?;
        Ok(BatchMut { values, each })
    }

    /// The next input, if one is left, as `(N, 3)` vectors.
    ///
    /// # Errors
    /// Another type or shape.
    pub fn given<E: Element>(&mut self) -> Result<Option<Batch<'a, [E; 3]>>, String> {
        match self.has_input() {
            true => self.vectors("the given normals").map(Some),
            false => Ok(None),
        }
    }

    /// The next input as `(N, 3)` vectors.
    ///
    /// # Errors
    /// As [`Self::input`].
    pub fn vectors<E: Element>(&mut self, what: &str) -> Result<Batch<'a, [E; 3]>, String> {
        let three = self.inputs.as_slice().first();
        check_three(what, three.map(|input| &input.dims))?;
        let Batch { values, each } = self.input::<E>(what, 2)?;
        Ok(Batch {
            values: values.as_chunks().0,
            each: each / 3,
        })
    }

    /// The next output as `(N, 3)` vectors.
    ///
    /// # Errors
    /// As [`Self::output`].
    pub fn vectors_out<E: Element>(&mut self, what: &str) -> Result<BatchMut<'a, [E; 3]>, String> {
        let three = self.outputs.as_slice().first();
        check_three(what, three.map(|output| &output.dims))?;
        let BatchMut { values, each } = self.output::<E>(what, 2)?;
        Ok(BatchMut {
            values: values.as_chunks_mut().0,
            each: each / 3,
        })
    }

    /// Does `work` for each member of the batch, by its index.
    ///
    /// # Errors
    /// Arrays that nobody took, and what `work` says, with the index where there are several.
    pub fn for_each(
        &self,
        mut work: impl FnMut(usize) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if self.has_input() || self.outputs() > 0 {
            return Err("more arrays were passed than are used".into());
        }
        let count = self.batch.iter().flatten().product::<usize>();
        (0..count).try_for_each(|k| {
            work(k).map_err(|failure| match count {
                1 => failure,
                _ => failure.of(&format!("cloud {k} of the batch")),
            })
        })
    }

    fn size_of_item(&mut self, what: &str, dims: &[usize], rank: usize) -> Result<usize, String> {
        let leading = dims.len().checked_sub(rank);
        let leading = leading.ok_or_else(|| {
            format!("the array for {what} has the shape {dims:?} and needs {rank} dimensions")
        })?;
        let (of_batch, of_item) = dims.split_at(leading);
        let batch = self.batch.get_or_insert_with(|| of_batch.to_vec());
        if batch != of_batch {
            return Err(format!(
                "the array for {what} has the shape {dims:?}; its leading dimensions must be {batch:?}"
            ));
        }
        Ok(of_item.iter().product())
    }
}

fn wrong_type<E: Element>(what: &str) -> String {
    format!("the array for {what} must be of {}", E::NAME)
}

fn check_three(what: &str, dims: Option<&Vec<usize>>) -> Result<(), String> {
    match dims {
        Some(dims) if dims.last() != Some(&3) => Err(format!(
            "the array for {what} has the shape {dims:?} and must end in 3"
        )),
        _ => Ok(()),
    }
}

/// The values of one array for all members of a batch.
#[derive(Clone, Copy)]
pub struct Batch<'a, E> {
    values: &'a [E],
    each: usize,
}

impl<'a, E> Batch<'a, E> {
    /// Those of member `k`.
    pub fn of(&self, k: usize) -> &'a [E] {
        &self.values[k * self.each..][..self.each]
    }
}

/// The same, to be written.
pub struct BatchMut<'a, E> {
    values: &'a mut [E],
    each: usize,
}

impl<E> BatchMut<'_, E> {
    /// Those of member `k`.
    pub fn of(&mut self, k: usize) -> &mut [E] {
        &mut self.values[k * self.each..][..self.each]
    }
}
