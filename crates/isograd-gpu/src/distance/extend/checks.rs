//! Whether what is given fits together.

use cubecl::prelude::*;

use super::cpu::Error as Refused;
use super::{Attribute, Error, Extension, FIT, Residual, Samples, Surface};
use crate::device::{check_length, launch};
use crate::grid::check_field;
use crate::primitives::flags;
use crate::primitives::scan::exclusive_sum;
use crate::vector::is_finite;
use crate::{Buffer, Device, Scalar};

/// Lengths of the samples' arrays.
pub(super) fn samples<T>(
    samples: Samples<'_, T>,
    attribute: Attribute<'_, T>,
) -> Result<(), Refused> {
    let (count, areas) = (samples.neighborhoods.len(), samples.areas.len());
    let (values, components) = (attribute.values.len(), attribute.components);
    if areas == count && count.checked_mul(components) == Some(values) && values > 0 {
        return Ok(());
    }
    Err(Refused::Samples {
        samples: count,
        areas,
        values,
        components,
    })
}

/// Lengths of the surface's arrays.
pub(super) fn surface<T: Scalar>(surface: Surface<'_, T>) -> Result<(), Error> {
    let (mesh, cells) = (surface.mesh, surface.grid.cells());
    check_length(
        "the array of vertices",
        &mesh.vertices,
        3 * surface.vertices(),
    )?;
    check_length("the array of faces", &mesh.faces, 3 * surface.faces())?;
    check_field("the array of φ", surface.phi, surface.grid)?;
    let entries = surface.closest.len();
    if entries != cells {
        return Err(Refused::Closest { entries, cells }.into());
    }
    Ok(())
}

/// Values and areas of the samples, whose bad ones are looked for on the device.
pub(super) struct Numbers<T> {
    areas: Buffer<T>,
    /// `(2N,)` 1 where a value, then where an area can't be.
    bad: Buffer<u32>,
    /// Exclusive sums of that.
    pub sums: Buffer<u32>,
}

impl<T: Scalar> Numbers<T> {
    pub fn new<R: Runtime>(
        device: &Device<R>,
        samples: Samples<'_, T>,
        attribute: Attribute<'_, T>,
    ) -> Result<Self, Error> {
        let count = samples.areas.len();
        let bad = device.empty(2 * count)?;
        launch!(device, count => flag_samples<T>(
            attribute.values, samples.areas, bad, attribute.components as u32,
        ));
        Ok(Self {
            areas: samples.areas.clone(),
            sums: exclusive_sum(device, &bad)?,
            bad,
        })
    }

    /// The first that is bad, once it is known that there is one.
    pub fn refuse<R: Runtime>(&self, device: &Device<R>) -> Result<Error, Error> {
        let count = self.areas.len();
        let first = flags::first(device, &self.bad)?.unwrap_or_default();
        if first < count {
            return Ok(Refused::NotFinite { sample: first }.into());
        }
        let sample = first - count;
        let area = device.download(&self.areas)?[sample].f64();
        Ok(Refused::Area { sample, area }.into())
    }
}

/// The face that the first of the cells is closest to whose face the surface does not have; `astray` are exclusive
/// sums of flags of such cells.
pub(super) fn refuse_face<R: Runtime>(
    device: &Device<R>,
    closest: &Buffer<u32>,
    astray: &Buffer<u32>,
) -> Result<Error, Error> {
    let first = flags::indices(device, astray, closest.len())?;
    let cell = device.download(&first)?[0] as usize;
    let face = device.download(closest)?[cell];
    Ok(Refused::Face { face }.into())
}

/// Further inputs of the pullback.
pub(super) struct Given<'a, T> {
    pub residual: &'a Residual<T>,
    pub extension: &'a Extension<T>,
    pub vertices_bar: Option<&'a Buffer<T>>,
    pub values_bar: Option<&'a Buffer<T>>,
}

impl<T: Scalar> Given<'_, T> {
    /// Lengths of all arrays.
    pub fn lengths(
        &self,
        attribute: Attribute<'_, T>,
        surface: Surface<'_, T>,
    ) -> Result<(), Refused> {
        let (residual, extension) = (self.residual, self.extension);
        let (components, band) = (attribute.components, extension.cells.len());
        let (vertices, weights) = (surface.vertices(), residual.barycentric.len());
        let (at_vertices, at_cells) = (vertices * components, band * components);
        let (of_vertices, of_cells) = (extension.vertices.len(), extension.values.len());
        let vertices_bar = self.vertices_bar.map_or(at_vertices, Buffer::len);
        let values_bar = self.values_bar.map_or(at_cells, Buffer::len);
        let lengths = [
            ("a value of the extension", extension.components, components),
            ("the list of fits", residual.fits.len(), FIT * vertices),
            ("the smallest area", residual.smallest_area.len(), 1),
            ("the list of barycentric weights", weights, 3 * band),
            ("the list of values at vertices", of_vertices, at_vertices),
            ("the list of values at cells", of_cells, at_cells),
            ("the cotangent of the vertices", vertices_bar, at_vertices),
            ("the cotangent of the values", values_bar, at_cells),
        ];
        match lengths.into_iter().find(|(_, a, b)| a != b) {
            Some((what, length, expected)) => Err(Refused::Mismatch {
                what,
                length,
                expected,
            }),
            None => Ok(()),
        }
    }

    /// Whether all listed cells and their closest faces are there, and the numbers of the samples too. Waits.
    pub fn check<R: Runtime>(
        &self,
        device: &Device<R>,
        surface: Surface<'_, T>,
        numbers: &Numbers<T>,
    ) -> Result<(), Error> {
        let cells = &self.extension.cells;
        let bad = device.empty(2 * cells.len())?;
        launch!(device, cells.len() => flag_listed(
            cells, surface.closest, bad, cells.len() as u32, surface.grid.cells() as u32,
            surface.faces() as u32,
        ));
        let sums = exclusive_sum(device, &bad)?;
        let [samples, listed] = flags::totals(device, [&numbers.sums, &sums])?;
        if samples > 0 {
            return Err(numbers.refuse(device)?);
        }
        if listed == 0 {
            return Ok(());
        }
        let first = flags::first(device, &bad)?.unwrap_or_default();
        let listed = device.download(cells)?;
        let cell = listed[first % cells.len()];
        if first < cells.len() {
            let cells = surface.grid.cells();
            return Err(Refused::Cell { cell, cells }.into());
        }
        let face = device.download(surface.closest)?[cell as usize];
        Err(Refused::Face { face }.into())
    }
}

#[cube(launch)]
fn flag_samples<F: Float>(
    values: &Array<F>,
    areas: &Array<F>,
    bad: &mut Array<u32>,
    components: u32,
) {
    let count = areas.len();
    if ABSOLUTE_POS < count {
        let mut spoilt = 0u32.runtime();
        for c in 0..components as usize {
            if !is_finite::<F>(values[ABSOLUTE_POS * components as usize + c]) {
                spoilt = 1u32;
            }
        }
        let area = areas[ABSOLUTE_POS];
        let can_be = area >= F::new(0.0) && is_finite::<F>(area);
        bad[ABSOLUTE_POS] = spoilt;
        bad[count + ABSOLUTE_POS] = select(can_be, 0u32, 1u32);
    }
}

/// Cells that the grid does not have, then those whose face the surface does not have.
#[cube(launch)]
fn flag_listed(
    listed: &Array<u32>,
    closest: &Array<u32>,
    bad: &mut Array<u32>,
    count: u32,
    cells: u32,
    faces: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let cell = listed[ABSOLUTE_POS];
        let is_there = cell < cells;
        let face = closest[select(is_there, cell, 0u32) as usize];
        bad[ABSOLUTE_POS] = select(is_there, 0u32, 1u32);
        bad[count as usize + ABSOLUTE_POS] = select(is_there && face >= faces, 1u32, 0u32);
    }
}
