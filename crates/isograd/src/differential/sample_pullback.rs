//! The pullback of the quantities at arbitrary points.

use super::pullback::{PullbackScratch, add_gradient, check, check_cells, unit_pullback};
use super::sample::{Local, Place, check_points};
use super::{Differential, Error, mean_curvature_pullback};
use crate::data::Field;
use crate::gather::{add_to, bounded};
use crate::vector::{add, dot, scale, to_f64};
use crate::{Real, parallel};

/// Cotangents of the interpolated gradient and curvature at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointBars {
    /// Three of the gradient and one of the curvature.
    bar: [f64; 4],
    guarded: bool,
}

impl<T: Real> Differential<T> {
    /// Pulls cotangents of the result of [`at_points`](Self::at_points) back to `φ` and to the points. `phi` is the
    /// field that this was made of; `bar` has, for each of the `(N, 3)` points, the cotangents of gradient,
    /// normal and curvature. Adds into `phi_bar` `(cells,)` and `points_bar` `(N, 3)`; the latter is first extended
    /// to its length with zeros and may be empty. The same bits for any number of
    /// threads.
    ///
    /// The grid is held constant. At a point that passes from one cell-center cube to the next the derivative is
    /// that of the cube on the high side. Returns how many points and cells are guarded: where a gradient is 0 or
    /// a curvature at its bound, a cotangent that is not 0 is left out.
    ///
    /// # Errors
    /// A point outside the grid, another grid, and arrays of the wrong length; nothing is then written.
    pub fn pullback_at_points(
        &self,
        phi: &Field<T>,
        points: &[[T; 3]],
        bar: &[Local<T>],
        scratch: &mut PullbackScratch<T>,
        phi_bar: &mut [T],
        points_bar: &mut Vec<[T; 3]>,
    ) -> Result<usize, Error> {
        check_points(&self.grid, points)?;
        check(
            "the cotangent of the values at points",
            bar.len(),
            points.len(),
        )?;
        check_cells(phi, "the cotangent of the field", phi_bar.len())?;
        if phi.grid() != &self.grid {
            return Err(Error::Grid);
        }
        parallel::fill_large(&mut scratch.at_points, points.len(), &|i| {
            self.pull(points[i], &bar[i])
        });
        let at_points = &scratch.at_points;
        let mut guarded = parallel::count(at_points.len(), |i| at_points[i].guarded);
        points_bar.resize(points.len(), [T::zero(); 3]);
        guarded += add_to(points_bar, |i| self.slope(points[i], at_points[i].bar));
        guarded += self.spread(points, scratch);
        // Taken out while the rest of the scratch is in use.
        let (of_gradient, of_curvature) = (
            std::mem::take(&mut scratch.gradient),
            std::mem::take(&mut scratch.curvature),
        );
        guarded += add_gradient(&self.grid, &of_gradient, phi_bar);
        if bar.iter().any(|bar| bar.curvature != T::zero()) {
            guarded +=
                mean_curvature_pullback(phi, &self.options, &of_curvature, scratch, phi_bar)?;
        }
        (scratch.gradient, scratch.curvature) = (of_gradient, of_curvature);
        Ok(guarded)
    }

    /// The cotangent of the normal goes to the gradient at the point.
    fn pull(&self, point: [T; 3], bar: &Local<T>) -> PointBars {
        let gradient = self.at(point).unwrap_or_default().gradient;
        let through_normal = unit_pullback(to_f64(gradient), to_f64(bar.normal));
        let [x, y, z] = add(to_f64(bar.gradient), through_normal.unwrap_or_default());
        PointBars {
            bar: [x, y, z, bar.curvature.f64()],
            guarded: through_normal.is_none(),
        }
    }

    /// Cotangent of the point itself: through the weights of the eight cells.
    fn slope(&self, point: [T; 3], [x, y, z, curvature]: [f64; 4]) -> [f64; 3] {
        let place = Place::of(&self.grid, point);
        let sum = (0..8).fold([0.0; 3], |sum, corner| {
            let cell = self.grid.index(place.cell(corner));
            let of_weight = dot(to_f64(self.gradient[cell]), [x, y, z])
                + self.curvature[cell].f64() * curvature;
            add(sum, scale(place.slope(corner), of_weight))
        });
        scale(sum, 1.0 / self.grid.spacing().f64())
    }

    /// Writes the cotangents of gradient and curvature at every cell: each plane of cells adds up the points on
    /// either side of it, in their order. Returns how many numbers are out of range, and left out.
    fn spread(&self, points: &[[T; 3]], scratch: &mut PullbackScratch<T>) -> usize {
        let [nx, ny, nz] = self.grid.shape();
        let PullbackScratch {
            gradient,
            curvature,
            at_points,
            between,
            ..
        } = scratch;
        let place = |i: usize| Place::of(&self.grid, points[i]);
        between.fill(nx, points.len(), |i| [place(i).base[0] as u32]);
        let (at_points, between) = (&*at_points, &*between);
        gradient.resize(self.grid.cells(), [T::zero(); 3]);
        curvature.resize(self.grid.cells(), T::zero());
        let gradients = gradient.chunks_exact_mut(ny * nz);
        let planes = gradients.zip(curvature.chunks_exact_mut(ny * nz));
        let guarded =
            parallel::map_each_with(Vec::new, planes, |sums, i, (gradient, curvature)| {
                sums.clear();
                sums.resize(ny * nz, [0.0; 4]);
                for (side, base) in [(1, i.checked_sub(1)), (0, Some(i))] {
                    for &point in base.map_or(&[][..], |base| between.of(base)) {
                        let point = point as usize;
                        add_plane(&place(point), side, nz, at_points[point].bar, sums);
                    }
                }
                let mut guarded = 0;
                for (k, sum) in sums.iter().enumerate() {
                    let [x, y, z, c] = sum.map(|x| bounded(x, &mut guarded));
                    (gradient[k], curvature[k]) = ([x, y, z], c);
                }
                guarded
            });
        guarded.into_iter().sum()
    }
}

/// Adds what the four cells around a point that are in one plane get; `side` is 1 for the plane after its base.
fn add_plane(place: &Place, side: usize, nz: usize, bar: [f64; 4], sums: &mut [[f64; 4]]) {
    for corner in 4 * side..4 * side + 4 {
        let [_, j, k] = place.cell(corner);
        let weight = place.weight(corner);
        for (sum, bar) in sums[j * nz + k].iter_mut().zip(bar) {
            *sum += weight * bar;
        }
    }
}
