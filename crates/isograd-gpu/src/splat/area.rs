//! The area of surface that each sample stands for.
//!
//! # Map
//! [`Neighborhoods`] → `a_i = 1 / Σ_{j∈N_i} K(r_j)`, as on the page of [`isograd::splat::area`], and 0 for
//! isolated samples: those with a grown radius of whose neighbors fewer than 1 in 8 have them as theirs.
//!
//! # Residual
//! [`Residual`]: the areas and the neighborhoods.
//!
//! # Pullback
//! As printed there; [`pullback`] gathers, with the radius of each center.
//!
//! # Not differentiable
//! The isolated samples are held constant.

use cubecl::prelude::*;

use crate::device::{check_length, launch};
use crate::element::plane;
use crate::neighbors::{
    NeighborhoodArrays, Neighborhoods, end_of_leaf, first_of_leaf, is_isolated, next_leaf,
};
use crate::primitives::reduce::{self, write_two_sums};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Residual of [`forward`] for [`pullback`].
#[derive(Clone, Debug)]
pub struct Residual<T> {
    neighborhoods: Neighborhoods<T>,
    /// In input order.
    areas: Buffer<T>,
}

/// The `(N,)` areas `a_i`, in input order and the unit of the points squared; positive, and 0 for isolated
/// samples. A radius above `common_radius` has grown ([`isograd::neighbors::Neighborhoods::common_radius`]).
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    common_radius: T,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    let n = neighborhoods.len();
    let areas = device.empty(n)?;
    if n > 0 {
        launch!(device, n => find_areas<T>(
            neighborhoods, areas, common_radius, T::PI(),
        ));
    }
    let residual = Residual {
        neighborhoods: neighborhoods.clone(),
        areas: areas.clone(),
    };
    Ok((areas, residual))
}

/// Cotangents `(N, 3)` of the points from those of the areas, `areas_bar` `(N,)`, and `R_i R̄_i` `(N,)` of the radii. All
/// in input order.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    areas_bar: &Buffer<T>,
) -> Result<(Buffer<T>, Buffer<T>), Error> {
    let near = &residual.neighborhoods;
    let n = near.len();
    check_length("areas_bar", areas_bar, n)?;
    let (points_bar, radii_bar) = (device.empty(3 * n)?, device.empty(n)?);
    if n == 0 {
        return Ok((points_bar, radii_bar));
    }
    let factors: Buffer<T> = device.empty(n)?;
    launch!(device, n => fill_factors<T>(
        residual.areas, near.radii, near.places, areas_bar, factors, T::FRAC_1_PI(),
    ));
    launch!(device, n => gather<T>(
        near, residual.areas, areas_bar, factors, points_bar, radii_bar,
    ));
    Ok((points_bar, radii_bar))
}

/// The mean of areas `(N,)` that are not 0, and how many those are: [`isograd::splat::area::mean`]. Waits for the
/// device.
pub fn mean<R: Runtime, T: Scalar>(
    device: &Device<R>,
    areas: &Buffer<T>,
) -> Result<(f64, usize), Error> {
    let n = areas.len();
    let parts: Buffer<T> = device.empty(2 * n.div_ceil(reduce::BLOCK))?;
    launch!(device, n, reduce::BLOCK => sum_areas<T>(areas, parts));
    let sums = device.download(&reduce::sum_columns(device, &parts, 2)?)?;
    let [sum, count] = [sums[0], sums[1]].map(isograd::Real::f64);
    Ok((sum / count, count as usize))
}

/// Of each group, the sum of the areas, and of ones where they are not 0.
#[cube(launch)]
fn sum_areas<F: Float>(areas: &Array<F>, sums: &mut Array<F>) {
    let mut area = F::new(0.0);
    let mut count = F::new(0.0);
    if ABSOLUTE_POS < areas.len() {
        area = areas[ABSOLUTE_POS];
        count = select(area > F::new(0.0), F::new(1.0), F::new(0.0));
    }
    write_two_sums::<F>(area, count, sums);
}

#[cube(launch)]
fn find_areas<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    areas: &mut Array<F>,
    common_radius: F,
    pi: F,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let center = Vector3::<F>::at(&near.tree.points, ABSOLUTE_POS);
        let radius = near.radii[ABSOLUTE_POS];
        let scale = F::new(1.0) / (radius * radius);
        let mut crowd = F::new(0.0);
        // Both without the point itself.
        let mut count = 0u32;
        let mut mutual = 0u32;
        let mut node = next_leaf::<F>(&near.tree, center, radius, 0usize, false);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            let mut of_leaf = F::new(0.0);
            for j in first..end_of_leaf(first, n) {
                let offset = Vector3::<F>::at(&near.tree.points, j).sub(center);
                let square = offset.dot(offset);
                if square <= radius * radius {
                    of_leaf += plane::crowd::<F>(square * scale);
                    if j != ABSOLUTE_POS {
                        count += 1u32;
                        mutual += select(square <= near.radii[j] * near.radii[j], 1u32, 0u32);
                    }
                }
            }
            crowd += of_leaf;
            node = next_leaf::<F>(&near.tree, center, radius, node + 1, false);
        }
        let isolated = is_isolated::<F>(radius, common_radius, count, mutual);
        let area = plane::area::<F>(pi, radius, crowd);
        let place = near.places[ABSOLUTE_POS] as usize;
        areas[place] = select(isolated, F::new(0.0), area);
    }
}

/// `ā_i a_i² · 12/(π R_i⁴)`, in sorted order.
#[cube(launch)]
fn fill_factors<F: Float + CubeElement>(
    areas: &Array<F>,
    radii: &Array<F>,
    places: &Array<u32>,
    areas_bar: &Array<F>,
    factors: &mut Array<F>,
    one_over_pi: F,
) {
    if ABSOLUTE_POS < factors.len() {
        let place = places[ABSOLUTE_POS] as usize;
        let share = areas[place] / (radii[ABSOLUTE_POS] * radii[ABSOLUTE_POS]);
        factors[ABSOLUTE_POS] = F::new(12.0) * one_over_pi * areas_bar[place] * share * share;
    }
}

/// `−Σ_c [f_k (1 − r²/R_k²) + f_c (1 − r²/R_c²)] d_c`, each where the radius reaches: what point `k` gets as a
/// center, and as a neighbor of the others. And `2 a_k ā_k − Σ_c f_k (1 − r²/R_k²) r²`.
#[cube(launch)]
fn gather<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    areas: &Array<F>,
    areas_bar: &Array<F>,
    factors: &Array<F>,
    points_bar: &mut Array<F>,
    radii_bar: &mut Array<F>,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let point = Vector3::<F>::at(&near.tree.points, ABSOLUTE_POS);
        let radius = near.radii[ABSOLUTE_POS];
        let own = factors[ABSOLUTE_POS];
        let mut sum = Vector3::<F>::zero();
        let mut along = F::new(0.0);
        let mut node = next_leaf::<F>(&near.tree, point, radius, 0usize, true);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            for j in first..end_of_leaf(first, n) {
                let offset = Vector3::<F>::at(&near.tree.points, j).sub(point);
                let square = offset.dot(offset);
                let as_center = own * rise::<F>(square, radius);
                along += as_center * square;
                let factor = as_center + factors[j] * rise::<F>(square, near.radii[j]);
                sum = sum.sub(offset.scale(factor));
            }
            node = next_leaf::<F>(&near.tree, point, radius, node + 1, true);
        }
        let place = near.places[ABSOLUTE_POS] as usize;
        sum.write(points_bar, place);
        radii_bar[place] = F::new(2.0) * areas[place] * areas_bar[place] - along;
    }
}

/// `1 − r²/R²` within the radius, else 0.
#[cube]
fn rise<F: Float>(square: F, radius: F) -> F {
    let rise = F::new(1.0) - square / (radius * radius);
    select(rise > F::new(0.0), rise, F::new(0.0))
}
