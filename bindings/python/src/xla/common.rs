//! Steps shared by the targets: run a plan on a cloud, save what a pullback needs, and restore the reconstruction
//! from it.

use isograd::distance::Hit;
use isograd::distance::extend::Region;
use isograd::{Attribute, CloudCotangent, Cotangent, PointCloud, Real, Saved};
use isograd_backend::View;
use rayon::prelude::*;

use super::buffers::{Call, Element};
use crate::arrays::Number;
use crate::backend::Failure;
use crate::pool::{self, Plan};

/// Number type of the library, of NumPy and of XLA.
pub trait Float: Number + Element {}
impl Float for f32 {}
impl Float for f64 {}

/// A copy of `(N, 3)` points and, where the caller passes them, normals.
pub fn cloud<T: Real>(
    points: &[[T; 3]],
    normals: Option<&[[T; 3]]>,
) -> Result<PointCloud<T>, Failure> {
    let cloud = PointCloud::new(points.to_vec());
    let cloud = match normals {
        None => cloud,
        Some(normals) => cloud.and_then(|cloud| cloud.with_normals(normals.to_vec())),
    };
    Ok(cloud.map_err(|error| error.to_string())?)
}

/// `(N, C)` values of the samples as an attribute.
pub fn attribute<T: Real>(values: &[T], points: usize) -> Attribute<T> {
    Attribute {
        name: "values".into(),
        components: values.len() / points.max(1),
        values: values.to_vec(),
    }
}

/// The directions, faces and weights of hits, without distances and closest points: what a pullback needs.
///
/// # Errors
/// Arrays that differ in length.
pub fn saved_hits<T: Float>(call: &mut Call<'_>) -> Result<Vec<Hit<T>>, Failure> {
    let gradient = call.vectors("the gradients")?;
    let triangle = call.input("the triangles", 1)?;
    let barycentric = call.vectors("the barycentric weights")?;
    if gradient.len() != triangle.len() || barycentric.len() != triangle.len() {
        return Err("the saved hits differ in number".into());
    }
    let hit = |i: usize| Hit {
        distance: T::nan(),
        point: [T::nan(); 3],
        gradient: gradient[i],
        triangle: triangle[i],
        barycentric: barycentric[i],
    };
    Ok((0..triangle.len()).map(hit).collect())
}

/// Copies an array into one of the same length.
///
/// # Errors
/// Arrays of different lengths.
pub fn copy<E: Copy>(name: &str, from: &[E], to: &mut [E]) -> Result<(), Failure> {
    check_length(name, to.len(), from.len())?;
    to.copy_from_slice(from);
    Ok(())
}

/// Copies a part of each hit into an array of the same length.
///
/// # Errors
/// Arrays of different lengths.
pub fn copy_part<T: Real, E: Copy + Send>(
    name: &str,
    hits: &[Hit<T>],
    to: &mut [E],
    part: impl Fn(&Hit<T>) -> E + Sync,
) -> Result<(), Failure> {
    check_length(name, to.len(), hits.len())?;
    let entries = to.par_iter_mut().zip(hits);
    entries.for_each(|(entry, hit)| *entry = part(hit));
    Ok(())
}

fn check_length(name: &str, length: usize, expected: usize) -> Result<(), Failure> {
    match length == expected {
        true => Ok(()),
        false => Err(Failure::Value(format!(
            "the array for {name} has {length} entries and must have {expected}"
        ))),
    }
}

/// Outputs for φ, closest faces and normals: what a pullback needs, in the order of [`Saved`].
pub struct SavedOutputs<'a, T> {
    sdf: &'a mut [T],
    closest: &'a mut [u32],
    normals: &'a mut [[T; 3]],
}

impl<T: Float> SavedOutputs<'_, T> {
    /// Fills the outputs.
    ///
    /// # Errors
    /// Outputs of another length; errors of the device.
    pub fn fill(self, result: View<'_, T>) -> Result<(), Failure> {
        copy("φ", result.sdf()?.values(), self.sdf)?;
        copy("the closest faces", result.closest()?, self.closest)?;
        copy("the normals", result.normals()?, self.normals)
    }
}

/// Outputs for the cotangents of a cloud.
pub struct CloudOutputs<'a, T> {
    points: &'a mut [[T; 3]],
    normals: Option<&'a mut [[T; 3]]>,
}

impl<T: Float> CloudOutputs<'_, T> {
    /// Fills the outputs; the cotangent of normals that have no influence is zero.
    ///
    /// # Errors
    /// Outputs of another length.
    pub fn fill(self, bar: &CloudCotangent<T>) -> Result<(), Failure> {
        copy("the points' cotangent", &bar.points, self.points)?;
        match self.normals {
            Some(normals) if bar.normals.is_empty() => normals.fill([T::zero(); 3]),
            Some(normals) => copy("the normals' cotangent", &bar.normals, normals)?,
            None => {}
        }
        Ok(())
    }
}

/// A restored reconstruction and the buffers of its pullback.
pub struct Restored<'a, T: Number> {
    /// The reconstruction.
    pub result: View<'a, T>,
    bar: &'a mut CloudCotangent<T>,
}

impl<'a, T: Number> Restored<'a, T> {
    /// The cotangents of the cloud.
    pub fn pullback(self, cotangent: &Cotangent<'_, T>) -> Result<&'a CloudCotangent<T>, Failure> {
        self.result.pullback_into(cotangent, self.bar)?;
        Ok(self.bar)
    }
}

impl<'a> Call<'a> {
    /// The width of the band.
    ///
    /// # Errors
    /// A missing attribute.
    pub fn band(&self) -> Result<f64, Failure> {
        let missing = || "the attribute 'band' is missing".into();
        self.band.ok_or_else(missing)
    }

    /// The region that has the band outside.
    ///
    /// # Errors
    /// A missing attribute.
    pub fn region(&self) -> Result<Region, Failure> {
        let band = self.band()?;
        Ok(match self.inside {
            true => Region::Inside(band),
            false => Region::Band(band),
        })
    }

    /// The next three outputs.
    pub fn saved_outputs<T: Float>(&mut self) -> Result<SavedOutputs<'a, T>, Failure> {
        Ok(SavedOutputs {
            sdf: self.output("φ", 3)?,
            closest: self.output("the closest faces", 3)?,
            normals: self.vectors_out("the normals")?,
        })
    }

    /// The next three inputs, as [`SavedOutputs::fill`] wrote them.
    pub fn saved<T: Float>(&mut self) -> Result<Saved<'a, T>, Failure> {
        Ok(Saved {
            sdf: self.input("φ", 3)?,
            closest: self.input("the closest faces", 3)?,
            normals: self.vectors("the normals")?,
        })
    }

    /// The next output, for the points, and one more for the normals where they are inputs.
    pub fn cloud_outputs<T: Float>(
        &mut self,
        has_normals: bool,
    ) -> Result<CloudOutputs<'a, T>, Failure> {
        let points = self.vectors_out("the cotangent of the points")?;
        let normals = has_normals.then(|| self.vectors_out("the cotangent of the normals"));
        Ok(CloudOutputs {
            points,
            normals: normals.transpose()?,
        })
    }

    /// Passes the reconstruction of a cloud to `work`; all arrays must have been taken.
    ///
    /// # Errors
    /// Errors of the settings, of a stage and of `work`.
    pub fn reconstruct<T: Number>(
        self,
        cloud: &PointCloud<T>,
        work: impl FnOnce(View<'_, T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.check_all_taken()?;
        pool::with_plan::<T, _>(self.settings, |plan| work(plan.plan.reconstruct(cloud)?))?
    }

    /// Passes the reconstruction that was saved to `work`; all arrays must have been taken.
    ///
    /// # Errors
    /// Errors of the settings, of a stage and of `work`; arrays saved from another result.
    pub fn restore<T: Number>(
        self,
        cloud: &PointCloud<T>,
        saved: &Saved<'_, T>,
        work: impl FnOnce(Restored<'_, T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.check_all_taken()?;
        pool::with_plan::<T, _>(self.settings, |plan| {
            let Plan { plan, bar } = plan;
            work(Restored {
                result: plan.restore(cloud, saved)?,
                bar,
            })
        })?
    }
}
