//! The pullback: cells → faces → vertices → samples, each a gather in a fixed order.

use cubecl::prelude::Runtime;

use super::checks::{self, Given};
use super::neighbor::Sorted;
use super::{
    Attribute, Error, Extension, Residual, Samples, Surface, adjoint, cells_pullback,
    samples as of_samples,
};
use crate::primitives::fill::{add, zeros};
use crate::primitives::{flags, reduce};
use crate::{Buffer, Device, Scalar};

/// Cotangents of what an attribute was extended from.
#[derive(Clone, Debug)]
pub struct Cotangent<T> {
    /// `(N, components)` of the attribute, row by row, in the order of the samples.
    pub attribute: Buffer<T>,
    /// `(N, 3)` of the points, in that order.
    pub points: Buffer<T>,
    /// `(N,)` of the areas.
    pub areas: Buffer<T>,
    /// `(V, 3)` of the vertices of the surface.
    pub vertices: Buffer<T>,
    /// `(4,)` of the low corner of the grid and of its spacing, through the centers of the cells.
    pub grid: Buffer<T>,
    /// `(1,)` `R R̄` of the least radius `R`.
    pub radius: Buffer<T>,
    /// `(1,)` cells and vertices where a derivative does not exist or has no bound, and a bounded one was taken.
    pub guarded: Buffer<u32>,
}

/// Pulls cotangents of an extension back to everything it was made from. `vertices_bar` is `(V, components)` and
/// `values_bar` is `(B, components)`, row by row, finite; what is left out counts as zero. The other arguments are those
/// of the forward map and what it gave. Waits for the device, once, for its checks.
///
/// `a₀`, φ (which chooses the band) and the closest faces are held constant.
///
/// # Errors
/// Errors of [`isograd::distance::extend::pullback`]; errors of the device.
#[expect(clippy::too_many_arguments, reason = "inputs, outputs and cotangents")]
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    attribute: Attribute<'_, T>,
    surface: Surface<'_, T>,
    residual: &Residual<T>,
    extension: &Extension<T>,
    vertices_bar: Option<&Buffer<T>>,
    values_bar: Option<&Buffer<T>>,
) -> Result<Cotangent<T>, Error> {
    device.check_number::<T>()?;
    checks::samples(samples, attribute)?;
    let numbers = checks::Numbers::new(device, samples, attribute)?;
    checks::surface(surface)?;
    let given = Given {
        residual,
        extension,
        vertices_bar,
        values_bar,
    };
    given.lengths(attribute, surface)?;
    given.check(device, surface, &numbers)?;
    let bars = zeros(device, extension.vertices.len())?;
    if let Some(given) = vertices_bar {
        add(device, given, &bars)?;
    }
    let of_cells =
        cells_pullback::pullback(device, surface, residual, extension, values_bar, &bars)?;
    if surface.vertices() == 0 {
        return of_nothing(device, samples, attribute);
    }
    let sorted = Sorted::new(device, samples, attribute, &residual.smallest_area)?;
    let vertices = &surface.mesh.vertices;
    let vertices_bar = of_cells.vertices;
    let least = samples.radius;
    let adjoints = adjoint::pullback(
        device,
        &sorted,
        vertices,
        &given,
        least,
        &bars,
        &vertices_bar,
    )?;
    let found = of_samples::gather(device, &sorted, &adjoints)?;
    let mut guarded: Vec<&Buffer<u32>> = of_cells.guarded.iter().collect();
    guarded.extend([&adjoints.guarded, &found.guarded]);
    Ok(Cotangent {
        attribute: found.attribute,
        points: found.points,
        areas: found.areas,
        vertices: vertices_bar,
        grid: of_cells.grid,
        radius: reduce::sum(device, &adjoints.least)?,
        guarded: flags::sum_of_all(device, &guarded)?,
    })
}

/// Where there is no surface.
fn of_nothing<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    attribute: Attribute<'_, T>,
) -> Result<Cotangent<T>, Error> {
    let count = samples.areas.len();
    Ok(Cotangent {
        attribute: zeros(device, attribute.values.len())?,
        points: zeros(device, 3 * count)?,
        areas: zeros(device, count)?,
        vertices: device.empty(0)?,
        grid: zeros(device, 4)?,
        radius: zeros(device, 1)?,
        guarded: flags::sum_of_all(device, &[])?,
    })
}
