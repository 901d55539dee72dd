//! What all targets do: run a plan on the points of one member of a batch, keep what a pullback needs, and find the
//! reconstruction again from that.

use isograd::{Cotangent, PointCloud, Real, Saved};
use isograd_backend::View;

use super::buffers::{Batch, BatchMut, Call, Element};
use crate::arrays::Number;
use crate::backend::Failure;
use crate::pool::{self, Plan};
use crate::saved;

/// A number type of the library, of NumPy and of XLA.
pub trait Float: Number + Element {}
impl Float for f32 {}
impl Float for f64 {}

/// Points, and the normals that come with them.
#[derive(Clone, Copy)]
pub struct Cloud<'a, T> {
    /// `(N, 3)`.
    pub points: Batch<'a, [T; 3]>,
    /// `(N, 3)`.
    pub given: Option<Batch<'a, [T; 3]>>,
}

impl<T: Real> Cloud<'_, T> {
    /// That of member `k`.
    ///
    /// # Errors
    /// See [`isograd::PointCloudError`].
    pub fn of(&self, k: usize) -> Result<PointCloud<T>, Failure> {
        saved::cloud(self.points.of(k), self.given.map(|given| given.of(k)))
    }
}

/// Does `work` with the reconstruction of a cloud.
///
/// # Errors
/// What the settings, a stage or `work` say.
pub fn with_result<T: Number, R>(
    settings: &str,
    cloud: &PointCloud<T>,
    work: impl FnOnce(View<'_, T>) -> Result<R, Failure>,
) -> Result<R, Failure> {
    pool::with_plan::<T, _>(settings, |plan| work(plan.plan.reconstruct(cloud)?))?
}

/// Where a forward map keeps what its pullback needs, in the order of [`Saved`].
pub struct Keep<'a, T> {
    sdf: BatchMut<'a, T>,
    closest: BatchMut<'a, u32>,
    normals: BatchMut<'a, [T; 3]>,
}

impl<'a, T: Float> Keep<'a, T> {
    /// The next three outputs.
    ///
    /// # Errors
    /// Outputs of another type or shape.
    pub fn take(call: &mut Call<'a>) -> Result<Self, Failure> {
        Ok(Self {
            sdf: call.output("φ", 3)?,
            closest: call.output("the closest faces", 3)?,
            normals: call.vectors_out("the normals")?,
        })
    }

    /// Fills those of member `k`.
    ///
    /// # Errors
    /// Another length.
    pub fn fill(&mut self, k: usize, result: View<'_, T>) -> Result<(), Failure> {
        saved::copy("φ", result.sdf()?.values(), self.sdf.of(k))?;
        saved::copy("the closest faces", result.closest()?, self.closest.of(k))?;
        saved::copy("the normals", result.normals()?, self.normals.of(k))
    }
}

/// What a forward map kept.
pub struct Kept<'a, T> {
    sdf: Batch<'a, T>,
    closest: Batch<'a, u32>,
    normals: Batch<'a, [T; 3]>,
}

impl<'a, T: Float> Kept<'a, T> {
    /// The next three inputs.
    ///
    /// # Errors
    /// Inputs of another type or shape.
    pub fn take(call: &mut Call<'a>) -> Result<Self, Failure> {
        Ok(Self {
            sdf: call.input("φ", 3)?,
            closest: call.input("the closest faces", 3)?,
            normals: call.vectors("the normals")?,
        })
    }

    /// Does `work` with the plan and the reconstruction of member `k`.
    ///
    /// # Errors
    /// What the settings, a stage or `work` say.
    pub fn restore(
        &self,
        settings: &str,
        k: usize,
        cloud: &PointCloud<T>,
        work: impl FnOnce(Restored<'_, T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let saved = Saved {
            sdf: self.sdf.of(k),
            closest: self.closest.of(k),
            normals: self.normals.of(k),
        };
        pool::with_plan::<T, _>(settings, |plan| {
            let Plan { plan, scratch, bar } = plan;
            work(Restored {
                result: plan.restore(cloud, &saved)?,
                cloud,
                scratch,
                bar,
            })
        })?
    }
}

/// A reconstruction found again, and the memory of its pullback.
pub struct Restored<'a, T: Number> {
    /// The reconstruction.
    pub result: View<'a, T>,
    /// What it is of.
    pub cloud: &'a PointCloud<T>,
    scratch: &'a mut isograd::PullbackScratch<T>,
    bar: &'a mut isograd::CloudCotangent<T>,
}

impl<'a, T: Number> Restored<'a, T> {
    /// The cotangents of the cloud.
    ///
    /// # Errors
    /// See [`isograd::PullbackError`].
    pub fn pull(
        self,
        cotangent: &Cotangent<'_, T>,
    ) -> Result<&'a isograd::CloudCotangent<T>, Failure> {
        self.result
            .pullback_into(self.cloud, cotangent, self.scratch, self.bar)?;
        Ok(self.bar)
    }
}

/// Where the cotangents of a cloud go.
pub struct CloudBar<'a, T> {
    points: BatchMut<'a, [T; 3]>,
    given: Option<BatchMut<'a, [T; 3]>>,
}

impl<'a, T: Float> CloudBar<'a, T> {
    /// The next one or two outputs.
    ///
    /// # Errors
    /// Outputs of another type or shape.
    pub fn take(call: &mut Call<'a>, given: bool) -> Result<Self, Failure> {
        let points = call.vectors_out("the cotangent of the points")?;
        let normals = || call.vectors_out("the cotangent of the normals");
        Ok(Self {
            points,
            given: given.then(normals).transpose()?,
        })
    }

    /// Fills those of member `k`.
    ///
    /// # Errors
    /// Another length.
    pub fn fill(&mut self, k: usize, bar: &isograd::CloudCotangent<T>) -> Result<(), Failure> {
        saved::copy("the points' cotangent", &bar.points, self.points.of(k))?;
        let given = self.given.as_mut().map(|given| given.of(k));
        saved::copy_given(&bar.normals, given)
    }
}
