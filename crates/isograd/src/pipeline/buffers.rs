//! Scratch buffers and residuals of the stages, and when they are freed.

use std::sync::Arc;

use super::{Reconstruction, Stage};
use crate::isosurface::{iso_value, local_level, measure};
use crate::thicken::Thickened;
use crate::{Real, distance, isosurface, neighbors, normals, orient, poisson, refine, splat};

/// Scratch buffers of the stages, reused between calls.
#[derive(Default)]
pub(super) struct Scratch<T: Real> {
    pub orient: orient::Scratch,
    pub refine: refine::Scratch<T>,
    pub splat: splat::Scratch,
    pub poisson: poisson::Scratch<T>,
    pub screened: poisson::screened::Scratch<T>,
    pub level: local_level::Scratch<T>,
    pub isosurface: isosurface::Scratch,
    pub measure: measure::Scratch,
    pub distance: distance::Scratch<T>,
}

impl<T: Real> Scratch<T> {
    /// Frees all that the stages after `stage` do not read.
    pub fn free(&mut self, stage: Stage) {
        let Self {
            mut orient,
            mut distance,
            ..
        } = std::mem::take(self);
        orient.free();
        self.orient = orient;
        if stage == Stage::Distance {
            distance.free_all_but_tree();
            self.distance = distance;
        }
    }
}

/// Residuals of the stages, beside the results themselves.
#[derive(Clone, Default)]
pub(super) struct Residuals<T> {
    pub neighborhoods: neighbors::Neighborhoods<T>,
    pub normals: normals::Residual<T>,
    pub splat: splat::Residual,
    /// `σ` of the smoothing, in cells.
    pub smoothing: f64,
    /// Whether the surface is that of the indicator on cells half as large.
    pub is_refined: bool,
    pub iso_value: iso_value::Residual<T>,
    /// Trilinear values of the indicator at the samples, of a screened equation whose surface is refined: `iso_value`
    /// then holds those of the spline.
    pub screened: Option<iso_value::Residual<T>>,
    pub local_level: local_level::Residual<T>,
    pub thickened: Thickened<T>,
}

impl<T: Real> Reconstruction<T> {
    /// Frees the residuals that no stage after `stage` reads, if they are not to be kept.
    pub(super) fn free_residuals(&mut self, stage: Stage) {
        if self.options.residuals {
            return;
        }
        match stage {
            Stage::Orient => {
                self.given = Arc::default();
                self.residuals.normals = normals::Residual::default();
            }
            Stage::Poisson => {
                let residuals = std::mem::take(&mut self.residuals);
                self.residuals = Residuals {
                    neighborhoods: residuals.neighborhoods,
                    smoothing: residuals.smoothing,
                    is_refined: residuals.is_refined,
                    ..Residuals::default()
                };
            }
            _ => {}
        }
    }
}
