//! Input and output of the pullback of the pipeline.

use crate::data::{Attribute, GridCotangent};
use crate::distance::extend;
use crate::parallel::{self, CHUNK};
use crate::{Real, poisson, vector};

/// Cotangents of the results of a reconstruction: derivatives of a scalar (a loss) with respect to each result.
/// `None` is zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cotangent<'a, T> {
    /// `(nx, ny, nz)` of φ, in memory order.
    pub sdf: Option<&'a [T]>,
    /// Of the indicator χ, in the shape of [the surface's grid](crate::Reconstruction::surface_grid); `None` if the solve
    /// was sparse.
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

/// Cotangents of one attribute that was [extended](crate::Reconstruction::extend_into).
#[derive(Clone, Copy, Debug)]
pub struct ExtensionCotangent<'a, T> {
    /// The attribute at the samples.
    pub attribute: &'a Attribute<T>,
    /// Its extension.
    pub extension: &'a extend::Extension<T>,
    /// The residual of the extension.
    pub residual: &'a extend::Residual<T>,
    /// `(V, components)` of the values at the vertices.
    pub vertices: Option<&'a [T]>,
    /// `(B, components)` of the values at the cells of the band.
    pub values: Option<&'a [T]>,
}

/// Cotangents of the input of a reconstruction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudCotangent<T> {
    /// `(N, 3)` of the points.
    pub points: Vec<[T; 3]>,
    /// `(N, 3)` of the given normals; empty if the normals were estimated.
    pub normals: Vec<[T; 3]>,
    /// Of each extended attribute, `(N, components)` row by row, in the order of
    /// [`Cotangent::extensions`].
    pub attributes: Vec<Vec<T>>,
    /// Of the grid, at fixed points.
    pub grid: GridCotangent<T>,
    /// Number of derivatives that do not exist, have no bound, or are larger than the number type can hold, and were
    /// replaced by a bounded one.
    pub guarded: usize,
}

/// Errors of [`Reconstruction::pullback`](crate::Reconstruction::pullback).
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
    /// A cotangent is NaN or infinite.
    #[error(
        "the cotangent of {what} is not finite at entry {index}; correct the function that computes it"
    )]
    NotFinite {
        /// The result.
        what: &'static str,
        /// The first such entry.
        index: usize,
    },
    /// The indicator of a sparse solve has no cotangent.
    #[error(
        "a cotangent of the indicator was given, and the solve was sparse; use the option solve = dense, or cotangents of other results"
    )]
    SparseIndicator,
    /// The residuals were not kept.
    #[error("the reconstruction was made with the option residuals = false; set it to true")]
    NoResiduals,
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
    /// Checks that every cotangent is finite and has the length of its result, given the numbers of cells of the grids of
    /// φ and of the surface, vertices of the surface and samples of the cloud.
    ///
    /// # Errors
    /// [`PullbackError::Length`], [`PullbackError::NotFinite`].
    pub fn check(
        &self,
        cells: [usize; 2],
        vertices: usize,
        samples: usize,
    ) -> Result<(), PullbackError> {
        check_numbers("φ", self.sdf, cells[0])?;
        check_numbers("the indicator", self.indicator, cells[1])?;
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
    let chunks = parallel::map_each(bar.chunks(CHUNK), |_, chunk| spoilt(chunk));
    let Some(chunk) = chunks.into_iter().position(|spoilt| spoilt) else {
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
