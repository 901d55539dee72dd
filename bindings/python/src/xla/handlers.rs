//! φ on a grid, and its pullback.

use isograd::Cotangent;

use super::Target;
use super::buffers::Call;
use super::common::{Cloud, CloudBar, Float, Keep, Kept, with_result};
use crate::backend::Failure;
use crate::saved;

/// Points, perhaps normals → φ, alone or with what the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_forward";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let cloud = Cloud {
            points: call.vectors::<T>("the points")?,
            given: call.given()?,
        };
        let settings = call.settings;
        if call.outputs() == 1 {
            let mut sdf = call.output::<T>("φ", 3)?;
            return call.for_each(|k| {
                with_result(settings, &cloud.of(k)?, |result| {
                    saved::copy("φ", result.sdf()?.values(), sdf.of(k))
                })
            });
        }
        let mut keep = Keep::<T>::take(&mut call)?;
        call.for_each(|k| with_result(settings, &cloud.of(k)?, |result| keep.fill(k, result)))
    }
}

/// Points, what the forward map kept, cotangent of φ, perhaps normals → cotangents of points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let kept = Kept::<T>::take(&mut call)?;
        let sdf_bar = call.input::<T>("the cotangent of φ", 3)?;
        let given = call.given()?;
        let mut out = CloudBar::<T>::take(&mut call, given.is_some())?;
        let (settings, cloud) = (call.settings, Cloud { points, given });
        call.for_each(|k| {
            let cotangent = Cotangent {
                sdf: Some(sdf_bar.of(k)),
                ..Cotangent::default()
            };
            kept.restore(settings, k, &cloud.of(k)?, |restored| {
                out.fill(k, restored.pull(&cotangent)?)
            })
        })
    }
}
