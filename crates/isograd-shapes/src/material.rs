//! Material points at fixed surface coordinates: positions, normals, and the pullback of the map from
//! parameters to points.

use isograd::Real;
use isograd_element::vector::of_f64;
use rayon::prelude::*;

use crate::jet::{Jet, SLOTS, values};
use crate::kind::ShapeError;
use crate::shape::{Shape, SurfaceCoordinate, evaluate};
use crate::surface::Surface;

/// Points per task, fixed so that sums have the same bits for any number of threads.
const CHUNK: usize = 2048;

impl Shape {
    /// `(N, 3)` points at `(N,)` surface coordinates, with the current parameters. Computed in double precision
    /// and rounded once.
    ///
    /// # Errors
    /// A coordinate on a patch that the shape does not have.
    pub fn points_at<T: Real>(
        &self,
        coordinates: &[SurfaceCoordinate],
    ) -> Result<Vec<[T; 3]>, ShapeError> {
        self.check_coordinates(coordinates)?;
        let point = |c: &SurfaceCoordinate| of_f64(values(at(&*self.surface, c)));
        Ok(coordinates.par_iter().map(point).collect())
    }

    /// `(N, 3)` outward unit normals at `(N,)` surface coordinates; zero where the map from the square to the
    /// surface is degenerate, which it is not at [sampled](Shape::sample) coordinates.
    pub fn normals_at<T: Real>(
        &self,
        coordinates: &[SurfaceCoordinate],
    ) -> Result<Vec<[T; 3]>, ShapeError> {
        self.check_coordinates(coordinates)?;
        let normal = |c: &SurfaceCoordinate| {
            let point = evaluate(&*self.surface, c.patch as usize, c.u, c.v);
            of_f64(point.normal().unwrap_or_default())
        };
        Ok(coordinates.par_iter().map(normal).collect())
    }

    /// Cotangents of all parameters, in the order of [`Shape::values`], from those of the points at fixed
    /// surface coordinates: `p̄ = Σ_i x̄_i · ∂x_i/∂p`, in the cotangents' unit per unit of the parameter.
    ///
    /// Not differentiable: which samples of a union are inside another part, and integer parameters (their
    /// cotangent is zero).
    ///
    /// # Errors
    /// Different numbers of cotangents and coordinates; a coordinate on a patch that the shape does not have.
    pub fn pullback<T: Real>(
        &self,
        coordinates: &[SurfaceCoordinate],
        points_bar: &[[T; 3]],
    ) -> Result<Vec<f64>, ShapeError> {
        let all: Vec<usize> = (0..self.values().len()).collect();
        self.pullback_of(&all, coordinates, points_bar)
    }

    /// Like [`Shape::pullback`], for the parameters at the given indices of [`Shape::values`] only; the time is
    /// proportional to their number.
    ///
    /// # Errors
    /// As [`Shape::pullback`]. The cotangent of an index out of range is zero.
    pub fn pullback_of<T: Real>(
        &self,
        parameters: &[usize],
        coordinates: &[SurfaceCoordinate],
        points_bar: &[[T; 3]],
    ) -> Result<Vec<f64>, ShapeError> {
        if points_bar.len() != coordinates.len() {
            return Err(ShapeError::Cotangents {
                cotangents: points_bar.len(),
                coordinates: coordinates.len(),
            });
        }
        self.check_coordinates(coordinates)?;
        let mut cotangents = vec![0.0; parameters.len()];
        let differentiable = |&i: &usize| self.is_differentiable(parameters[i]);
        let outputs: Vec<usize> = (0..parameters.len()).filter(differentiable).collect();
        // One pass over the points for as many parameters as a jet has slots.
        for group in outputs.chunks(SLOTS) {
            let surface = self.with_slots(group.iter().map(|&i| parameters[i]))?;
            let sums = pulled_back(&*surface, coordinates, points_bar);
            for (&i, sum) in group.iter().zip(sums) {
                cotangents[i] = sum;
            }
        }
        Ok(cotangents)
    }

    fn check_coordinates(&self, coordinates: &[SurfaceCoordinate]) -> Result<(), ShapeError> {
        let patches = self.patches();
        match coordinates.iter().position(|c| c.patch as usize >= patches) {
            None => Ok(()),
            Some(index) => Err(ShapeError::Coordinate {
                shape: self.name(),
                index,
                patch: coordinates[index].patch,
                patches,
            }),
        }
    }
}

/// The point at a coordinate, with its derivatives in the parameters of the surface.
pub(crate) fn at(surface: &dyn Surface, c: &SurfaceCoordinate) -> [Jet; 3] {
    surface.map(c.patch as usize, Jet::constant(c.u), Jet::constant(c.v))
}

/// `Σ_i x̄_i · ∂x_i/∂(slot)` for every slot, summed in a fixed order.
fn pulled_back<T: Real>(
    surface: &dyn Surface,
    coordinates: &[SurfaceCoordinate],
    points_bar: &[[T; 3]],
) -> [f64; SLOTS] {
    let add = |sums: &mut [f64; SLOTS], (c, bar): (&SurfaceCoordinate, &[T; 3])| {
        for (x, bar) in at(surface, c).iter().zip(bar) {
            for (sum, slope) in sums.iter_mut().zip(x.slope) {
                *sum += bar.f64() * slope;
            }
        }
    };
    let chunks = coordinates
        .par_chunks(CHUNK)
        .zip(points_bar.par_chunks(CHUNK));
    let partial: Vec<[f64; SLOTS]> = chunks
        .map(|(coordinates, bars)| {
            let mut sums = [0.0; SLOTS];
            for pair in coordinates.iter().zip(bars) {
                add(&mut sums, pair);
            }
            sums
        })
        .collect();
    let mut total = [0.0; SLOTS];
    for part in partial {
        for (sum, term) in total.iter_mut().zip(part) {
            *sum += term;
        }
    }
    total
}
