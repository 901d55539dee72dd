//! Cotangents of the samples through the fits: each gathers over the vertices whose radius reaches it.

use cubecl::prelude::*;

use super::adjoint::{Adjoint, AdjointArrays, Adjoints, share_of_last};
use super::columns;
use super::neighbor::{SampleArrays, Sorted, contract, neighbor, write_bounded};
use crate::device::launch;
use crate::neighbors::{NeighborhoodArrays, end_of_leaf, first_of_leaf, next_leaf};
use crate::primitives::fill::own_zeros;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents of the samples, in the order in which they were given.
pub(super) struct OfSamples<T> {
    /// `(N, components)`.
    pub attribute: Buffer<T>,
    /// `(N, 3)`.
    pub points: Buffer<T>,
    /// `(N,)`.
    pub areas: Buffer<T>,
    /// `(N,)` numbers that were not finite.
    pub guarded: Buffer<u32>,
}

pub(super) fn gather<R: Runtime, T: Scalar>(
    device: &Device<R>,
    sorted: &Sorted<T>,
    adjoints: &Adjoints<T>,
) -> Result<OfSamples<T>, Error> {
    let (count, components) = (sorted.areas.len(), sorted.components());
    let out = OfSamples {
        attribute: device.empty(count * components)?,
        points: device.empty(3 * count)?,
        areas: device.empty(count)?,
        guarded: device.empty(count)?,
    };
    launch!(device, count => gather_points<T>(
        sorted, adjoints.near, adjoints, out.points, out.areas, out.guarded,
    ));
    for (first, width) in columns(components) {
        launch!(device, count => gather_columns<T>(
            sorted, adjoints.near, adjoints, out.attribute, out.guarded, first as u32, width,
        ));
    }
    Ok(out)
}

/// `Σ_v d̄_j` and `Σ_v w̄_j K`. A vertex that counts for nothing has the radius 0.
#[cube(launch)]
fn gather_points<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    near: &NeighborhoodArrays<F>,
    adjoints: &AdjointArrays<F>,
    points_bar: &mut Array<F>,
    areas_bar: &mut Array<F>,
    guarded: &mut Array<u32>,
) {
    let j = ABSOLUTE_POS;
    if j < samples.areas.len() {
        let x = Vector3::<F>::at(&samples.tree.points, j);
        let zero = F::new(0.0);
        let mut sum = Vector3::<F>::zero();
        let mut of_area = zero;
        let mut node = next_leaf::<F>(&near.tree, x, zero, 0usize, true);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            for k in first..end_of_leaf(first, near.radii.len()) {
                if near.radii[k] > zero {
                    let unit = F::new(1.0) / near.radii[k];
                    let d = x.sub(Vector3::<F>::at(&near.tree.points, k));
                    let n = neighbor::<F>(d, unit, samples.areas[j]);
                    if n.weight > zero {
                        let q = contract::<F>(&adjoints.bars, k, samples, j);
                        let adjoint = Adjoint::<F>::at(&adjoints.records, k);
                        let seen = adjoint.see(n, q);
                        let share = adjoint.offset_bar(seen, n.rest, samples.areas[j]);
                        let is_last = adjoints.last[k] == j as u32;
                        let of_radius = select(is_last, adjoints.grown[k], zero);
                        let through_radius = share_of_last::<F>(n.offset, of_radius, unit);
                        sum = sum.add(share.scale(unit).add(through_radius));
                        of_area += adjoint.weight_bar(seen) * n.rest * n.rest;
                    }
                }
            }
            node = next_leaf::<F>(&near.tree, x, zero, node + 1, true);
        }
        let place = samples.places[j] as usize;
        let mut count = write_bounded::<F>(points_bar, 3 * place, sum.x);
        count += write_bounded::<F>(points_bar, 3 * place + 1, sum.y);
        count += write_bounded::<F>(points_bar, 3 * place + 2, sum.z);
        count += write_bounded::<F>(areas_bar, place, of_area);
        guarded[j] = count;
    }
}

/// `Σ_v p_j t_j ū_v` of some columns.
#[cube(launch)]
fn gather_columns<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    near: &NeighborhoodArrays<F>,
    adjoints: &AdjointArrays<F>,
    attribute_bar: &mut Array<F>,
    guarded: &mut Array<u32>,
    column: u32,
    #[comptime] width: usize,
) {
    let j = ABSOLUTE_POS;
    if j < samples.areas.len() {
        let x = Vector3::<F>::at(&samples.tree.points, j);
        let zero = F::new(0.0);
        let (components, column) = (samples.components as usize, column as usize);
        let mut sums = own_zeros::<F>(width);
        let mut node = next_leaf::<F>(&near.tree, x, zero, 0usize, true);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            for k in first..end_of_leaf(first, near.radii.len()) {
                if near.radii[k] > zero {
                    let unit = F::new(1.0) / near.radii[k];
                    let d = x.sub(Vector3::<F>::at(&near.tree.points, k));
                    let n = neighbor::<F>(d, unit, samples.areas[j]);
                    if n.weight > zero {
                        let seen = Adjoint::<F>::at(&adjoints.records, k).see(n, zero);
                        #[unroll]
                        for c in 0..width {
                            sums[c] +=
                                seen.p * seen.t * adjoints.bars[2 * k * components + column + c];
                        }
                    }
                }
            }
            node = next_leaf::<F>(&near.tree, x, zero, node + 1, true);
        }
        let row = samples.places[j] as usize * components + column;
        #[unroll]
        for c in 0..width {
            guarded[j] += write_bounded::<F>(attribute_bar, row + c, sums[c]);
        }
    }
}
