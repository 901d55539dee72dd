//! Scratch buffers of the pullback.

use std::sync::Mutex;

use crate::data::{Field, GridCotangent};
use crate::distance::{extend, lattice};
use crate::isosurface::local_level;
use crate::neighbors::RadiiCotangent;
use crate::pipeline::Cotangent;
use crate::poisson::{self, screened};
use crate::splat::{self, SampleCotangent};
use crate::{Real, normals, refine};

/// Scratch buffers of the pullback: a field, an index for each cell whose φ has a cotangent, and some numbers
/// for each sample and each face.
#[derive(Default)]
pub struct PullbackScratch<T: Real> {
    /// Cotangent of `χ`, then of the right-hand side.
    pub(super) field: Option<Field<T>>,
    /// Cotangents of the vertices.
    pub(super) vertices: Vec<[T; 3]>,
    pub(in crate::pipeline) samples: SampleCotangent<T>,
    /// Cotangents of the moved samples.
    pub(in crate::pipeline) moved: Vec<[T; 3]>,
    pub(super) distance: lattice::PullbackScratch<T>,
    pub(super) extension: extend::Cotangent<T>,
    pub(super) poisson: poisson::Scratch<T>,
    pub(super) screened: screened::Scratch<T>,
    pub(super) level: local_level::PullbackScratch<T>,
    pub(super) level_bars: local_level::Cotangent<T>,
    pub(super) splat: splat::PullbackScratch<T>,
    pub(super) areas: splat::area::PullbackScratch<T>,
    pub(super) normals: normals::Scratch<T>,
    pub(super) refine: refine::PullbackScratch<T>,
    /// The normals before they were refined.
    pub(super) outward: Vec<[T; 3]>,
    pub(in crate::pipeline) radii: RadiiCotangent,
}

/// The scratch buffers that stay with a reconstruction between calls of [`Reconstruction::pullback_into`]. A call while
/// another one runs takes new ones.
#[derive(Default)]
pub(in crate::pipeline) struct Workspace<T: Real>(
    pub(super) Mutex<Option<Box<PullbackScratch<T>>>>,
);

impl<T: Real> Clone for Workspace<T> {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<T: Real> PullbackScratch<T> {
    /// Starts the sums at the cotangents of the caller.
    pub(super) fn start(&mut self, cotangent: &Cotangent<'_, T>, points: usize, vertices: usize) {
        let samples = &mut self.samples;
        samples.points.clear();
        samples.points.resize(points, [T::zero(); 3]);
        fill(
            &mut samples.normals,
            cotangent.normals,
            points,
            [T::zero(); 3],
        );
        fill(&mut samples.areas, cotangent.areas, points, T::zero());
        samples.grid = GridCotangent::default();
        self.radii.clear();
        fill(&mut self.vertices, None, vertices, [T::zero(); 3]);
    }

    /// Frees the scratch buffers of the stages that follow normals and areas.
    pub(super) fn free_indicator(&mut self) {
        self.field = None;
        self.poisson = poisson::Scratch::default();
        self.level = local_level::PullbackScratch::default();
        self.level_bars = local_level::Cotangent::default();
        self.splat = splat::PullbackScratch::default();
    }

    /// A field on the grid of `chi` with the given values, or zeros, in the memory of the last one.
    pub(super) fn take_field(&mut self, chi: &Field<T>, given: Option<&[T]>) -> Field<T> {
        let last = self.field.take().filter(|field| field.grid() == chi.grid());
        let mut field = last.unwrap_or_else(|| Field::zeros(*chi.grid()));
        match given {
            Some(given) => field.values_mut().copy_from_slice(given),
            None => field.values_mut().fill(T::zero()),
        }
        field
    }
}

/// Overwrites `out` with the given values, or with `n` zeros.
fn fill<E: Copy>(out: &mut Vec<E>, given: Option<&[E]>, n: usize, zero: E) {
    out.clear();
    match given {
        Some(given) => out.extend_from_slice(given),
        None => out.resize(n, zero),
    }
}
