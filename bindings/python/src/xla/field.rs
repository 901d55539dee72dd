//! φ on a grid, and its pullback.

use isograd::Cotangent;

use super::Target;
#[cfg(feature = "cuda")]
use super::buffers::Batch;
use super::buffers::Call;
use super::common::{Float, cloud, copy};
#[cfg(feature = "cuda")]
use super::run_each;
use crate::backend::Failure;

/// Inputs: points, optionally normals. Outputs: φ, alone or with what the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_forward";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let cloud = cloud(call.vectors::<T>("the points")?, call.normals()?)?;
        if call.outputs_left() == 1 {
            let sdf = call.output::<T>("φ", 3)?;
            return call.reconstruct(&cloud, |result| copy("φ", result.sdf()?.values(), sdf));
        }
        let saved = call.saved_outputs()?;
        call.reconstruct(&cloud, |result| saved.fill(result))
    }

    #[cfg(feature = "cuda")]
    fn run_on_cuda(batch: Batch<'_>) -> Result<(), Failure> {
        on_device::check_backend(batch.settings)?;
        run_each(batch, on_device::forward::<f64>, on_device::forward::<f32>)
    }
}

/// Inputs: points, what the forward map saved, cotangent of φ, optionally normals. Outputs: cotangents of points and
/// normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let saved = call.saved()?;
        let sdf_bar = call.input("the cotangent of φ", 3)?;
        let normals = call.normals()?;
        let out = call.cloud_outputs(normals.is_some())?;
        call.restore(&cloud(points, normals)?, &saved, |restored| {
            out.fill(restored.pullback(&Cotangent {
                sdf: Some(sdf_bar),
                ..Cotangent::default()
            })?)
        })
    }

    #[cfg(feature = "cuda")]
    fn run_on_cuda(batch: Batch<'_>) -> Result<(), Failure> {
        on_device::check_backend(batch.settings)?;
        run_each(
            batch,
            on_device::pullback::<f64>,
            on_device::pullback::<f32>,
        )
    }
}

/// Fields stay on the device; points, normals and their cotangents are copied.
#[cfg(feature = "cuda")]
mod on_device {
    pub use super::super::cuda::check_backend;
    use super::super::cuda::failure;
    use super::*;
    use crate::pool;

    pub fn forward<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors_from_device::<T>("the points")?;
        let normals = call.normals_from_device::<T>()?;
        let cloud = cloud(&points, normals.as_deref())?;
        let sdf = call.output_on_device::<T>("φ", 3)?;
        let saved = match call.outputs_left() {
            0 => None,
            _ => Some((
                call.output_on_device::<u32>("the closest faces", 3)?,
                call.output_on_device::<T>("the normals", 2)?,
            )),
        };
        call.check_all_taken()?;
        pool::with_plan::<T, _>(call.settings, |plan| {
            let result = plan.plan.reconstruct(&cloud)?;
            result.sdf_into(&sdf)?;
            if let Some((closest, normals)) = &saved {
                result.closest_into(closest)?;
                let found = result.normals()?.as_flattened();
                normals.upload(found).map_err(failure)?;
            }
            Ok(())
        })?
    }

    pub fn pullback<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors_from_device::<T>("the points")?;
        call.input_on_device::<T>("φ", 3)?;
        call.input_on_device::<u32>("the closest faces", 3)?;
        let saved = call.vectors_from_device::<T>("the normals")?;
        let sdf_bar = call.input_on_device::<T>("the cotangent of φ", 3)?;
        let normals = call.normals_from_device::<T>()?;
        let points_out = call.output_on_device::<T>("the cotangent of the points", 2)?;
        let normals_out = match &normals {
            Some(_) => Some(call.output_on_device::<T>("the cotangent of the normals", 2)?),
            None => None,
        };
        call.check_all_taken()?;
        let cloud = cloud(&points, normals.as_deref())?;
        pool::with_plan::<T, _>(call.settings, |plan| {
            let result = plan.plan.restore_from_normals(&cloud, &saved)?;
            let bar = result.pullback_on_device(&sdf_bar)?;
            let points_bar = bar.points.as_flattened();
            points_out.upload(points_bar).map_err(failure)?;
            if let Some(out) = normals_out {
                // Normals that have no influence have the cotangent 0.
                let mut of_all = bar.normals;
                of_all.resize(points.len(), [T::zero(); 3]);
                out.upload(of_all.as_flattened()).map_err(failure)?;
            }
            Ok(())
        })?
    }
}
