//! The fits at the vertices, and the values of the attribute there.

use cubecl::prelude::*;
use isograd::distance::extend::rule::{ENOUGH, MARGIN, MOST, REACH, SMALLEST_AREA};

use super::neighbor::{Fitted, SampleArrays, Sorted, neighbor, sum_moments};
use super::{FIT, Samples, columns};
use crate::device::launch;
use crate::element::eigen::{Eigen, Symmetric};
use crate::element::fit;
use crate::neighbors::{NeighborhoodArrays, end_of_leaf, first_of_leaf, next_leaf, reach_squared};
use crate::normals::fit as plane_of;
use crate::primitives::fill::own_zeros;
use crate::primitives::reduce;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// `a₀`, `(1,)`: a millionth of the mean area, or 1 where all are 0.
pub(super) fn smallest_area<R: Runtime, T: Scalar>(
    device: &Device<R>,
    areas: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let sum = reduce::sum(device, areas)?;
    let smallest = device.empty(1)?;
    launch!(device, 1, 1 => share_area<T>(
        sum, smallest, T::of(SMALLEST_AREA / areas.len() as f64),
    ));
    Ok(smallest)
}

/// The fit at each of the `(V, 3)` vertices: `(V, 8)`.
pub(super) fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    sorted: &Sorted<T>,
    vertices: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let near = samples.neighborhoods;
    let count = vertices.len() / 3;
    let fits = device.empty(FIT * count)?;
    launch!(device, count => find_radii<T>(
        near, vertices, fits, samples.radius, T::of(REACH), T::of(MARGIN),
        ENOUGH.min(near.len()), MOST.min(near.len()),
    ));
    launch!(device, count => fit_vertices<T>(sorted, vertices, fits));
    Ok(fits)
}

/// `u_v` at each vertex, `(V, components)`.
pub(super) fn evaluate<R: Runtime, T: Scalar>(
    device: &Device<R>,
    sorted: &Sorted<T>,
    vertices: &Buffer<T>,
    fits: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let (count, components) = (vertices.len() / 3, sorted.components());
    let values = device.empty(count * components)?;
    for (first, width) in columns(components) {
        launch!(device, count => evaluate_columns<T>(
            sorted, vertices, fits, values, first as u32, width,
        ));
    }
    Ok(values)
}

#[cube(launch)]
fn share_area<F: Float + CubeElement>(sum: &Array<F>, smallest: &mut Array<F>, share: F) {
    if ABSOLUTE_POS == 0 {
        smallest[0] = select(sum[0] > F::new(0.0), share * sum[0], F::new(1.0));
    }
}

/// `max(R, min(1.5 r₆, 1.05 r₆₄))`. That is `R` just where six samples are well within it.
#[cube(launch)]
fn find_radii<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    vertices: &Array<F>,
    fits: &mut Array<F>,
    least: F,
    reach: F,
    margin: F,
    #[comptime] enough: usize,
    #[comptime] most: usize,
) {
    if 3 * ABSOLUTE_POS < vertices.len() {
        let y = Vector3::<F>::at(vertices, ABSOLUTE_POS);
        let grown = reach * F::sqrt(reach_squared::<F>(&near.tree, y, enough));
        let mut radius = least;
        if grown > least {
            let last = margin * F::sqrt(reach_squared::<F>(&near.tree, y, most));
            radius = max(least, min(grown, last));
        }
        fits[FIT * ABSOLUTE_POS] = radius;
    }
}

/// `C` in the frame of the axes, of offsets from the mean that is given.
#[cube]
pub(super) fn covariance<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    y: Vector3<F>,
    of: Fitted<F>,
    axes: Eigen<F>,
) -> Symmetric<F> {
    let zero = F::new(0.0);
    let mut xx = zero;
    let mut xy = zero;
    let mut xz = zero;
    let mut yy = zero;
    let mut yz = zero;
    let mut zz = zero;
    let mut node = next_leaf::<F>(&samples.tree, y, of.radius, 0usize, false);
    while node < samples.tree.links.len() {
        let first = first_of_leaf(&samples.tree.links, node);
        for j in first..end_of_leaf(first, samples.areas.len()) {
            let d = Vector3::<F>::at(&samples.tree.points, j).sub(y);
            let n = neighbor::<F>(d, of.unit, samples.areas[j]);
            let e = in_frame::<F>(axes, n.offset.sub(of.mean));
            let p = n.weight / of.weight;
            xx += p * e.x * e.x;
            xy += p * e.x * e.y;
            xz += p * e.x * e.z;
            yy += p * e.y * e.y;
            yz += p * e.y * e.z;
            zz += p * e.z * e.z;
        }
        node = next_leaf::<F>(&samples.tree, y, of.radius, node + 1, false);
    }
    Symmetric::<F> {
        xx,
        xy,
        xz,
        yy,
        yz,
        zz,
    }
}

/// A vector along the axes.
#[cube]
pub(super) fn in_frame<F: Float>(axes: Eigen<F>, v: Vector3<F>) -> Vector3<F> {
    Vector3::<F>::of(axes.first.dot(v), axes.second.dot(v), axes.third.dot(v))
}

/// `C + ε I` in a frame, with the intermediates of its pullback.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Ridge<F: Float> {
    /// Whether there is one: samples that coincide have no slope.
    pub exists: bool,
    /// Whether they do to the last bit.
    pub coincide: bool,
    /// `τ`.
    pub tau: F,
    factors: fit::Factors<F>,
}

/// So far from samples so close together nothing is left of a slope, and squares would leave the range of numbers.
const FARTHEST: f32 = 1e15;

#[cube]
pub(super) fn ridge<F: Float>(c: Symmetric<F>, mean: Vector3<F>) -> Ridge<F> {
    let (zero, one) = (F::new(0.0), F::new(1.0));
    let trace = c.xx + c.yy + c.zz;
    let spreads = trace > zero;
    let square = mean.dot(mean);
    let near = square < F::new(FARTHEST) * trace;
    let exists = spreads && near;
    let tau = select(exists, square / select(exists, trace, one), zero);
    let size = fit::ridge::<F>(trace, tau);
    Ridge::<F> {
        exists,
        coincide: !spreads,
        tau,
        factors: fit::factors::<F>(
            select(exists, c.xx + size, one),
            select(exists, c.yy + size, one),
            select(exists, c.zz + size, one),
            select(exists, c.yz, zero),
            select(exists, c.xz, zero),
            select(exists, c.xy, zero),
        ),
    }
}

/// `(C + ε I)⁻¹ b` for a vector along the axes, turned back; zero where there is no slope.
#[cube]
pub(super) fn solve<F: Float>(of: Ridge<F>, axes: Eigen<F>, b: Vector3<F>) -> Vector3<F> {
    let slope = fit::solved::<F>(of.factors, b);
    let found = axes
        .first
        .scale(slope.x)
        .add(axes.second.scale(slope.y).add(axes.third.scale(slope.z)));
    found.choose(of.exists, Vector3::<F>::zero())
}

/// The radii are there already.
#[cube(launch)]
fn fit_vertices<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    vertices: &Array<F>,
    fits: &mut Array<F>,
) {
    if 3 * ABSOLUTE_POS < vertices.len() {
        let at = FIT * ABSOLUTE_POS;
        let y = Vector3::<F>::at(vertices, ABSOLUTE_POS);
        let radius = fits[at];
        let sums = sum_moments::<F>(samples, y, radius);
        let plane = plane_of::<F>(&sums, 0usize, 1usize);
        let mean = plane.centroid;
        let of = Fitted::<F> {
            unit: F::new(1.0) / radius,
            radius,
            weight: plane.weight,
            mean,
            tilt: Vector3::<F>::zero(),
        };
        let axes = plane.eigen;
        let c = covariance::<F>(samples, y, of, axes);
        let ridge = ridge::<F>(c, mean);
        let tilt = solve::<F>(ridge, axes, in_frame::<F>(axes, mean));
        fits[at + 1] = plane.weight;
        mean.scale(radius).store(fits, at + 2);
        tilt.scale(of.unit).store(fits, at + 5);
    }
}

/// `Σ_j p_j t_j v_j` of some columns, as the mean and a correction to it, so that neither what is left of
/// `Σ_j p_j e_j` nor what `Σ_j p_j` lacks to 1 counts.
#[cube(launch)]
fn evaluate_columns<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    vertices: &Array<F>,
    fits: &Array<F>,
    out: &mut Array<F>,
    column: u32,
    #[comptime] width: usize,
) {
    if 3 * ABSOLUTE_POS < vertices.len() {
        let y = Vector3::<F>::at(vertices, ABSOLUTE_POS);
        let of = Fitted::<F>::at(fits, ABSOLUTE_POS);
        let (components, column) = (samples.components as usize, column as usize);
        // Seen from one of the samples.
        let mut from = own_zeros::<F>(width);
        let mut means = own_zeros::<F>(width);
        let mut rises = own_zeros::<F>(width);
        let mut total = F::new(0.0);
        let mut drift = F::new(0.0);
        let mut node = next_leaf::<F>(&samples.tree, y, of.radius, 0usize, false);
        while node < samples.tree.links.len() {
            let first = first_of_leaf(&samples.tree.links, node);
            for j in first..end_of_leaf(first, samples.areas.len()) {
                let d = Vector3::<F>::at(&samples.tree.points, j).sub(y);
                let n = neighbor::<F>(d, of.unit, samples.areas[j]);
                if n.weight > F::new(0.0) {
                    let p = n.weight / of.weight;
                    let slope = p * of.tilt.dot(n.offset.sub(of.mean));
                    if total == F::new(0.0) {
                        #[unroll]
                        for c in 0..width {
                            from[c] = samples.values[j * components + column + c];
                        }
                    }
                    total += p;
                    drift += slope;
                    #[unroll]
                    for c in 0..width {
                        let value = samples.values[j * components + column + c] - from[c];
                        means[c] += p * value;
                        rises[c] += slope * value;
                    }
                }
            }
            node = next_leaf::<F>(&samples.tree, y, of.radius, node + 1, false);
        }
        #[unroll]
        for c in 0..width {
            let mean = means[c] / total;
            let rise = drift * mean - rises[c];
            out[ABSOLUTE_POS * components + column + c] = from[c] + (mean + rise);
        }
    }
}
