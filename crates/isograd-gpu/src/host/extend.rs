//! Extended attributes on their way to a device and back.

use cubecl::prelude::Runtime;
use isograd::distance::extend::{Error as Refused, Extension, Fit, Region, Residual};
use isograd::{Attribute, ExtensionCotangent};

use super::Error;
use super::work::{upload, vectors_of};
use crate::distance::extend::{self, FIT};
use crate::pipeline::{self, Reconstruction, Reconstructor};
use crate::{Buffer, Device, Scalar};

/// [`Reconstructor::extend`] for arrays in the host's memory.
pub fn forward<R: Runtime, T: Scalar>(
    plan: &Reconstructor<R, T>,
    result: &Reconstruction<T>,
    attribute: &Attribute<T>,
    region: Region,
) -> Result<(Extension<T>, Residual<T>), Error> {
    let device = plan.device();
    let values = device.upload(&attribute.values)?;
    let given = extend::Attribute {
        values: &values,
        components: attribute.components,
    };
    let (found, kept) = plan.extend(result, given, region)?;
    let extension = Extension {
        components: found.components,
        shape: plan.grid().shape(),
        vertices: device.download(&found.vertices)?,
        cells: device.download(&found.cells)?,
        values: device.download(&found.values)?,
    };
    let residual = Residual {
        fits: fits_of(&device.download(&kept.fits)?),
        smallest_area: device.download(&kept.smallest_area)?[0].f64(),
        barycentric: vectors_of(&device.download(&kept.barycentric)?),
    };
    Ok((extension, residual))
}

fn fits_of<T: Scalar>(numbers: &[T]) -> Vec<Fit> {
    let rows = numbers.as_chunks::<FIT>().0.iter();
    let fit = |row: &[T; FIT]| {
        let [radius, weight, mx, my, mz, sx, sy, sz] = row.map(isograd::Real::f64);
        Fit {
            radius,
            weight,
            mean: [mx, my, mz],
            tilt: [sx, sy, sz],
        }
    };
    rows.map(fit).collect()
}

fn numbers_of<T: Scalar>(fits: &[Fit]) -> Vec<T> {
    let row = |fit: &Fit| {
        let [mx, my, mz] = fit.mean;
        let [sx, sy, sz] = fit.tilt;
        [fit.radius, fit.weight, mx, my, mz, sx, sy, sz].map(T::of)
    };
    fits.iter().flat_map(row).collect()
}

/// The arrays of one extension and its cotangents on the device.
pub struct Uploaded<T> {
    attribute: Buffer<T>,
    extension: extend::Extension<T>,
    residual: extend::Residual<T>,
    vertices: Option<Buffer<T>>,
    values: Option<Buffer<T>>,
}

impl<T: Scalar> Uploaded<T> {
    /// Uploads all of it.
    ///
    /// # Errors
    /// An extension over another grid than one of this `shape`; errors of the device.
    pub fn new<R: Runtime>(
        device: &Device<R>,
        shape: [usize; 3],
        of: &ExtensionCotangent<'_, T>,
    ) -> Result<Self, Error> {
        check_shape(of.extension.shape, shape)?;
        Ok(Self {
            attribute: device.upload(&of.attribute.values)?,
            extension: extend::Extension {
                components: of.extension.components,
                vertices: device.upload(&of.extension.vertices)?,
                cells: device.upload(&of.extension.cells)?,
                values: device.upload(&of.extension.values)?,
            },
            residual: extend::Residual {
                fits: device.upload(&numbers_of::<T>(&of.residual.fits))?,
                smallest_area: device.upload(&[T::of(of.residual.smallest_area)])?,
                barycentric: device.upload(of.residual.barycentric.as_flattened())?,
            },
            vertices: upload(device, of.vertices)?,
            values: upload(device, of.values)?,
        })
    }

    /// The uploaded arrays of `given` as a cotangent on the device.
    pub fn cotangent(
        &self,
        given: &ExtensionCotangent<'_, T>,
    ) -> pipeline::ExtensionCotangent<'_, T> {
        pipeline::ExtensionCotangent {
            attribute: extend::Attribute {
                values: &self.attribute,
                components: given.attribute.components,
            },
            extension: &self.extension,
            residual: &self.residual,
            vertices: self.vertices.as_ref(),
            values: self.values.as_ref(),
        }
    }
}

fn check_shape(found: [usize; 3], expected: [usize; 3]) -> Result<(), Refused> {
    let names = [
        "axis x of the extension",
        "axis y of the extension",
        "axis z of the extension",
    ];
    for axis in 0..3 {
        if found[axis] != expected[axis] {
            return Err(Refused::Mismatch {
                what: names[axis],
                length: found[axis],
                expected: expected[axis],
            });
        }
    }
    Ok(())
}
