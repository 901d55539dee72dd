//! φ and an attribute of the samples at the cells around the surface, and their pullback.

use isograd::distance::extend::Extension;
use isograd::{Cotangent, ExtensionCotangent, Real};

use super::Target;
use super::buffers::Call;
use super::common::{Float, attribute, cloud, copy};
use crate::backend::Failure;

/// Inputs: points, `(N, C)` values, optionally normals. Outputs: values at the cells of the region and zeros elsewhere, φ,
/// and what else the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_extend";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let attribute = attribute(call.input("the values", 2)?, points.len());
        let cloud = cloud(points, call.normals()?)?;
        let field = call.output("the extended values", 4)?;
        let saved = call.saved_outputs()?;
        let region = call.region()?;
        call.reconstruct(&cloud, |result| {
            let (extension, _) = result.extend(&attribute, region)?;
            field.fill(T::zero());
            extension.scatter(field).map_err(|e| e.to_string())?;
            saved.fill(result)
        })
    }
}

/// Inputs: points, values, what the forward map saved, cotangents of the extended values and of φ, optionally normals.
/// Outputs: cotangents of values, points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_extend_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let attribute = attribute(call.input("the values", 2)?, points.len());
        let saved = call.saved()?;
        let field_bar = call.input("the cotangent of the extended values", 4)?;
        let sdf_bar = call.input("the cotangent of φ", 3)?;
        let normals = call.normals()?;
        let values_out = call.output("the cotangent of the values", 2)?;
        let out = call.cloud_outputs(normals.is_some())?;
        let region = call.region()?;
        call.restore(&cloud(points, normals)?, &saved, |restored| {
            let (extension, residual) = restored.result.extend(&attribute, region)?;
            let values_bar = gather(&extension, field_bar)?;
            let extended = ExtensionCotangent {
                attribute: &attribute,
                extension: &extension,
                residual: &residual,
                vertices: None,
                values: Some(&values_bar),
            };
            let bar = restored.pullback(&Cotangent {
                sdf: Some(sdf_bar),
                extensions: &[extended],
                ..Cotangent::default()
            })?;
            let attribute_bar = bar.attributes.first().map_or(&[][..], |bar| bar);
            copy("the values' cotangent", attribute_bar, values_out)?;
            out.fill(bar)
        })
    }
}

/// The cotangents at the cells of the region, from those of all cells.
fn gather<T: Real>(extension: &Extension<T>, dense: &[T]) -> Result<Vec<T>, Failure> {
    let components = extension.components;
    let rows = extension.cells.iter().map(|&cell| {
        let start = cell as usize * components;
        dense.get(start..start + components)
    });
    let rows: Option<Vec<_>> = rows.collect();
    let rows = rows.ok_or("the cotangent of the extended values is too short")?;
    Ok(rows.concat())
}
