//! Outliers at the border of the pipeline: stages get the samples that are used, callers see all of them.

use super::{
    CloudCotangent, Cotangent, Error, ExtensionCotangent, Pipeline, Reconstruction, Reconstructor,
};
use crate::data::{Attribute, Outliers, PointCloud, Selection};
use crate::report::{Stage, Warning};
use crate::{Real, splat};

/// Results for all samples of a cloud, where some were left out: for these the normal, the confidence, the area and the
/// number of neighbors are 0.
#[derive(Clone)]
pub(super) struct AllSamples<T> {
    pub(super) points: Vec<[T; 3]>,
    pub(super) normals: Vec<[T; 3]>,
    pub(super) confidence: Vec<T>,
    pub(super) areas: Vec<T>,
    pub(super) counts: Vec<u32>,
}

impl Selection {
    /// An attribute of the samples that are used, from that of all. One of another length is returned as it is.
    pub fn attribute<T: Real>(&self, all: &Attribute<T>) -> Attribute<T> {
        let mut used = all.clone();
        if all.values.len() == self.samples() * all.components {
            used.values = self.gather(&all.values, all.components);
        }
        used
    }

    /// Pulls cotangents for all samples back by `pull`, which takes and returns those of the samples that are used. The
    /// others have the cotangent 0. The lengths in `cotangent` must have been checked.
    ///
    /// # Errors
    /// Errors of `pull`.
    pub fn pull<T: Real, E>(
        &self,
        cotangent: &Cotangent<'_, T>,
        pull: impl FnOnce(&Cotangent<'_, T>) -> Result<CloudCotangent<T>, E>,
    ) -> Result<CloudCotangent<T>, E> {
        let normals = cotangent.normals.map(|bar| self.gather(bar, 1));
        let areas = cotangent.areas.map(|bar| self.gather(bar, 1));
        let extended = cotangent.extensions.iter();
        let attributes: Vec<_> = extended.map(|of| self.attribute(of.attribute)).collect();
        let extensions = cotangent.extensions.iter().zip(&attributes);
        let extensions: Vec<_> = extensions
            .map(|(of, attribute)| ExtensionCotangent { attribute, ..*of })
            .collect();
        let mut bars = pull(&Cotangent {
            normals: normals.as_deref(),
            areas: areas.as_deref(),
            extensions: &extensions,
            ..*cotangent
        })?;
        let zero = [T::zero(); 3];
        bars.points = self.scatter(&bars.points, 1, zero);
        if !bars.normals.is_empty() {
            bars.normals = self.scatter(&bars.normals, 1, zero);
        }
        for (bar, of) in bars.attributes.iter_mut().zip(&attributes) {
            *bar = self.scatter(bar, of.components, T::zero());
        }
        Ok(bars)
    }

    /// Warning about the samples that are left out.
    pub fn warning(&self) -> Option<Warning> {
        let samples = self.left_out().len();
        (samples > 0).then_some(Warning::Outliers { samples })
    }

    /// The error with the number that its sample has in the whole cloud.
    pub(super) fn locate(&self, mut error: Error) -> Error {
        if let Error::Splat(
            splat::Error::Outside { index, .. } | splat::Error::NotFinite { index },
        ) = &mut error
        {
            for &left_out in self.left_out() {
                *index += usize::from(left_out as usize <= *index);
            }
        }
        error
    }
}

impl<T: Pipeline> Reconstructor<T> {
    /// Neighborhoods and axes of the samples that are used, and once more without [stray](crate::neighbors::Neighborhoods::strays)
    /// ones, which show in the neighborhoods. `used` is the cloud of the samples that are used, where some are left out.
    pub(super) fn find_used(
        &mut self,
        cloud: &PointCloud<T>,
        used: &mut Option<PointCloud<T>>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        let first = used.as_ref().unwrap_or(cloud);
        self.result.start(first);
        T::run(self, Stage::Normals, first, held)?;
        if held.is_some() || self.result.options.outliers == Outliers::Keep {
            return Ok(());
        }
        let strays = self.result.residuals.neighborhoods.strays();
        if strays.is_empty() {
            return Ok(());
        }
        self.result.selection.leave_out(&strays);
        *used = self.result.selection.used(cloud);
        let left = used.as_ref().unwrap_or(cloud);
        self.result.start(left);
        T::run(self, Stage::Normals, left, None)
    }
}

impl<T: Real> Reconstruction<T> {
    /// Selects the samples of a cloud, those of `held` if given, and returns them where some are left out.
    pub(super) fn select(
        &mut self,
        cloud: &PointCloud<T>,
        held: Option<&Self>,
    ) -> Option<PointCloud<T>> {
        self.all = None;
        self.selection = match held {
            Some(held) if held.selection.samples() == cloud.len() => held.selection.clone(),
            _ => self.options.outliers.select(cloud.points()),
        };
        self.selection.used(cloud)
    }

    /// Makes the results for all samples of `cloud`, where some were left out.
    pub(super) fn expand(&mut self, cloud: &PointCloud<T>) {
        let selection = &self.selection;
        if selection.is_all() {
            return;
        }
        let numbers = |used: &[T]| selection.scatter(used, 1, T::zero());
        let normals = &self.orientation.normals;
        self.all = Some(Box::new(AllSamples {
            points: cloud.points().to_vec(),
            normals: selection.scatter(normals, 1, [T::zero(); 3]),
            confidence: match self.orientation.confidence.is_empty() {
                true => Vec::new(),
                false => numbers(&self.orientation.confidence),
            },
            areas: numbers(&self.areas),
            counts: selection.scatter(&self.residuals.neighborhoods.count, 1, 0),
        }));
    }
}
