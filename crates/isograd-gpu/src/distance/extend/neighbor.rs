//! The samples around a vertex.

use cubecl::prelude::*;

use super::{Attribute, FIT, Samples};
use crate::device::{argument, launch};
use crate::element::fit;
use crate::neighbors::{Neighborhoods, PointTree, end_of_leaf, first_of_leaf, gather, next_leaf};
use crate::normals::{MOMENTS, add_moments};
use crate::primitives::fill::own_zeros;
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

/// Samples with areas and values, in the order of their tree.
pub(super) struct Sorted<T> {
    tree: Neighborhoods<T>,
    /// `(N,)` `a_j + a₀`.
    pub areas: Buffer<T>,
    /// `(N, components)` `v_j`.
    pub values: Buffer<T>,
}

/// [`Sorted`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct SampleArrays<F: Float + CubeElement> {
    pub tree: PointTree<F>,
    pub places: Array<u32>,
    pub areas: Array<F>,
    pub values: Array<F>,
    pub components: u32,
}

argument!(
    Sorted<T> => SampleArraysLaunch<T, R>:
    |of| of.tree.tree(), of.tree.places.arg(), of.areas.arg(), of.values.arg(), of.components() as u32
);

impl<T: Scalar> Sorted<T> {
    /// Components of a value.
    pub fn components(&self) -> usize {
        self.values.len() / self.areas.len()
    }

    pub fn new<R: Runtime>(
        device: &Device<R>,
        samples: Samples<'_, T>,
        attribute: Attribute<'_, T>,
        smallest_area: &Buffer<T>,
    ) -> Result<Self, Error> {
        let places = &samples.neighborhoods.places;
        let sorted = Self {
            tree: samples.neighborhoods.clone(),
            areas: gather(device, samples.areas, places, 1)?,
            values: gather(device, attribute.values, places, attribute.components)?,
        };
        launch!(device, sorted.areas.len() => raise_areas<T>(smallest_area, sorted.areas));
        Ok(sorted)
    }
}

#[cube(launch)]
fn raise_areas<F: Float>(smallest_area: &Array<F>, areas: &mut Array<F>) {
    if ABSOLUTE_POS < areas.len() {
        areas[ABSOLUTE_POS] += smallest_area[0];
    }
}

/// A fit, in units of its radius.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Fitted<F: Float> {
    /// `1/R_v`.
    pub unit: F,
    pub radius: F,
    pub weight: F,
    pub mean: Vector3<F>,
    pub tilt: Vector3<F>,
}

#[cube]
impl<F: Float> Fitted<F> {
    pub fn at(fits: &Array<F>, vertex: usize) -> Self {
        let at = FIT * vertex;
        let radius = fits[at];
        let unit = F::new(1.0) / radius;
        Fitted::<F> {
            unit,
            radius,
            weight: fits[at + 1],
            mean: Vector3::<F>::load(fits, at + 2).scale(unit),
            tilt: Vector3::<F>::load(fits, at + 5).scale(radius),
        }
    }
}

/// A sample as a vertex sees it: `d_j/R_v`, `1 − r²/R_v²` within the radius, else 0, and `w_j`.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Neighbor<F: Float> {
    pub offset: Vector3<F>,
    pub rest: F,
    pub weight: F,
}

/// The neighbor with the offset `d_j` and the area `a_j + a₀`.
#[cube]
pub(super) fn neighbor<F: Float>(offset: Vector3<F>, unit: F, area: F) -> Neighbor<F> {
    let offset = offset.scale(unit);
    let square = offset.dot(offset);
    Neighbor::<F> {
        offset,
        rest: fit::rest::<F>(square),
        weight: area * fit::kernel::<F>(square),
    }
}

/// `Σ w`, `Σ w d` and `Σ w d dᵀ` of the samples around the vertex at `y`, in units of the radius.
#[cube]
pub(super) fn sum_moments<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    y: Vector3<F>,
    radius: F,
) -> Array<F> {
    let unit = F::new(1.0) / radius;
    let mut sums = own_zeros::<F>(MOMENTS);
    let mut node = next_leaf::<F>(&samples.tree, y, radius, 0usize, false);
    while node < samples.tree.links.len() {
        let first = first_of_leaf(&samples.tree.links, node);
        for j in first..end_of_leaf(first, samples.areas.len()) {
            let d = Vector3::<F>::at(&samples.tree.points, j).sub(y);
            let n = neighbor::<F>(d, unit, samples.areas[j]);
            add_moments::<F>(n.offset, n.weight, &mut sums);
        }
        node = next_leaf::<F>(&samples.tree, y, radius, node + 1, false);
    }
    sums
}

/// Writes a number, or 0 where it is not finite; returns 1 then.
#[cube]
pub(super) fn write_bounded<F: Float>(out: &mut Array<F>, at: usize, number: F) -> u32 {
    let finite = is_finite::<F>(number);
    out[at] = select(finite, number, F::new(0.0));
    select(finite, 0u32, 1u32)
}

/// `ū·(v_j − u)` over all components, of sorted vertex `k` and sorted sample `j`. The row of each vertex is `ū`, then
/// `u`, its own value: what all samples have in common would leave less of the digits of what they differ in.
#[cube]
pub(super) fn contract<F: Float + CubeElement>(
    bars: &Array<F>,
    k: usize,
    samples: &SampleArrays<F>,
    j: usize,
) -> F {
    let components = samples.components as usize;
    let row = 2 * k * components;
    let mut sum = F::new(0.0);
    for c in 0..components {
        let from = bars[row + components + c];
        sum += bars[row + c] * (samples.values[j * components + c] - from);
    }
    sum
}
