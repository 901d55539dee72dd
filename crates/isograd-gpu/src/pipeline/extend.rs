//! Attributes of the samples on the reconstructed surface and around it.

use cubecl::prelude::Runtime;
use isograd::distance::extend::Region;

use super::{Error, Reconstruction, Reconstructor};
use crate::Scalar;
use crate::distance::extend::{self, Attribute, Extension, Residual, Samples, Surface};

impl<R: Runtime, T: Scalar> Reconstructor<R, T> {
    /// An attribute of the samples of `result`, which this plan made, at the vertices of the surface, and at the
    /// closest surface point of every cell of a region; and what the pullback needs. See
    /// [`distance::extend`](crate::distance::extend). Cells outside the band that φ was computed in are left out.
    ///
    /// # Errors
    /// An attribute of another number of samples, values that are not finite, a band without width; those of the
    /// device.
    pub fn extend(
        &self,
        result: &Reconstruction<T>,
        attribute: Attribute<'_, T>,
        region: impl Into<Region>,
    ) -> Result<(Extension<T>, Residual<T>), Error> {
        let (samples, surface) = (result.extended_samples(), result.extended_surface());
        let device = self.device();
        Ok(extend::forward(
            device, samples, attribute, surface, region,
        )?)
    }
}

impl<T: Scalar> Reconstruction<T> {
    /// Whether the least radius of an extension is the cell size, as that is larger than the common radius.
    pub(crate) fn extends_within_cells(&self) -> bool {
        self.residuals.common_radius < self.residuals.distance.grid().spacing()
    }

    pub(super) fn extended_samples(&self) -> Samples<'_, T> {
        Samples {
            neighborhoods: &self.residuals.near,
            radius: match self.extends_within_cells() {
                true => self.residuals.distance.grid().spacing(),
                false => self.residuals.common_radius,
            },
            areas: &self.areas,
        }
    }

    pub(super) fn extended_surface(&self) -> Surface<'_, T> {
        let of_distance = &self.residuals.distance;
        Surface {
            mesh: of_distance.mesh(),
            grid: of_distance.grid(),
            phi: &self.sdf,
            closest: of_distance.closest(),
        }
    }
}
