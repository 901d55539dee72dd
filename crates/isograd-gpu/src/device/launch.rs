//! Launches of kernels.

use std::cell::Cell;

use cubecl::prelude::*;
use isograd::Grid;

use super::{Buffer, Device, Scalar};
use crate::grid::LatticeLaunch;

/// Units of a group where a kernel does not depend on it.
pub(crate) const BLOCK: usize = 64;

/// Queues a kernel with a unit for each of `count` elements, and one group where there are none, whose sums are then 0:
/// `launch!(device, count => kernel<T>(points, out, 3u32))`. `launch!(device, count, units => …)` sets the units of a
/// group, and `launch!(device, [groups; units] => …)` the number of groups too. [`Argument`] makes the parameters.
macro_rules! launch {
    ($device:expr, [$groups:expr; $units:expr] =>
        $kernel:ident $(<$($number:ty),+>)? ($($argument:expr),* $(,)?)) => {
        {
            use $crate::device::Argument as _;
            $kernel::launch::<$($($number,)+)? _>(
                $device.client(),
                ::cubecl::prelude::CubeCount::Static($groups as u32, 1, 1),
                ::cubecl::prelude::CubeDim::new_1d($units as u32),
                $(($argument).argument(&$device)),*
            )
        }
    };
    ($device:expr, $count:expr, $units:expr =>
        $kernel:ident $(<$($number:ty),+>)? ($($argument:expr),* $(,)?)) => {
        {
            use $crate::device::Argument as _;
            $kernel::launch::<$($($number,)+)? _>(
                $device.client(),
                $device.groups($count, $units as u32),
                ::cubecl::prelude::CubeDim::new_1d($units as u32),
                $(($argument).argument(&$device)),*
            );
        }
    };
    ($device:expr, $count:expr => $($kernel:tt)+) => {
        launch!($device, $count, $crate::device::BLOCK => $($kernel)+)
    };
}
pub(crate) use launch;

/// A value on the host that a kernel takes as a parameter.
pub(crate) trait Argument<R: Runtime> {
    /// The parameter.
    type Parameter;

    fn argument(&self, device: &Device<R>) -> Self::Parameter;
}

impl<R: Runtime, E> Argument<R> for Buffer<E> {
    type Parameter = ArrayArg<R>;

    fn argument(&self, _: &Device<R>) -> Self::Parameter {
        self.arg()
    }
}

impl<R: Runtime, T: Scalar> Argument<R> for Grid<T> {
    type Parameter = LatticeLaunch<T, R>;

    fn argument(&self, _: &Device<R>) -> Self::Parameter {
        crate::grid::arg(self)
    }
}

/// The parameter that stands for a value in kernels: `argument!(Mesh<T> => MeshLaunch<T, R>: |of| of.vertices.arg())`.
macro_rules! argument {
    ($type:ty => $launch:ident<$($parameter:ident),+>: |$of:ident| $($part:expr),+) => {
        impl<R: Runtime, T: $crate::Scalar> $crate::device::Argument<R> for $type {
            type Parameter = $launch<$($parameter),+>;

            fn argument(&self, _: &$crate::Device<R>) -> Self::Parameter {
                let $of = self;
                $launch::new($($part),+)
            }
        }
    };
}
pub(crate) use argument;

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl<R: Runtime> Argument<R> for $number {
            type Parameter = Self;

            fn argument(&self, _: &Device<R>) -> Self {
                *self
            }
        }
    )*};
}

numbers!(u32, usize, bool);

impl<R: Runtime, T: Scalar> Argument<R> for T {
    type Parameter = Self;

    fn argument(&self, _: &Device<R>) -> Self {
        *self
    }
}

/// A parameter that is there already; it can be passed once.
pub(crate) struct Ready<P>(Cell<Option<P>>);

impl<P> Ready<P> {
    pub fn new(parameter: P) -> Self {
        Self(Cell::new(Some(parameter)))
    }
}

impl<R: Runtime, P> Argument<R> for Ready<P> {
    type Parameter = P;

    fn argument(&self, _: &Device<R>) -> P {
        self.0.take().expect("a parameter that was not passed yet")
    }
}
