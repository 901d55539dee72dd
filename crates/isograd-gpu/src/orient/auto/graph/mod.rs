//! The neighbor graph: who is next to whom, and how the signs of two neighbors hang together. What it holds, and
//! why, is on the page of [`isograd::orient::graph`].
//!
//! # Map
//! [`Neighborhoods`], axes and the planes that they are of → [`Graph`]. Offsets between neighbors are not kept: 192
//! bytes a point are more than the time to take them again. A coupling is one unit, all else one unit a point.
//!
//! # Not differentiable
//! Nothing here has a derivative: it decides about signs.

mod axes;
mod couple;
mod relax;
mod sheets;

pub use couple::{part_slabs, sheet_evidence};
pub use relax::relax;

use cubecl::prelude::*;

use crate::device::check_length;
use crate::element::coupling::{self, NEIGHBORS, RING};
use crate::neighbors::{BLOCK, Neighborhoods, nearest_others};
use crate::normals::Residual;
use crate::primitives::smallest::median;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Neighbors whose median distance from the tangent plane is the thickness.
const NEAREST: usize = NEIGHBORS / 2;

/// Neighbors, axes and couplings, all in the sorted order of the [`Neighborhoods`]; lengths are in sample spacings
/// of the whole cloud, so that single precision serves any unit.
#[derive(Clone, Debug)]
pub struct Graph {
    /// `(N, 16)` sorted positions of the nearest other samples, nearest first, and of equally far ones the lowest
    /// index in the input first; where there are too few, the point itself.
    pub near: Buffer<u32>,
    /// `(N, 3)` the normal axis, of unit length; its sign is arbitrary.
    pub axis: Buffer<f32>,
    /// `(N,)` how far the surface patch extends that each sample stands for, in spacings.
    pub reach: Buffer<f32>,
    /// `(N,)` how far the samples of its sheet lie off it, in spacings, where that is known; else 0.
    pub scatter: Buffer<f32>,
    /// `(N,)` typical distance of the nearest samples from the tangent plane, in spacings.
    pub thickness: Buffer<f32>,
    /// `(N,)` the area of surface that each sample stands for, in squares of the spacing.
    pub area: Buffer<f32>,
    /// `(N,)` how far samples lie off their common plane, where they scatter so much that the axis was sought in a
    /// wider neighborhood: root mean square, in spacings; else 0.
    pub spread: Buffer<f32>,
    /// `(N,)` in −1..1: how clearly such a sample lies on the side of that plane that its axis points to; else 0.
    pub side: Buffer<f32>,
    /// `(N, 16)` in −1..1: above 0 where the two axes should have the sign they have, relative to each other.
    pub coupling: Buffer<f32>,
}

impl Graph {
    /// `N`.
    pub fn len(&self) -> usize {
        self.reach.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The graph of the points of `neighborhoods`, whose typical distance `spacing` is above 0
/// ([`Radii::spacing`](crate::neighbors::radius::Radii::spacing)). `axes` `(N, 3)`, in input order, may
/// have any sign. `planes` are those of the axes, within radii that may be wider than those of `neighborhoods`: of
/// [`crate::normals::forward`] in the same neighborhoods or in those of [`crate::neighbors::with_radii`]. Without
/// them no sample counts as scattering.
///
/// # Errors
/// [`Error::Length`], [`Error::TooLarge`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    planes: Option<&Residual<T>>,
    spacing: T,
) -> Result<Graph, Error> {
    let n = neighborhoods.len();
    check_length("the axes", axes, 3 * n)?;
    let per_spacing = per_spacing(spacing);
    let near = nearest_others(device, neighborhoods, NEIGHBORS)?;
    let given = axes::take(device, neighborhoods, axes)?;
    let (spread, side) = axes::spreads(device, neighborhoods, axes, planes, per_spacing)?;
    let (axis, scatter) = sheets::find(device, neighborhoods, &near, &given, per_spacing)?;
    let (ring, thickness) = measure(device, neighborhoods, &near, &axis, per_spacing)?;
    let reach = reaches(device, &near, &ring)?;
    let mut graph = Graph {
        near,
        axis,
        reach,
        scatter,
        thickness,
        area: device.empty(n)?,
        spread,
        side,
        coupling: device.empty(NEIGHBORS * n)?,
    };
    couple::couple(device, neighborhoods, &mut graph, per_spacing);
    Ok(graph)
}

/// One over the spacing, as the CPU rounds it.
fn per_spacing<T: Scalar>(spacing: T) -> T {
    <T as isograd::Real>::of(1.0 / isograd::Real::f64(spacing))
}

/// Distance to the last sample of the ring, and thickness.
fn measure<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    near: &Buffer<u32>,
    axis: &Buffer<f32>,
    per_spacing: T,
) -> Result<(Buffer<f32>, Buffer<f32>), Error> {
    let n = neighborhoods.len();
    let (ring, thickness) = (device.empty(n)?, device.empty(n)?);
    if n > 0 {
        measure_rings::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            neighborhoods.points.arg(),
            near.arg(),
            axis.arg(),
            ring.arg(),
            thickness.arg(),
            per_spacing,
        );
    }
    Ok((ring, thickness))
}

fn reaches<R: Runtime>(
    device: &Device<R>,
    near: &Buffer<u32>,
    ring: &Buffer<f32>,
) -> Result<Buffer<f32>, Error> {
    let n = ring.len();
    let reach = device.empty(n)?;
    if n > 0 {
        find_reach::launch::<R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            near.arg(),
            ring.arg(),
            reach.arg(),
        );
    }
    Ok(reach)
}

#[cube]
fn in_single<F: Float>(v: Vector3<F>) -> Vector3<f32> {
    Vector3::<f32>::of(
        f32::cast_from(v.x),
        f32::cast_from(v.y),
        f32::cast_from(v.z),
    )
}

/// The offset from the point at `from` to the one at sorted position `to`, in spacings.
#[cube]
fn offset<F: Float>(points: &Array<F>, from: Vector3<F>, to: u32, per_spacing: F) -> Vector3<f32> {
    let d = Vector3::<F>::at(points, to as usize).sub(from);
    in_single::<F>(d.scale(per_spacing))
}

#[cube(launch)]
fn measure_rings<F: Float + CubeElement>(
    points: &Array<F>,
    near: &Array<u32>,
    axis: &Array<f32>,
    ring: &mut Array<f32>,
    thickness: &mut Array<f32>,
    per_spacing: F,
) {
    let p = ABSOLUTE_POS;
    if p < ring.len() {
        let x = Vector3::<F>::at(points, p);
        let own = Vector3::<f32>::at(axis, p);
        let mut heights = Array::<f32>::new(NEAREST);
        #[unroll]
        for slot in 0..NEAREST {
            let d = offset::<F>(points, x, near[NEIGHBORS * p + slot], per_spacing);
            heights[slot] = d.dot(own).abs();
        }
        thickness[p] = median::<f32>(&heights, NEAREST);
        let last = near[NEIGHBORS * p + RING - 1];
        ring[p] = offset::<F>(points, x, last, per_spacing).norm();
    }
}

#[cube(launch)]
fn find_reach(near: &Array<u32>, ring: &Array<f32>, reach: &mut Array<f32>) {
    let p = ABSOLUTE_POS;
    if p < ring.len() {
        let mut around = Array::<f32>::new(RING);
        #[unroll]
        for slot in 0..RING {
            around[slot] = ring[near[NEIGHBORS * p + slot] as usize];
        }
        reach[p] = coupling::reach(ring[p], median::<f32>(&around, RING));
    }
}
