//! Attributes of the samples on the reconstructed surface and around it.

use std::borrow::Cow;

use super::{Pipeline, Reconstruction};
use crate::data::{Attribute, PointCloud};
use crate::distance::extend::{Error, Extension, Region, Residual, Samples, Scratch, Surface};
use crate::{Real, distance};

impl<T: Pipeline> Reconstruction<T> {
    /// The attribute `name` of the cloud at the vertices of the surface, and at the closest surface point of every cell
    /// of a region: a number is the width of a [band](Region::Band), in the unit of the points. See
    /// [`distance::extend`](crate::distance::extend). Cells outside the band that φ was computed in are left out.
    ///
    /// # Errors
    /// [`Error::Missing`], a cloud of another size than the one reconstructed, values that are not finite, a
    /// band without width.
    pub fn extend(
        &self,
        cloud: &PointCloud<T>,
        name: &str,
        region: impl Into<Region>,
    ) -> Result<Extension<T>, Error> {
        let attribute = distance::extend::attribute(cloud, name)?;
        Ok(self.extend_with_residual(attribute, region)?.0)
    }

    /// Like [`extend`](Self::extend), for an attribute of the reconstructed samples, with the residual for the pullback.
    ///
    /// # Errors
    /// As [`extend`](Self::extend).
    pub fn extend_with_residual(
        &self,
        attribute: &Attribute<T>,
        region: impl Into<Region>,
    ) -> Result<(Extension<T>, Residual<T>), Error> {
        let (mut residual, mut extension) = (Residual::default(), Extension::default());
        let scratch = &mut Scratch::default();
        self.extend_into(attribute, region, scratch, &mut residual, &mut extension)?;
        Ok((extension, residual))
    }

    /// Like [`extend_with_residual`](Self::extend_with_residual), writing into `residual` and `extension`.
    ///
    /// # Errors
    /// As [`extend`](Self::extend); the outputs are then not to be used.
    pub fn extend_into(
        &self,
        attribute: &Attribute<T>,
        region: impl Into<Region>,
        scratch: &mut Scratch,
        residual: &mut Residual<T>,
        extension: &mut Extension<T>,
    ) -> Result<(), Error> {
        T::extend(self, attribute, region.into(), scratch, residual, extension)
    }

    /// An attribute of the reconstructed samples at the vertices of [`mesh`](Self::mesh): `(V, components)`, row by row.
    /// Unlike [`extend`](Self::extend) also for a trimmed mesh and for the shell of a sheet.
    ///
    /// # Errors
    /// As [`extend`](Self::extend).
    pub fn vertex_values(&self, attribute: &Attribute<T>) -> Result<Vec<T>, Error> {
        T::vertex_values(self, attribute)
    }
}

impl<T: Real> Reconstruction<T> {
    /// [`extend_into`](Self::extend_into).
    pub(super) fn extend_selected(
        &self,
        attribute: &Attribute<T>,
        region: Region,
        scratch: &mut Scratch,
        residual: &mut Residual<T>,
        extension: &mut Extension<T>,
    ) -> Result<(), Error> {
        distance::extend::forward(
            self.samples(),
            &self.of_samples(attribute),
            self.surface(),
            region,
            scratch,
            residual,
            extension,
        )
    }

    /// [`vertex_values`](Self::vertex_values).
    pub(super) fn selected_at_vertices(&self, attribute: &Attribute<T>) -> Result<Vec<T>, Error> {
        let attribute = self.of_samples(attribute);
        distance::extend::at_vertices(self.samples(), &attribute, self.mesh())
    }

    /// An attribute of the cloud at the reconstructed samples, without outliers.
    fn of_samples<'a>(&self, attribute: &'a Attribute<T>) -> Cow<'a, Attribute<T>> {
        match self.selection.is_all() {
            true => Cow::Borrowed(attribute),
            false => Cow::Owned(self.selection.attribute(attribute)),
        }
    }

    /// Whether the least radius of an extension is the cell size of the surface, as that is larger than the common radius:
    /// so samples closer together than its vertices are not passed over.
    pub(super) fn extends_within_cells(&self) -> bool {
        self.residuals.neighborhoods.common_radius < self.surface_grid().spacing()
    }

    pub(super) fn samples(&self) -> Samples<'_, T> {
        Samples {
            neighborhoods: &self.residuals.neighborhoods,
            radius: match self.extends_within_cells() {
                true => self.surface_grid().spacing(),
                false => self.residuals.neighborhoods.common_radius,
            },
            areas: &self.areas,
        }
    }

    pub(super) fn surface(&self) -> Surface<'_, T> {
        Surface {
            mesh: self.distance_mesh(),
            phi: &self.sdf,
            closest: &self.closest,
        }
    }
}
