//! The heavy code, compiled once for each number type, in this crate.
//!
//! A generic function is compiled in every program that calls it: without this, each test, bench and
//! binding would spend minutes compiling the whole pipeline again.

use crate::data::PointCloud;
use crate::pipeline::{Error, Reconstructor};
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
    ) -> Result<(), Error>
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
            ) -> Result<(), Error> {
                plan.run(stage, cloud)
            }
        }
    };
}

concrete!(f32);
concrete!(f64);
