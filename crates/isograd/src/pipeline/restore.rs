//! A reconstruction from arrays of known size, for callers that can keep nothing else between a forward and
//! its pullback.

use super::{Error, Pipeline, Reconstruction, Reconstructor};
use crate::data::PointCloud;
use crate::distance::NO_TRIANGLE;
use crate::{Real, orient};

/// The most expensive results, from which the others are recomputed: arrays with the length of the cloud or of the grid,
/// which are known before the computation.
#[derive(Clone, Copy, Debug)]
pub struct Saved<'a, T> {
    /// `(nx, ny, nz)` φ.
    pub sdf: &'a [T],
    /// `(nx, ny, nz)` closest faces.
    pub closest: &'a [u32],
    /// `(N, 3)` outward normals.
    pub normals: &'a [[T; 3]],
}

/// Errors of [`Reconstructor::restore`].
#[derive(Debug, thiserror::Error)]
pub enum RestoreError {
    /// An array is not that of a result of this plan and cloud.
    #[error(
        "the saved {what} has {found} entries and must have {expected}: it is that of another reconstruction"
    )]
    Length {
        /// The array.
        what: &'static str,
        /// Entries given.
        found: usize,
        /// Entries of this plan and cloud.
        expected: usize,
    },
    /// A cell's closest face is not in the mesh.
    #[error(
        "the saved closest faces are those of another reconstruction: the surface has {faces} faces"
    )]
    Face {
        /// Number of faces of the recomputed surface.
        faces: usize,
    },
    /// A recomputed stage failed.
    #[error(transparent)]
    Stage(#[from] Error),
}

impl<T: Pipeline> Reconstructor<T> {
    /// The reconstruction of `cloud` from saved results, with the same bits. All stages but orientation and distance are
    /// recomputed; none where the plan has this result already, as in an optimizer. The report and the confidence are empty
    /// if any was.
    ///
    /// # Errors
    /// As [`RestoreError`] lists.
    pub fn restore(
        &mut self,
        cloud: &PointCloud<T>,
        saved: &Saved<'_, T>,
    ) -> Result<&Reconstruction<T>, RestoreError> {
        T::rebuild(self, cloud, saved)?;
        Ok(&self.result)
    }

    /// [`Self::restore`], compiled where it is called: see [`concrete`](super::concrete).
    pub(crate) fn rebuild(
        &mut self,
        cloud: &PointCloud<T>,
        saved: &Saved<'_, T>,
    ) -> Result<(), RestoreError> {
        saved.check(self.grid().cells(), cloud.len())?;
        if self.is_whole && self.result.is_saved(cloud, saved) {
            return Ok(());
        }
        self.is_whole = false;
        let mut used = self.result.select(cloud, None);
        self.find_used(cloud, &mut used, None)?;
        let normals = self.result.selection.gather(saved.normals, 1);
        let orientation = &mut self.result.orientation;
        orientation.confidence.clear();
        orientation.normals = normals;
        self.splat(None)?;
        // The pullback needs residuals of the indicator before the local iso-value was subtracted.
        self.solve()?;
        self.isosurface()?;
        let Reconstruction { sdf, closest, .. } = &mut self.result;
        sdf.values_mut().copy_from_slice(saved.sdf);
        closest.clear();
        closest.extend_from_slice(saved.closest);
        let faces = self.result.closest_mesh().faces().len();
        if saved
            .closest
            .iter()
            .any(|&f| f != NO_TRIANGLE && f as usize >= faces)
        {
            return Err(RestoreError::Face { faces });
        }
        self.result.expand(cloud);
        self.is_whole = true;
        Ok(())
    }
}

impl<T: Real> Reconstruction<T> {
    /// Whether this is the result that `saved` is of, to the bit, and of the same points and given normals.
    fn is_saved(&self, cloud: &PointCloud<T>, saved: &Saved<'_, T>) -> bool {
        let is_given = |normals: &[[T; 3]]| {
            let used = self.selection.gather(normals, 1);
            have_same_bits(used.as_flattened(), self.given.as_flattened())
        };
        have_same_bits(self.points().as_flattened(), cloud.points().as_flattened())
            && (self.options.orient != orient::Method::Given
                || cloud.normals().is_some_and(is_given))
            && have_same_bits(self.normals().as_flattened(), saved.normals.as_flattened())
            && have_same_bits(self.sdf.values(), saved.sdf)
            && self.closest == saved.closest
    }
}

fn have_same_bits<T: Real>(a: &[T], b: &[T]) -> bool {
    let bits = |x: &T| x.f64().to_bits();
    a.iter().map(bits).eq(b.iter().map(bits))
}

impl<T> Saved<'_, T> {
    /// Checks the lengths, given the numbers of cells and points.
    ///
    /// # Errors
    /// [`RestoreError::Length`].
    pub fn check(&self, cells: usize, points: usize) -> Result<(), RestoreError> {
        let lengths = [
            ("φ", self.sdf.len(), cells),
            ("list of closest faces", self.closest.len(), cells),
            ("list of normals", self.normals.len(), points),
        ];
        match lengths
            .into_iter()
            .find(|(_, found, expected)| found != expected)
        {
            None => Ok(()),
            Some((what, found, expected)) => Err(RestoreError::Length {
                what,
                found,
                expected,
            }),
        }
    }
}
