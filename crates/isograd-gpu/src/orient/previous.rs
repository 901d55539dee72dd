//! The signs of the step before, as `isograd`'s `orient/previous.rs` takes them over: an axis keeps the side that
//! the same point had, and one that has turned far follows its neighbors.

use cubecl::prelude::*;

use super::Error;
use crate::device::{Ready, check_length, launch};
use crate::element::turned;
use crate::neighbors::{NeighborhoodArrays, Neighborhoods, end_of_leaf, first_of_leaf, next_leaf};
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
/// `radii` `(N,)`, in input order, are those of the neighbors that far turned axes follow. Nothing waits.
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
    launch!(device, n => compare<T>(axes, before.outward, cosines, far));
    let step = StepLaunch::new(radii.arg(), cosines.arg(), before.confidence.arg());
    launch!(device, n => follow<T>(
        neighborhoods, axes, Ready::new(step), normals, confidence, kept,
    ));
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

/// The step before, in input order.
#[derive(CubeLaunch, CubeType)]
struct Step<F: Float + CubeElement> {
    /// Within which the neighbors of an axis that has turned far are.
    radii: Array<F>,
    /// Between the axis and its vector before.
    cosines: Array<F>,
    confidence: Array<F>,
}

/// A unit for each sorted point.
#[cube(launch)]
fn follow<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    axes: &Array<F>,
    before: &Step<F>,
    normals: &mut Array<F>,
    confidence: &mut Array<F>,
    kept: &mut Array<F>,
) {
    if ABSOLUTE_POS < near.places.len() {
        let i = near.places[ABSOLUTE_POS] as usize;
        let axis = Vector3::<F>::at(axes, i);
        let zero = F::new(0.0);
        let mut side = before.cosines[i];
        let mut sure = min(before.confidence[i], F::abs(side));
        let mut keep = before.confidence[i];
        if !is_near::<F>(side) {
            let said = side_among_neighbors::<F>(near, axes, before, ABSOLUTE_POS);
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

/// Agreement of an axis with its neighbors that have not turned, from −1 to 1; 0 where there are none.
#[cube]
fn side_among_neighbors<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    axes: &Array<F>,
    before: &Step<F>,
    own: usize,
) -> F {
    let zero = F::new(0.0);
    let x = Vector3::<F>::at(&near.tree.points, own);
    let i = near.places[own] as usize;
    let axis = Vector3::<F>::at(axes, i);
    let radius = before.radii[i];
    let blunt = turned::blunt::<F>(radius);
    let mut sum = F::new(0.0);
    let mut weight = F::new(0.0);
    let mut node = next_leaf::<F>(&near.tree, x, radius, 0usize.runtime(), false);
    while node < near.tree.links.len() {
        let first = first_of_leaf(&near.tree.links, node);
        for position in first..end_of_leaf(first, near.places.len()) {
            let offset = Vector3::<F>::at(&near.tree.points, position).sub(x);
            let square = offset.dot(offset);
            let j = near.places[position] as usize;
            if square <= radius * radius && is_near::<F>(before.cosines[j]) {
                let sign = select(before.cosines[j] < zero, F::new(-1.0), F::new(1.0));
                let normal = Vector3::<F>::at(axes, j).scale(sign);
                let weighted = turned::weight::<F>(square, blunt);
                let carried = turned::carried::<F>(
                    axis.dot(normal),
                    axis.dot(offset),
                    normal.dot(offset),
                    weighted,
                );
                sum += weighted * carried;
                weight += weighted;
            }
        }
        node = next_leaf::<F>(&near.tree, x, radius, node + 1, false);
    }
    select(
        weight > zero,
        sum / select(weight > zero, weight, F::new(1.0)),
        zero,
    )
}
