//! How the signs of neighbors hang together, and what follows from it: areas, and evidence from a second sheet.

use cubecl::prelude::*;

use super::{Graph, offset, per_spacing};
use crate::device::check_length;
use crate::element::coupling::{self, NEIGHBORS};
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Fills couplings and areas.
pub(super) fn couple<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    graph: &mut Graph,
    per_spacing: T,
) {
    let n = graph.len();
    if n == 0 {
        return;
    }
    let dim = CubeDim::new_1d(BLOCK);
    couple_pairs::launch::<T, R>(
        device.client(),
        device.groups(NEIGHBORS * n, BLOCK),
        dim,
        neighborhoods.points.arg(),
        graph.near.arg(),
        graph.axis.arg(),
        graph.reach.arg(),
        graph.scatter.arg(),
        graph.spread.arg(),
        graph.thickness.arg(),
        graph.coupling.arg(),
        per_spacing,
    );
    find_shares::launch::<R>(
        device.client(),
        device.groups(n, BLOCK),
        dim,
        graph.near.arg(),
        graph.axis.arg(),
        graph.reach.arg(),
        graph.coupling.arg(),
        graph.area.arg(),
    );
}

/// In layers with air on both sides, as far as they are that (`slab`, `(N,)` in 0..1, sorted), two samples hang
/// together as they lie: on one side of the middle, or on both. Changes the couplings.
///
/// # Errors
/// [`Error::Length`].
pub fn part_slabs<R: Runtime>(
    device: &Device<R>,
    graph: &mut Graph,
    slab: &Buffer<f32>,
) -> Result<(), Error> {
    let n = graph.len();
    check_length("the slabs", slab, n)?;
    if n > 0 {
        part_pairs::launch::<R>(
            device.client(),
            device.groups(NEIGHBORS * n, BLOCK),
            CubeDim::new_1d(BLOCK),
            graph.near.arg(),
            graph.axis.arg(),
            graph.side.arg(),
            slab.arg(),
            graph.coupling.arg(),
        );
    }
    Ok(())
}

/// Evidence `(N,)` in −1..1 for the sign of each axis, in sorted order, from a second sheet close by: the samples of
/// the other side of a thin body lie behind a sample. Positive where the axis points away from them. `neighborhoods`
/// and `spacing` are those of the graph.
///
/// # Errors
/// [`Error::Length`], [`Error::TooLarge`].
pub fn sheet_evidence<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    graph: &Graph,
    spacing: T,
) -> Result<Buffer<f32>, Error> {
    let n = graph.len();
    check_length("the points", &neighborhoods.points, 3 * n)?;
    let evidence = device.empty(n)?;
    if n > 0 {
        find_sheet_evidence::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            neighborhoods.points.arg(),
            graph.near.arg(),
            graph.axis.arg(),
            graph.scatter.arg(),
            evidence.arg(),
            per_spacing(spacing),
        );
    }
    Ok(evidence)
}

/// A unit for each neighbor of each point.
#[cube(launch)]
fn couple_pairs<F: Float + CubeElement>(
    points: &Array<F>,
    near: &Array<u32>,
    axis: &Array<f32>,
    reach: &Array<f32>,
    scatter: &Array<f32>,
    spread: &Array<f32>,
    thickness: &Array<f32>,
    couplings: &mut Array<f32>,
    per_spacing: F,
) {
    if ABSOLUTE_POS < couplings.len() {
        let p = ABSOLUTE_POS / NEIGHBORS;
        let q = near[ABSOLUTE_POS] as usize;
        let mut found = 0.0f32;
        if p != q {
            let a = Vector3::<f32>::at(axis, p);
            let b = Vector3::<f32>::at(axis, q);
            let x = Vector3::<F>::at(points, p);
            let d = offset::<F>(points, x, near[ABSOLUTE_POS], per_spacing);
            let gap = coupling::least_gap(scatter[p], scatter[q]);
            let spreads = spread[p] * spread[q];
            let thicknesses = thickness[p] * thickness[q];
            let blur = coupling::blur(reach[p], spreads, thicknesses, gap);
            let heights = a.dot(d) * b.dot(d);
            let tie = coupling::coupled(a.dot(b), heights, d.dot(d) + blur, gap);
            found = coupling::trusted(tie);
        }
        couplings[ABSOLUTE_POS] = found;
    }
}

#[cube(launch)]
fn find_shares(
    near: &Array<u32>,
    axis: &Array<f32>,
    reach: &Array<f32>,
    couplings: &Array<f32>,
    area: &mut Array<f32>,
) {
    let p = ABSOLUTE_POS;
    if p < area.len() {
        let own = Vector3::<f32>::at(axis, p);
        let mut same = 0.0f32;
        for slot in 0..NEIGHBORS {
            let at = NEIGHBORS * p + slot;
            let parallel = own.dot(Vector3::<f32>::at(axis, near[at] as usize));
            let on = coupling::on_same_sheet(couplings[at], parallel);
            same += select(on, 1.0f32, 0.0f32);
        }
        area[p] = coupling::area(reach[p], same);
    }
}

/// A unit for each neighbor of each point.
#[cube(launch)]
fn part_pairs(
    near: &Array<u32>,
    axis: &Array<f32>,
    side: &Array<f32>,
    slab: &Array<f32>,
    couplings: &mut Array<f32>,
) {
    if ABSOLUTE_POS < couplings.len() {
        let p = ABSOLUTE_POS / NEIGHBORS;
        let q = near[ABSOLUTE_POS] as usize;
        let both = min(slab[p], slab[q]);
        if both > 0.0f32 && side[p] != 0.0f32 && side[q] != 0.0f32 {
            let parallel = Vector3::<f32>::at(axis, p).dot(Vector3::<f32>::at(axis, q));
            let before = couplings[ABSOLUTE_POS];
            couplings[ABSOLUTE_POS] = coupling::parted(before, both, parallel, side[p], side[q]);
        }
    }
}

#[cube(launch)]
fn find_sheet_evidence<F: Float + CubeElement>(
    points: &Array<F>,
    near: &Array<u32>,
    axis: &Array<f32>,
    scatter: &Array<f32>,
    evidence: &mut Array<f32>,
    per_spacing: F,
) {
    let p = ABSOLUTE_POS;
    if p < evidence.len() {
        let x = Vector3::<F>::at(points, p);
        let own = Vector3::<f32>::at(axis, p);
        let mut signed = 0.0f32;
        let mut total = 0.0f32;
        for slot in 0..NEIGHBORS {
            let q = near[NEIGHBORS * p + slot];
            let d = offset::<F>(points, x, q, per_spacing);
            let square = d.dot(d);
            if square > 0.0f32 {
                let parallel = own.dot(Vector3::<f32>::at(axis, q as usize));
                let gap = coupling::least_gap(scatter[p], scatter[q as usize]);
                let across = coupling::across(d.dot(own), square, parallel, gap);
                signed += across;
                total += across.abs();
            }
        }
        evidence[p] = coupling::sheet_evidence(signed, total);
    }
}
