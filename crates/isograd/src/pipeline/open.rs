//! Open surfaces: the trimmed mesh, and the shell of a sheet.

use super::{Error, Reconstruction, Reconstructor};
use crate::data::{GridCotangent, Mesh};
use crate::distance::lattice;
use crate::isosurface::trim::{self, Nearby, Trim, Trimmed};
use crate::report::Warning;
use crate::sheet::{self, Shell};
use crate::{Real, vector};

/// The part of the surface that has samples nearby.
#[derive(Clone)]
pub(super) struct Open<T: Real> {
    trimmed: Trimmed<T>,
    /// With [`Options::sheet`](crate::Options).
    shell: Option<Shell<T>>,
}

impl<T: Real> Open<T> {
    /// The trimmed surface.
    pub(super) fn trimmed(&self) -> &Mesh<T> {
        &self.trimmed.mesh
    }

    /// The trimmed surface, of a sheet its shell.
    pub(super) fn mesh(&self) -> &Mesh<T> {
        self.shell.as_ref().map_or(&self.trimmed.mesh, Shell::mesh)
    }

    pub(super) fn is_sheet(&self) -> bool {
        self.shell.is_some()
    }
}

impl<T: Real> Reconstructor<T> {
    /// Trims the surface, and finds the shell of a sheet.
    pub(super) fn open(&mut self) -> Result<(), Error> {
        let result = &mut self.result;
        result.open = None;
        let trim = match (result.options.trim, result.options.sheet.thickness()) {
            (Trim::Off, Some(_)) => Trim::Auto,
            (trim, _) => trim,
        };
        let Some(distance) = trim.distance(result.sample_spacing()) else {
            return Ok(());
        };
        let nearby = Nearby {
            neighborhoods: &result.residuals.neighborhoods,
            distance,
            is_local: trim == Trim::Auto,
        };
        let trimmed = trim::forward(&result.mesh, nearby);
        if trimmed.mesh.faces().is_empty() {
            return Err(Error::Trimmed { distance });
        }
        result.report.trim = Some((distance, trimmed.removed));
        let grid = *result.indicator.grid();
        let shell = match result.options.sheet.thickness() {
            None => None,
            Some(thickness) => {
                let scratch = &mut self.scratch.distance;
                let (shell, found) = Shell::new(&trimmed.mesh, thickness, grid, scratch)?;
                let warnings = &mut result.report.warnings;
                warnings.retain(|warning| *warning != Warning::TouchesWall);
                warnings.extend(found.touches_wall.then_some(Warning::TouchesWall));
                let cells = thickness / grid.spacing().f64();
                warnings.extend((cells < 2.0).then_some(Warning::ThinSheet { cells }));
                Some(shell)
            }
        };
        result.open = Some(Box::new(Open { trimmed, shell }));
        Ok(())
    }
}

impl<T: Real> Reconstruction<T> {
    /// The mesh that φ is the distance to: of a sheet the trimmed one.
    pub(super) fn distance_mesh(&self) -> &Mesh<T> {
        match self.open.as_deref() {
            Some(open) if open.is_sheet() => &open.trimmed.mesh,
            _ => &self.mesh,
        }
    }

    /// The surface, in the cloud's coordinates: with [`Trim`] the part that has samples nearby, of a
    /// [sheet](crate::sheet) its closed shell.
    pub fn mesh(&self) -> &Mesh<T> {
        self.open.as_deref().map_or(&self.mesh, Open::mesh)
    }

    /// The mesh whose faces [`closest`](Self::closest) names, and whose vertices attributes are extended to: the surface
    /// before it was trimmed, of a [sheet](crate::sheet) its middle, else [`mesh`](Self::mesh).
    pub fn closest_mesh(&self) -> &Mesh<T> {
        self.distance_mesh()
    }

    /// Adds cotangents of the vertices of [`Self::distance_mesh`] to those of the whole surface.
    pub(super) fn pull_distance_mesh(&self, bars: &[[T; 3]], whole: &mut [[T; 3]]) {
        match self.open.as_deref() {
            Some(open) if open.is_sheet() => trim::pullback(&open.trimmed, bars, whole),
            _ => whole
                .iter_mut()
                .zip(bars)
                .for_each(|(sum, &bar)| *sum = vector::add(*sum, bar)),
        }
    }

    /// Adds cotangents of the vertices of [`Self::mesh`] to those of the whole surface. Returns the cotangent of the grid
    /// of the surface, and the number of derivatives that were bounded.
    pub(super) fn pull_mesh(
        &self,
        bars: &[[T; 3]],
        scratch: &mut lattice::PullbackScratch<T>,
        whole: &mut [[T; 3]],
    ) -> (GridCotangent<f64>, usize) {
        let nothing = (GridCotangent::default(), 0);
        let Some(Open { trimmed, shell }) = self.open.as_deref() else {
            whole.copy_from_slice(bars);
            return nothing;
        };
        let Some(shell) = shell else {
            trim::pullback(trimmed, bars, whole);
            return nothing;
        };
        let mut of_sheet = vec![[T::zero(); 3]; trimmed.mesh.vertices().len()];
        let found = shell.pullback(&trimmed.mesh, bars, scratch, &mut of_sheet);
        trim::pullback(trimmed, &of_sheet, whole);
        found
    }

    /// Adds the cotangents of the vertices of the whole surface for those of φ. Returns that of the grid of φ.
    pub(super) fn pull_sdf(
        &self,
        sdf_bar: &[T],
        scratch: &mut lattice::PullbackScratch<T>,
        whole: &mut [[T; 3]],
    ) -> GridCotangent<f64> {
        let (mesh, closest) = (self.distance_mesh(), &self.closest);
        if self.options.sheet.thickness().is_none() {
            return lattice::pullback(mesh, &self.sdf, closest, sdf_bar, scratch, whole);
        }
        let mut bars = vec![[T::zero(); 3]; mesh.vertices().len()];
        let grid = sheet::pullback(mesh, self.sdf.grid(), closest, sdf_bar, scratch, &mut bars);
        self.pull_distance_mesh(&bars, whole);
        grid
    }
}
