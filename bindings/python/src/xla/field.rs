//! φ on a grid, and its pullback.

use isograd::Cotangent;

use super::Target;
use super::buffers::Call;
use super::common::{Float, cloud, copy};
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
}
