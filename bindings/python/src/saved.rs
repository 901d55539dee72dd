//! The pipeline as a pair of pure functions on slices: a forward that writes arrays of known size, and a
//! pullback that needs no more than these.

use isograd::{Cotangent, PointCloud, Real, Saved};

use crate::arrays::Number;
use crate::backend::Failure;
use crate::pool;

/// Where the forward map writes.
pub struct Outputs<'a, T> {
    /// `(nx, ny, nz)` φ.
    pub sdf: &'a mut [T],
    /// `(nx, ny, nz)` closest faces.
    pub closest: &'a mut [u32],
    /// `(N, 3)` outward normals.
    pub normals: &'a mut [[T; 3]],
}

/// What the pullback starts from; `given` are the normals that the cloud brought, where it did.
pub struct Inputs<'a, T> {
    /// `(N, 3)`.
    pub points: &'a [[T; 3]],
    /// `(N, 3)`.
    pub given: Option<&'a [[T; 3]]>,
    /// What the forward map wrote.
    pub saved: Saved<'a, T>,
    /// `(nx, ny, nz)` cotangent of φ.
    pub sdf_bar: &'a [T],
}

/// Reconstructs `points` with the grid and options of `settings`, where these say.
///
/// # Errors
/// What the settings, the cloud or a stage say; an output of another length.
pub fn forward<T: Number>(
    settings: &str,
    points: &[[T; 3]],
    given: Option<&[[T; 3]]>,
    out: Outputs<'_, T>,
) -> Result<(), Failure> {
    let cloud = cloud(points, given)?;
    pool::with_plan::<T, _>(settings, |plan| {
        let result = plan.plan.reconstruct(&cloud)?;
        copy("φ", result.sdf()?.values(), out.sdf)?;
        copy("the closest faces", result.closest()?, out.closest)?;
        copy("the normals", result.normals()?, out.normals)
    })?
}

/// Writes the cotangents of the points, and of the given normals where there are any.
///
/// # Errors
/// As [`forward`], and cotangents that are not finite.
pub fn pullback<T: Number>(
    settings: &str,
    inputs: &Inputs<'_, T>,
    points_bar: &mut [[T; 3]],
    given_bar: Option<&mut [[T; 3]]>,
) -> Result<(), Failure> {
    let cloud = cloud(inputs.points, inputs.given)?;
    pool::with_plan::<T, _>(settings, |plan| {
        let restored = plan.plan.restore(&cloud, &inputs.saved)?;
        let cotangent = Cotangent {
            sdf: Some(inputs.sdf_bar),
            ..Cotangent::default()
        };
        let (scratch, bar) = (&mut plan.scratch, &mut plan.bar);
        restored.pullback_into(&cloud, &cotangent, scratch, bar)?;
        copy("the points' cotangent", &bar.points, points_bar)?;
        copy_given(&bar.normals, given_bar)
    })?
}

/// A cloud of copies of these arrays.
///
/// # Errors
/// See [`isograd::PointCloudError`].
pub fn cloud<T: Real>(
    points: &[[T; 3]],
    given: Option<&[[T; 3]]>,
) -> Result<PointCloud<T>, Failure> {
    let cloud = PointCloud::new(points.to_vec()).map_err(|e| e.to_string())?;
    match given {
        None => Ok(cloud),
        Some(normals) => {
            let cloud = cloud.with_normals(normals.to_vec());
            Ok(cloud.map_err(|e| e.to_string())?)
        }
    }
}

/// Writes the cotangent of the given normals, where it is wanted: zero where they have no say.
///
/// # Errors
/// An array of another length.
pub fn copy_given<T: Real>(bar: &[[T; 3]], out: Option<&mut [[T; 3]]>) -> Result<(), Failure> {
    match out {
        None => Ok(()),
        Some(out) if bar.is_empty() => {
            out.fill([T::zero(); 3]);
            Ok(())
        }
        Some(out) => copy("the normals' cotangent", bar, out),
    }
}

/// Copies an array into one of the same length.
///
/// # Errors
/// An array of another length.
pub fn copy<E: Copy>(what: &str, from: &[E], to: &mut [E]) -> Result<(), Failure> {
    if from.len() != to.len() {
        let (found, expected) = (to.len(), from.len());
        return Err(Failure::Value(format!(
            "the array for {what} has {found} entries and must have {expected}"
        )));
    }
    to.copy_from_slice(from);
    Ok(())
}
