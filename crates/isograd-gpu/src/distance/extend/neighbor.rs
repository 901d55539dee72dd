//! The samples round a vertex.

use cubecl::prelude::*;

use super::{Attribute, FIT, Samples};
use crate::element::fit;
use crate::neighbors::{end_of_leaf, first_of_leaf, gather, next_leaf};
use crate::normals::{MOMENTS, add_moments};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

use super::BLOCK;

/// What is known of the samples, in the order of their tree.
pub(super) struct Sorted<T> {
    /// `(N,)` `a_j + a₀`.
    pub areas: Buffer<T>,
    /// `(N, components)` `v_j`.
    pub values: Buffer<T>,
}

impl<T: Scalar> Sorted<T> {
    pub fn new<R: Runtime>(
        device: &Device<R>,
        samples: Samples<'_, T>,
        attribute: Attribute<'_, T>,
        smallest_area: &Buffer<T>,
    ) -> Result<Self, Error> {
        let places = &samples.neighborhoods.places;
        let sorted = Self {
            areas: gather(device, samples.areas, places, 1)?,
            values: gather(device, attribute.values, places, attribute.components)?,
        };
        raise_areas::launch::<T, R>(
            device.client(),
            device.groups(sorted.areas.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            smallest_area.arg(),
            sorted.areas.arg(),
        );
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

/// `Σ w`, `Σ w d` and `Σ w d dᵀ` of the samples round the vertex at `y`, in units of the radius.
#[cube]
pub(super) fn sum_moments<F: Float>(
    points: &Array<F>,
    areas: &Array<F>,
    nodes: &Array<F>,
    links: &Array<u32>,
    y: Vector3<F>,
    radius: F,
    sums: &mut Array<F>,
) {
    let unit = F::new(1.0) / radius;
    #[unroll]
    for k in 0..MOMENTS {
        sums[k] = F::new(0.0);
    }
    let mut node = next_leaf::<F>(nodes, links, y, radius, 0usize, false);
    while node < links.len() {
        let first = first_of_leaf(links, node);
        for j in first..end_of_leaf(first, areas.len()) {
            let d = Vector3::<F>::at(points, j).sub(y);
            let n = neighbor::<F>(d, unit, areas[j]);
            add_moments::<F>(n.offset, n.weight, sums);
        }
        node = next_leaf::<F>(nodes, links, y, radius, node + 1, false);
    }
}

/// `ū·(v_j − u)` over all components, of sorted vertex `k` and sorted sample `j`. The row of each vertex is `ū`, then
/// `u`, its own value: what all samples have in common would leave less of the digits of what they differ in.
#[cube]
pub(super) fn contract<F: Float>(
    bars: &Array<F>,
    k: usize,
    values: &Array<F>,
    j: usize,
    components: usize,
) -> F {
    let row = 2 * k * components;
    let mut sum = F::new(0.0);
    for c in 0..components {
        let from = bars[row + components + c];
        sum += bars[row + c] * (values[j * components + c] - from);
    }
    sum
}
