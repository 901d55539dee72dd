//! The heavy code, compiled once for each number type, in this crate.
//!
//! A generic function is compiled in every program that calls it: without this, each test, bench and
//! binding would spend minutes compiling the whole pipeline again.

use crate::data::PointCloud;
use crate::pipeline::{
    CloudCotangent, Cotangent, Error, Orienter, PullbackError, PullbackScratch, Reconstruction,
    Reconstructor, RestoreError, Saved,
};
use crate::poisson;
use crate::report::Stage;

/// Entry points with one body for `f32` and one for `f64`. It also seals [`Real`](crate::Real).
pub trait Concrete: Sized {
    /// [`poisson::Plan::new`].
    fn poisson_plan(shape: [usize; 3]) -> poisson::Plan<Self>
    where
        Self: crate::Real;

    /// One stage of a plan.
    ///
    /// # Errors
    /// The error of the stage.
    fn run(
        plan: &mut Reconstructor<Self>,
        stage: Stage,
        cloud: &PointCloud<Self>,
        held: Option<&Reconstruction<Self>>,
    ) -> Result<(), Error>
    where
        Self: crate::Real;

    /// [`Orienter::orient`].
    ///
    /// # Errors
    /// As that.
    fn orient(plan: &mut Orienter<Self>, cloud: &PointCloud<Self>) -> Result<(), Error>
    where
        Self: crate::Real;

    /// [`Reconstructor::restore`].
    ///
    /// # Errors
    /// As that.
    fn bring_back(
        plan: &mut Reconstructor<Self>,
        cloud: &PointCloud<Self>,
        saved: &Saved<'_, Self>,
    ) -> Result<(), RestoreError>
    where
        Self: crate::Real;

    /// [`Reconstruction::pullback_into`].
    ///
    /// # Errors
    /// As that.
    fn pull(
        reconstruction: &Reconstruction<Self>,
        cloud: &PointCloud<Self>,
        cotangent: &Cotangent<'_, Self>,
        scratch: &mut PullbackScratch<Self>,
        out: &mut CloudCotangent<Self>,
    ) -> Result<(), PullbackError>
    where
        Self: crate::Real;
}

macro_rules! concrete {
    ($real:ty) => {
        impl Concrete for $real {
            fn poisson_plan(shape: [usize; 3]) -> poisson::Plan<Self> {
                poisson::Plan::new(shape)
            }

            fn run(
                plan: &mut Reconstructor<Self>,
                stage: Stage,
                cloud: &PointCloud<Self>,
                held: Option<&Reconstruction<Self>>,
            ) -> Result<(), Error> {
                plan.run(stage, cloud, held)
            }

            fn orient(plan: &mut Orienter<Self>, cloud: &PointCloud<Self>) -> Result<(), Error> {
                plan.run(cloud)
            }

            fn bring_back(
                plan: &mut Reconstructor<Self>,
                cloud: &PointCloud<Self>,
                saved: &Saved<'_, Self>,
            ) -> Result<(), RestoreError> {
                plan.bring_back(cloud, saved)
            }

            fn pull(
                reconstruction: &Reconstruction<Self>,
                cloud: &PointCloud<Self>,
                cotangent: &Cotangent<'_, Self>,
                scratch: &mut PullbackScratch<Self>,
                out: &mut CloudCotangent<Self>,
            ) -> Result<(), PullbackError> {
                reconstruction.pull(cloud, cotangent, scratch, out)
            }
        }
    };
}

concrete!(f32);
concrete!(f64);
