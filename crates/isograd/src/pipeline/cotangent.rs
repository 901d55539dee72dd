//! What goes into a pullback of the pipeline, and what comes out.

use rayon::prelude::*;

use super::Reconstruction;
use crate::data::{Attribute, GridCotangent, PointCloud};
use crate::distance::extend;
use crate::parallel::CHUNK;
use crate::{Real, poisson, vector};

/// Cotangents of the results of a reconstruction: by how much a scalar (a loss) changes, a unit of each
/// result. What is left out counts as zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cotangent<'a, T> {
    /// `(nx, ny, nz)` of φ, in memory order.
    pub sdf: Option<&'a [T]>,
    /// `(nx, ny, nz)` of the indicator χ.
    pub indicator: Option<&'a [T]>,
    /// Of the iso-value `c`.
    pub iso_value: T,
    /// `(V, 3)` of the vertices of the mesh.
    pub vertices: Option<&'a [[T; 3]]>,
    /// `(N, 3)` of the outward normals of the samples.
    pub normals: Option<&'a [[T; 3]]>,
    /// `(N,)` of the areas of the samples.
    pub areas: Option<&'a [T]>,
    /// Of attributes extended from the samples.
    pub extensions: &'a [ExtensionCotangent<'a, T>],
}

/// Cotangents of one attribute that was [extended](Reconstruction::extend_into).
#[derive(Clone, Copy, Debug)]
pub struct ExtensionCotangent<'a, T> {
    /// The attribute, as it was given.
    pub attribute: &'a Attribute<T>,
    /// What came out.
    pub extension: &'a extend::Extension<T>,
    /// What was kept for this.
    pub residual: &'a extend::Residual<T>,
    /// `(V, components)` of the values at the vertices.
    pub vertices: Option<&'a [T]>,
    /// `(B, components)` of the values at the cells of the band.
    pub values: Option<&'a [T]>,
}

/// Cotangents of what a reconstruction was made from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudCotangent<T> {
    /// `(N, 3)` of the points.
    pub points: Vec<[T; 3]>,
    /// `(N, 3)` of the given normals; empty where the normals were found.
    pub normals: Vec<[T; 3]>,
    /// Of each extended attribute, `(N, components)` row by row, in the order of
    /// [`Cotangent::extensions`].
    pub attributes: Vec<Vec<T>>,
    /// Of the grid, at fixed points.
    pub grid: GridCotangent<T>,
    /// Places where a derivative does not exist or has no bound, and a bounded one was taken.
    pub guarded: usize,
}

/// Why nothing was pulled back.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PullbackError {
    /// An array has the wrong length.
    #[error(
        "the cotangent of {what} has {length} entries and must have {expected}: one for each entry of the result"
    )]
    Length {
        /// The result.
        what: &'static str,
        /// Entries given.
        length: usize,
        /// Entries of the result.
        expected: usize,
    },
    /// The cloud is another one.
    #[error(
        "the cloud is not the one that was reconstructed ({found} points, not {expected}, or other coordinates); give the same one"
    )]
    Cloud {
        /// Points given.
        found: usize,
        /// Points reconstructed.
        expected: usize,
    },
    /// A cotangent is NaN or infinite.
    #[error(
        "the cotangent of {what} is not finite at entry {index}; mend the function that it comes from"
    )]
    NotFinite {
        /// The result.
        what: &'static str,
        /// The first such entry.
        index: usize,
    },
    /// An extended attribute.
    #[error(transparent)]
    Extension(#[from] extend::Error),
    /// The adjoint solve.
    #[error(transparent)]
    Poisson(#[from] poisson::Error),
    /// The adjoint solve of the screened equation.
    #[error(transparent)]
    Screened(#[from] poisson::screened::Error),
}

impl<T: Real> Cotangent<'_, T> {
    /// Whether every cotangent has the length of its result, on a grid of so many cells, a surface of so many
    /// vertices and a cloud of so many samples, and is finite.
    ///
    /// # Errors
    /// [`PullbackError::Length`], [`PullbackError::NotFinite`].
    pub fn check(
        &self,
        cells: usize,
        vertices: usize,
        samples: usize,
    ) -> Result<(), PullbackError> {
        check_numbers("φ", self.sdf, cells)?;
        check_numbers("the indicator", self.indicator, cells)?;
        check_numbers("the iso-value", Some(&[self.iso_value]), 1)?;
        check_vectors("the vertices", self.vertices, vertices)?;
        check_vectors("the normals", self.normals, samples)?;
        check_numbers("the areas", self.areas, samples)?;
        for ExtensionCotangent {
            extension,
            vertices,
            values,
            ..
        } in self.extensions
        {
            let (at_vertices, in_band) = (extension.vertices.len(), extension.values.len());
            check_numbers("an attribute at the vertices", *vertices, at_vertices)?;
            check_numbers("an attribute in the band", *values, in_band)?;
        }
        Ok(())
    }

    /// Whether anything beyond the normals and areas of the samples has a cotangent.
    pub(super) fn reaches_indicator(&self) -> bool {
        let fields = self.sdf.is_some() || self.indicator.is_some();
        fields
            || self.vertices.is_some()
            || !self.extensions.is_empty()
            || self.iso_value != T::zero()
    }
}

impl<T: Real> Reconstruction<T> {
    /// Whether the cloud is the one that was reconstructed, to the bit.
    pub(super) fn check_cloud(&self, cloud: &PointCloud<T>) -> Result<(), PullbackError> {
        let index = &self.residuals.neighborhoods.index;
        let (found, expected) = (cloud.len(), index.len());
        let order = index.order().par_iter().enumerate();
        let same = found == expected
            && order
                .map(|(position, &i)| cloud.points()[i as usize] == index.point(position))
                .reduce(|| true, |a, b| a && b);
        match same {
            true => Ok(()),
            false => Err(PullbackError::Cloud { found, expected }),
        }
    }
}

fn check_numbers<T: Real>(
    what: &'static str,
    bar: Option<&[T]>,
    expected: usize,
) -> Result<(), PullbackError> {
    check(what, bar, expected, |x| x.is_finite())
}

fn check_vectors<T: Real>(
    what: &'static str,
    bar: Option<&[[T; 3]]>,
    expected: usize,
) -> Result<(), PullbackError> {
    check(what, bar, expected, |&x| vector::is_finite(x))
}

fn check<E: Sync>(
    what: &'static str,
    bar: Option<&[E]>,
    expected: usize,
    finite: impl Fn(&E) -> bool + Sync,
) -> Result<(), PullbackError> {
    let Some(bar) = bar else { return Ok(()) };
    if bar.len() != expected {
        let length = bar.len();
        return Err(PullbackError::Length {
            what,
            length,
            expected,
        });
    }
    // A chunk at a time, whose loop has no branch: all numbers are finite as a rule.
    let spoilt = |chunk: &[E]| chunk.iter().fold(false, |spoilt, x| spoilt | !finite(x));
    let Some(chunk) = bar.par_chunks(CHUNK).position_first(spoilt) else {
        return Ok(());
    };
    let start = chunk * CHUNK;
    match bar[start..].iter().position(|x| !finite(x)) {
        Some(index) => Err(PullbackError::NotFinite {
            what,
            index: start + index,
        }),
        None => Ok(()),
    }
}
