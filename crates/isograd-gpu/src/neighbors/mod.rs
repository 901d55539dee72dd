//! Which samples are close to which: a service shared by the stages.
//!
//! # Map
//! Points `(N, 3)` and a radius `R_i > 0` for each → what finds the neighborhoods
//! `N_i = {j : |x_j − x_i| ≤ R_i}`, and the centers `{i : j ∈ N_i}` that have a point as a neighbor. Radii are
//! chosen on the CPU ([`isograd::neighbors`]) or here ([`radius`]).
//!
//! Points are sorted along a Z-order curve and cut into leaves of eight; boxes round four leaves, round four of
//! those, and so on, are a tree, which every unit walks from the root in the same order. Memory is a small
//! multiple of that of the points whatever their extent and the radii, and so is the time where a point is far
//! away, where clusters are, and where single radii are large. In a grid, one large radius would make all
//! cells large.
//!
//! Source of the order: M. Connor, P. Kumar, "Fast construction of k-nearest neighbor graphs for point clouds"
//! (2010), who interleave the bits of floating-point coordinates, so that the order needs no bounds.
//!
//! # Residual
//! [`Neighborhoods`] is its own residual.
//!
//! # Pullback
//! None. Those of the stages gather: a node is visited where the radius at hand or the largest one below the
//! node reaches the other, so that one walk meets both `N_k` and all centers of `k`.

mod nearest;
mod order;
pub mod radius;
mod tree;
mod walk;

pub(crate) use nearest::{SURE_SHARE, about_nearest, any_within, reach_squared, reaches};
pub(crate) use order::{gather, scatter};
pub(crate) use walk::{end_of_leaf, first_of_leaf, is_isolated, next_leaf};

use cubecl::prelude::*;

use crate::device::{argument, check_length};
use crate::{Buffer, Device, Error, Scalar};

/// Units of a group.
pub(crate) const BLOCK: u32 = 64;

/// Points of a leaf.
pub(crate) const LEAF: usize = 8;

/// Points on a device, sorted, with the radii of their neighborhoods and the tree that finds the members.
/// Clones share the memory.
#[derive(Clone, Debug)]
pub struct Neighborhoods<T> {
    /// `(N, 3)` sorted.
    pub(crate) points: Buffer<T>,
    /// `(N,)` index in the input of each sorted point.
    pub(crate) places: Buffer<u32>,
    /// `(N,)` in sorted order.
    pub(crate) radii: Buffer<T>,
    /// Low corner, high corner and largest radius of each node, each before its subtrees.
    pub(crate) nodes: Buffer<T>,
    /// For a leaf, its number and [`tree::IS_LEAF`]; for other nodes, the node after the subtree.
    pub(crate) links: Buffer<u32>,
}

/// Sorted points and their tree in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct PointTree<F: Float + CubeElement> {
    pub points: Array<F>,
    pub nodes: Array<F>,
    pub links: Array<u32>,
}

/// [`Neighborhoods`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct NeighborhoodArrays<F: Float + CubeElement> {
    pub tree: PointTree<F>,
    pub radii: Array<F>,
    pub places: Array<u32>,
}

impl<T: Scalar> Neighborhoods<T> {
    /// The points and their tree as an argument of a kernel.
    pub(crate) fn tree<R: Runtime>(&self) -> PointTreeLaunch<T, R> {
        PointTreeLaunch::new(self.points.arg(), self.nodes.arg(), self.links.arg())
    }
}

argument!(
    Neighborhoods<T> => NeighborhoodArraysLaunch<T, R>:
    |of| of.tree(), of.radii.arg(), of.places.arg()
);

impl<T> Neighborhoods<T> {
    /// `N`.
    pub fn len(&self) -> usize {
        self.radii.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// `(N,)` sorted position → input index.
    pub fn order(&self) -> &Buffer<u32> {
        &self.places
    }
}

/// Sorts the `(N, 3)` points and builds the tree; `radii` `(N,)` are the `R_i`, in the unit of the points. Both
/// finite and in input order.
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    radii: &Buffer<T>,
) -> Result<Neighborhoods<T>, Error> {
    check_length("points", points, 3 * radii.len())?;
    let places = order::along_curve(device, points)?;
    let sorted = order::gather(device, points, &places, 3)?;
    with_order(device, sorted, places, radii)
}

/// Neighborhoods of the same points with other radii `(N,)`, in input order.
pub fn with_radii<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    radii: &Buffer<T>,
) -> Result<Neighborhoods<T>, Error> {
    check_length("radii", radii, neighborhoods.len())?;
    let Neighborhoods { points, places, .. } = neighborhoods.clone();
    with_order(device, points, places, radii)
}

fn with_order<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: Buffer<T>,
    places: Buffer<u32>,
    radii: &Buffer<T>,
) -> Result<Neighborhoods<T>, Error> {
    let radii = order::gather(device, radii, &places, 1)?;
    let (nodes, links) = tree::build(device, &points, &radii)?;
    Ok(Neighborhoods {
        points,
        places,
        radii,
        nodes,
        links,
    })
}
