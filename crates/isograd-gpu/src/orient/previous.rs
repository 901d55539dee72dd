//! The signs of the step before, as `isograd`'s `orient/previous.rs` takes them over: an axis keeps the side that
//! the same point had, and one that has turned far follows its neighbors.

use cubecl::prelude::*;

use super::Error;
use crate::device::check_length;
use crate::element::turned;
use crate::neighbors::{BLOCK, Neighborhoods, end_of_leaf, first_of_leaf, next_leaf};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// The step before, in input order.
#[derive(Clone, Copy, Debug)]
pub struct Before<'a, T> {
    /// `(N, 3)` vectors of any length, roughly outward.
    pub outward: &'a Buffer<T>,
    /// `(N,)` from 0 to 1, how sure that is.
    pub confidence: &'a Buffer<T>,
}

/// Outward normals, and what the next step needs.
#[derive(Clone, Debug)]
pub struct Followed<T> {
    /// `(N, 3)` outward unit normals.
    pub normals: Buffer<T>,
    /// `(N,)` from 0 to 1: what it was, but at most the cosine between axis and vector; of an axis that has turned
    /// far, how much its neighbors agree.
    pub confidence: Buffer<T>,
    /// `(N,)` the confidence that the next step starts from.
    pub kept: Buffer<T>,
    /// `(1,)` how many axes have turned by more than 60°. Where they are more than 3 %, these are hardly the points
    /// of the step before.
    pub turned: Buffer<u32>,
}

/// Turns each of the `(N, 3)` axes, which are of unit length and in input order, to the side of the step before.
/// `radii` `(N,)`, in input order, are those within which neighbors are asked. Nothing waits.
///
/// # Errors
/// [`crate::Error::Length`], [`crate::Error::TooLarge`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    radii: &Buffer<T>,
    axes: &Buffer<T>,
    before: Before<'_, T>,
) -> Result<Followed<T>, Error> {
    let n = neighborhoods.len();
    check_length("the axes", axes, 3 * n)?;
    check_length("the radii", radii, n)?;
    check_length("the outward vectors", before.outward, 3 * n)?;
    check_length("their confidence", before.confidence, n)?;
    let (cosines, far): (Buffer<T>, Buffer<u32>) = (device.empty(n)?, device.empty(n)?);
    let [confidence, kept] = [device.empty(n)?, device.empty(n)?];
    let normals = device.empty(3 * n)?;
    let (groups, dim) = (device.groups(n, BLOCK), CubeDim::new_1d(BLOCK));
    if n > 0 {
        compare::launch::<T, R>(
            device.client(),
            groups.clone(),
            dim,
            axes.arg(),
            before.outward.arg(),
            cosines.arg(),
            far.arg(),
        );
        follow::launch::<T, R>(
            device.client(),
            groups,
            dim,
            neighborhoods.points.arg(),
            neighborhoods.places.arg(),
            neighborhoods.nodes.arg(),
            neighborhoods.links.arg(),
            radii.arg(),
            axes.arg(),
            cosines.arg(),
            before.confidence.arg(),
            normals.arg(),
            confidence.arg(),
            kept.arg(),
        );
    }
    Ok(Followed {
        normals,
        confidence,
        kept,
        turned: flags::count(device, &far)?,
    })
}

/// Cosine between each axis and its vector before, and whether it is small.
#[cube(launch)]
fn compare<F: Float>(
    axes: &Array<F>,
    outward: &Array<F>,
    cosines: &mut Array<F>,
    far: &mut Array<u32>,
) {
    if ABSOLUTE_POS < far.len() {
        let axis = Vector3::<F>::at(axes, ABSOLUTE_POS);
        let cosine = axis.dot(Vector3::<F>::at(outward, ABSOLUTE_POS).direction());
        cosines[ABSOLUTE_POS] = cosine;
        far[ABSOLUTE_POS] = select(is_near::<F>(cosine), 0u32, 1u32);
    }
}

/// Whether an axis has not turned far, by its cosine.
#[cube]
fn is_near<F: Float>(cosine: F) -> bool {
    F::abs(cosine) >= F::new(turned::FAR)
}

/// A unit for each sorted point.
#[cube(launch)]
fn follow<F: Float>(
    points: &Array<F>,
    places: &Array<u32>,
    nodes: &Array<F>,
    links: &Array<u32>,
    radii: &Array<F>,
    axes: &Array<F>,
    cosines: &Array<F>,
    before: &Array<F>,
    normals: &mut Array<F>,
    confidence: &mut Array<F>,
    kept: &mut Array<F>,
) {
    if ABSOLUTE_POS < places.len() {
        let i = places[ABSOLUTE_POS] as usize;
        let axis = Vector3::<F>::at(axes, i);
        let zero = F::new(0.0);
        let mut side = cosines[i];
        let mut sure = min(before[i], F::abs(side));
        let mut keep = before[i];
        if !is_near::<F>(side) {
            let x = Vector3::<F>::at(points, ABSOLUTE_POS);
            let said = side_among_neighbors::<F>(
                points, places, nodes, links, axes, cosines, x, axis, radii[i],
            );
            side = select(said == zero, side, said);
            sure = min(F::abs(said), F::new(1.0));
            keep = sure;
        }
        axis.scale(select(side < zero, F::new(-1.0), F::new(1.0)))
            .write(normals, i);
        confidence[i] = sure;
        kept[i] = keep;
    }
}

/// What the neighbors that have not turned say of an axis, from −1 to 1; 0 where there is none.
#[cube]
fn side_among_neighbors<F: Float>(
    points: &Array<F>,
    places: &Array<u32>,
    nodes: &Array<F>,
    links: &Array<u32>,
    axes: &Array<F>,
    cosines: &Array<F>,
    x: Vector3<F>,
    axis: Vector3<F>,
    radius: F,
) -> F {
    let zero = F::new(0.0);
    let blunt = turned::blunt::<F>(radius);
    let mut sum = F::new(0.0);
    let mut weight = F::new(0.0);
    let mut node = next_leaf::<F>(nodes, links, x, radius, 0usize.runtime(), false);
    while node < links.len() {
        let first = first_of_leaf(links, node);
        for position in first..end_of_leaf(first, places.len()) {
            let offset = Vector3::<F>::at(points, position).sub(x);
            let square = offset.dot(offset);
            let j = places[position] as usize;
            if square <= radius * radius && is_near::<F>(cosines[j]) {
                let sign = select(cosines[j] < zero, F::new(-1.0), F::new(1.0));
                let normal = Vector3::<F>::at(axes, j).scale(sign);
                let near = turned::weight::<F>(square, blunt);
                let carried = turned::carried::<F>(
                    axis.dot(normal),
                    axis.dot(offset),
                    normal.dot(offset),
                    near,
                );
                sum += near * carried;
                weight += near;
            }
        }
        node = next_leaf::<F>(nodes, links, x, radius, node + 1, false);
    }
    select(
        weight > zero,
        sum / select(weight > zero, weight, F::new(1.0)),
        zero,
    )
}
