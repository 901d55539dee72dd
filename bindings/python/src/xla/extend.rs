//! φ and an attribute of the samples at the cells round the surface, and their pullback.

use isograd::distance::extend::Extension;
use isograd::{Attribute, Cotangent, ExtensionCotangent, Real};

use super::Target;
use super::buffers::Call;
use super::common::{Cloud, CloudBar, Float, Keep, Kept, with_result};
use crate::backend::Failure;
use crate::saved;

/// Points, `(N, C)` values, perhaps normals → values at the cells of a band and zeros elsewhere, φ, and what else the
/// pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_extend";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let values = call.input::<T>("the values", 2)?;
        let given = call.given()?;
        let mut field = call.output::<T>("the extended values", 4)?;
        let mut keep = Keep::<T>::take(&mut call)?;
        let (settings, band) = (call.settings, band(&call)?);
        let cloud = Cloud { points, given };
        call.for_each(|k| {
            with_result(settings, &cloud.of(k)?, |result| {
                let attribute = attribute(values.of(k), points.of(k).len());
                let (extension, _) =
                    result.extend(&attribute, band * result.grid().spacing().f64())?;
                let out = field.of(k);
                out.fill(T::zero());
                extension.scatter(out).map_err(|e| e.to_string())?;
                keep.fill(k, result)
            })
        })
    }
}

/// Points, values, what the forward map kept, cotangents of the extended values and of φ, perhaps normals →
/// cotangents of values, points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_extend_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let values = call.input::<T>("the values", 2)?;
        let kept = Kept::<T>::take(&mut call)?;
        let field_bar = call.input::<T>("the cotangent of the extended values", 4)?;
        let sdf_bar = call.input::<T>("the cotangent of φ", 3)?;
        let given = call.given()?;
        let mut values_out = call.output::<T>("the cotangent of the values", 2)?;
        let mut out = CloudBar::<T>::take(&mut call, given.is_some())?;
        let (settings, band) = (call.settings, band(&call)?);
        let cloud = Cloud { points, given };
        call.for_each(|k| {
            kept.restore(settings, k, &cloud.of(k)?, |restored| {
                let attribute = attribute(values.of(k), points.of(k).len());
                let (extension, residual) = restored
                    .result
                    .extend(&attribute, band * restored.result.grid().spacing().f64())?;
                let values_bar = gather(&extension, field_bar.of(k))?;
                let of_values = ExtensionCotangent {
                    attribute: &attribute,
                    extension: &extension,
                    residual: &residual,
                    vertices: None,
                    values: Some(&values_bar),
                };
                let bar = restored.pull(&Cotangent {
                    sdf: Some(sdf_bar.of(k)),
                    extensions: &[of_values],
                    ..Cotangent::default()
                })?;
                let found = bar.attributes.first().map_or(&[][..], |bar| bar);
                saved::copy("the values' cotangent", found, values_out.of(k))?;
                out.fill(k, bar)
            })
        })
    }
}

fn band(call: &Call<'_>) -> Result<f64, Failure> {
    call.band
        .ok_or_else(|| "the attribute 'band' is missing".into())
}

fn attribute<T: Real>(values: &[T], points: usize) -> Attribute<T> {
    Attribute {
        name: "values".into(),
        components: values.len() / points.max(1),
        values: values.to_vec(),
    }
}

/// The cotangents at the cells of the band, from those of all cells.
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
