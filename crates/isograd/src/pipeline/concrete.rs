//! The pipeline, compiled once for each number type, in this crate.
//!
//! A generic function is compiled in every program that calls it: without this, each test, bench and
//! binding would spend minutes compiling the whole pipeline again.

use super::pullback::PullbackScratch;
use super::{
    CloudCotangent, Cotangent, Error, Orienter, PullbackError, Reconstruction, Reconstructor,
    RestoreError, Saved, Stage,
};
use crate::data::PointCloud;
use crate::{Real, poisson};

/// Declares [`Pipeline`], and implements it for both number types by the generic functions.
macro_rules! pipeline {
    ($($(#[$doc:meta])+ fn $name:ident($($arg:ident: $type:ty),+) -> $out:ty = $body:expr;)+) => {
        /// A number type that [plans](Reconstructor) are compiled for: `f32` or `f64`.
        pub trait Pipeline: Real {
            $($(#[$doc])+ fn $name($($arg: $type),+) -> $out;)+
        }

        impl Pipeline for f32 {
            $(fn $name($($arg: $type),+) -> $out { $body })+
        }

        impl Pipeline for f64 {
            $(fn $name($($arg: $type),+) -> $out { $body })+
        }
    };
}

pipeline! {
    #[doc(hidden)]
    fn poisson_plan(shape: [usize; 3]) -> poisson::Plan<Self> = poisson::Plan::new(shape);

    #[doc(hidden)]
    fn run(
        plan: &mut Reconstructor<Self>,
        stage: Stage,
        cloud: &PointCloud<Self>,
        held: Option<&Reconstruction<Self>>
    ) -> Result<(), Error> = plan.run(stage, cloud, held);

    #[doc(hidden)]
    fn orient(plan: &mut Orienter<Self>, cloud: &PointCloud<Self>) -> Result<(), Error> = plan.run(cloud);

    #[doc(hidden)]
    fn rebuild(
        plan: &mut Reconstructor<Self>,
        cloud: &PointCloud<Self>,
        saved: &Saved<'_, Self>
    ) -> Result<(), RestoreError> = plan.rebuild(cloud, saved);

    #[doc(hidden)]
    fn pull(
        reconstruction: &Reconstruction<Self>,
        cotangent: &Cotangent<'_, Self>,
        scratch: &mut PullbackScratch<Self>,
        out: &mut CloudCotangent<Self>
    ) -> Result<(), PullbackError> = reconstruction.pull(cotangent, scratch, out);
}
