//! How much a reconstruction keeps for its pullback.

use super::Reconstruction;
use crate::Real;

impl<T: Real> Reconstruction<T> {
    /// Bytes that are kept for the pullback beside φ, the mesh and the oriented normals: the indicator and the
    /// closest face of every cell, the edges of the vertices, the areas, and what the stages keep of the samples
    /// (search tree, radii, fitted planes, order).
    pub fn residual_bytes(&self) -> usize {
        let [[neighbours, _], [normals, _]] = self.of_samples();
        size_of_val(self.indicator.values())
            + size_of_val(self.closest.as_slice())
            + size_of_val(self.mesh.edges())
            + size_of_val(self.areas.as_slice())
            + size_of_val(self.residuals.splat.order.as_slice())
            + neighbours
            + normals
    }

    /// Bytes of work space that stays with the result, so that the next call of its plan need not take it again.
    pub fn work_bytes(&self) -> usize {
        let [[_, neighbours], [_, normals]] = self.of_samples();
        neighbours + normals
    }

    fn of_samples(&self) -> [[usize; 2]; 2] {
        let residuals = &self.residuals;
        [residuals.neighborhoods.bytes(), residuals.normals.bytes()]
    }
}
