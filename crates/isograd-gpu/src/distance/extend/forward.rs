//! The forward map.

use cubecl::prelude::Runtime;

use super::cpu::Region;
use super::neighbor::Sorted;
use super::{Attribute, Error, Extension, Residual, Samples, Surface, cells, checks, fits};
use crate::primitives::flags;
use crate::{Device, Scalar};

/// Extends an attribute of the samples to the vertices of the surface and to the cells of a region. Values have the
/// unit of the attribute. Waits for the device, once: the checks, and how many cells there are.
///
/// # Errors
/// Errors of [`isograd::distance::extend::forward`]; errors of the device.
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    attribute: Attribute<'_, T>,
    surface: Surface<'_, T>,
    region: impl Into<Region>,
) -> Result<(Extension<T>, Residual<T>), Error> {
    device.check_number::<T>()?;
    checks::samples(samples, attribute)?;
    let numbers = checks::Numbers::new(device, samples, attribute)?;
    let bounds = match region.into().bounds() {
        Ok(bounds) => bounds,
        Err(refused) => {
            refuse_numbers(device, &numbers)?;
            return Err(refused.into());
        }
    };
    checks::surface(surface)?;
    let near = cells::near(device, surface, bounds)?;
    let [bad, count, astray] = flags::totals(device, [&numbers.sums, &near.band, &near.astray])?;
    if bad > 0 {
        return Err(numbers.refuse(device)?);
    }
    if astray > 0 {
        return Err(checks::refuse_face(device, surface.closest, &near.astray)?);
    }
    let cells = flags::indices(device, &near.band, count)?;
    drop(near);
    let smallest_area = fits::smallest_area(device, samples.areas)?;
    let sorted = Sorted::new(device, samples, attribute, &smallest_area)?;
    let vertices = &surface.mesh.vertices;
    let fits = fits::forward(device, samples, &sorted, vertices)?;
    let at_vertices = fits::evaluate(device, &sorted, vertices, &fits)?;
    let components = attribute.components;
    let (barycentric, values) = cells::blend(device, surface, &cells, &at_vertices, components)?;
    let extension = Extension {
        components,
        vertices: at_vertices,
        cells,
        values,
    };
    let residual = Residual {
        fits,
        smallest_area,
        barycentric,
    };
    Ok((extension, residual))
}

/// Samples come first among what is refused.
fn refuse_numbers<R: Runtime, T: Scalar>(
    device: &Device<R>,
    numbers: &checks::Numbers<T>,
) -> Result<(), Error> {
    match flags::totals(device, [&numbers.sums])? {
        [0] => Ok(()),
        _ => Err(numbers.refuse(device)?),
    }
}
