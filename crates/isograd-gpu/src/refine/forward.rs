//! Outward normals to refined ones.

use cubecl::prelude::*;

use super::Residual;
use crate::device::{check_length, launch};
use crate::element::eigen::perpendicular;
use crate::element::quadric::{Pair, SUMS, Sums, fit, refined, terms, weight};
use crate::neighbors::{
    BLOCK, NeighborhoodArrays, Neighborhoods, end_of_leaf, first_of_leaf, next_leaf,
};
use crate::normals::{epsilon, steepness};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Refined outward unit normals `(N, 3)` of the points of `near`, whose radii are their own, from outward unit `normals`
/// `(N, 3)`; both in input order. See the [module](super).
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    near: &Neighborhoods<T>,
    normals: &Buffer<T>,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    let n = near.len();
    check_length("normals", normals, 3 * n)?;
    let out = device.empty(3 * n)?;
    if n > 0 {
        launch!(device, n, BLOCK => refine<T>(near, normals, out));
    }
    let residual = Residual {
        near: near.clone(),
        before: normals.clone(),
    };
    Ok((out, residual))
}

/// The share of the variance up to which all of the slope is taken, as on the CPU.
#[cube]
pub(super) fn gain_from<F: Float>() -> F {
    F::new(4.0) / F::new(10.0)
}

/// The share of the variance from which nothing is taken, as on the CPU.
#[cube]
pub(super) fn gain_to<F: Float>() -> F {
    F::new(7.0) / F::new(10.0)
}

#[cube(launch)]
fn refine<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    normals: &Array<F>,
    out: &mut Array<F>,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let place = near.places[ABSOLUTE_POS] as usize;
        let normal = Vector3::<F>::at(normals, place);
        let sums = sums_around::<F>(near, normals, ABSOLUTE_POS);
        let fit = fit::<F>(sums, gain_from::<F>(), gain_to::<F>());
        let long = refined::<F>(normal, perpendicular::<F>(normal), fit);
        let unit = long.scale(F::new(1.0) / F::sqrt(long.dot(long)));
        unit.choose(fit.share > F::new(0.0), normal)
            .write(out, place);
    }
}

/// The sums around the point at a sorted position. Each leaf is summed by itself, and sums of leaves are added up.
#[cube]
pub(super) fn sums_around<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    normals: &Array<F>,
    at: usize,
) -> Sums<F> {
    let n = near.radii.len();
    let center = Vector3::<F>::at(&near.tree.points, at);
    let normal = Vector3::<F>::at(normals, near.places[at] as usize);
    let along = perpendicular::<F>(normal);
    let across = normal.cross(along);
    let radius = near.radii[at];
    let inverse = F::new(1.0) / radius;
    let mut sums = Array::<F>::new(SUMS);
    let mut of_leaf = Array::<F>::new(SUMS);
    #[unroll]
    for k in 0..SUMS {
        sums[k] = F::new(0.0);
    }
    let mut node = next_leaf::<F>(&near.tree, center, radius, 0usize, false);
    while node < near.tree.links.len() {
        #[unroll]
        for k in 0..SUMS {
            of_leaf[k] = F::new(0.0);
        }
        let first = first_of_leaf(&near.tree.links, node);
        for j in first..end_of_leaf(first, n) {
            let offset = Vector3::<F>::at(&near.tree.points, j).sub(center);
            if offset.dot(offset) <= radius * radius {
                let d = offset.scale(inverse);
                let other = Vector3::<F>::at(normals, near.places[j] as usize);
                let r = F::sqrt(d.dot(d));
                let w = weight::<F>(r, normal.dot(other), epsilon::<F>(), steepness::<F>());
                let found = terms::<F>(d.dot(along), d.dot(across), d.dot(normal), w);
                add_terms::<F>(found, &mut of_leaf);
            }
        }
        #[unroll]
        for k in 0..SUMS {
            sums[k] += of_leaf[k];
        }
        node = next_leaf::<F>(&near.tree, center, radius, node + 1, false);
    }
    Sums::<F> {
        first: Vector3::<F>::load(&sums, 0usize),
        second: Vector3::<F>::load(&sums, 3usize),
        by_x: Vector3::<F>::load(&sums, 6usize),
        by_y: Vector3::<F>::load(&sums, 9usize),
        by_xx: Vector3::<F>::load(&sums, 12usize),
        by_xy: Vector3::<F>::load(&sums, 15usize),
        by_yy: Vector3::<F>::load(&sums, 18usize),
        heights: Pair::<F> {
            u: Vector3::<F>::load(&sums, 21usize),
            v: Vector3::<F>::load(&sums, 24usize),
        },
        squares: sums[27],
    }
}

#[cube]
fn add_terms<F: Float>(terms: Sums<F>, sums: &mut Array<F>) {
    terms.first.add_to(sums, 0usize);
    terms.second.add_to(sums, 3usize);
    terms.by_x.add_to(sums, 6usize);
    terms.by_y.add_to(sums, 9usize);
    terms.by_xx.add_to(sums, 12usize);
    terms.by_xy.add_to(sums, 15usize);
    terms.by_yy.add_to(sums, 18usize);
    terms.heights.u.add_to(sums, 21usize);
    terms.heights.v.add_to(sums, 24usize);
    sums[27] += terms.squares;
}
