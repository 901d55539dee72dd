//! Signs of distances: of each cell by itself, or carried on from cell to cell where the surface cannot pass between them.

use super::NO_TRIANGLE;
use crate::{Real, parallel};

/// Share by which the distances of two cells must exceed that between their centers, so that rounding changes nothing.
pub(super) const MARGIN: f64 = 1.001;

/// Signs of a row, given its place, by `inside(place, closest)` of each cell.
pub(super) fn each<T: Real>(
    inside: impl Fn(usize, u32) -> bool + Sync,
) -> impl Fn(usize, &mut [T], &[u32]) + Sync {
    move |first, phi, closest| {
        for (k, (phi, &face)) in phi.iter_mut().zip(closest).enumerate() {
            put(inside(first + k, face), phi);
        }
    }
}

/// Like [`each`], but `inside` is found only where the surface may pass between two neighbors, centers `h` apart: where the
/// sum of their distances is at most `h`. Cells before the first one of the band take its sign; a row beyond the band
/// stays positive, for [`fill`].
pub(super) fn along<T: Real>(
    inside: impl Fn(usize, u32) -> bool + Sync,
    h: f64,
) -> impl Fn(usize, &mut [T], &[u32]) + Sync {
    let apart = T::of(MARGIN * h);
    move |first, phi, closest| {
        let Some(start) = closest.iter().position(|&face| face != NO_TRIANGLE) else {
            return;
        };
        let mut is_inside = inside(first + start, closest[start]);
        let mut before = phi[start];
        phi[..=start].iter_mut().for_each(|phi| put(is_inside, phi));
        for k in start + 1..phi.len() {
            if closest[k] != NO_TRIANGLE && !(before + phi[k] > apart) {
                is_inside = inside(first + k, closest[k]);
            }
            before = phi[k];
            put(is_inside, &mut phi[k]);
        }
    }
}

/// Gives rows beyond the band, which must be wider than the distance between neighbors, the signs of the rows beside them.
/// They are positive, and as far from the surface as the band is wide; a row that ends just there has the sign of those beside it.
pub(super) fn fill<T: Real>([_, ny, nz]: [usize; 3], width: T, phi: &mut [T]) {
    let planes = phi.chunks_mut(ny * nz);
    let known = parallel::map_each(planes, |_, phi| fill_plane(nz, width, phi));
    carry(&known, |from, to| {
        let sign = phi[from * ny * nz] < T::zero();
        let plane = &mut phi[to * ny * nz..(to + 1) * ny * nz];
        parallel::for_each(plane, |_, phi| put(sign, phi));
    });
}

/// Fills the rows of a plane. Returns whether any of them reaches into the band.
fn fill_plane<T: Real>(nz: usize, width: T, phi: &mut [T]) -> bool {
    let in_band = |row: &[T]| row.iter().any(|&phi| phi != width);
    let known: Vec<bool> = phi.chunks_exact(nz).map(in_band).collect();
    carry(&known, |from, to| {
        let sign = phi[from * nz] < T::zero();
        let row = &mut phi[to * nz..(to + 1) * nz];
        row.iter_mut().for_each(|phi| put(sign, phi));
    })
}

/// Calls `fill(from, to)` for neighbors such that each item that is not known is filled from one that is. Returns whether
/// any is known.
fn carry(known: &[bool], mut fill: impl FnMut(usize, usize)) -> bool {
    let Some(first) = known.iter().position(|&known| known) else {
        return false;
    };
    (0..first).rev().for_each(|to| fill(to + 1, to));
    (first + 1..known.len())
        .filter(|&to| !known[to])
        .for_each(|to| fill(to - 1, to));
    true
}

/// Gives a distance its sign. Inside it is below 0 even on the surface.
#[inline(always)]
pub(super) fn put<T: Real>(is_inside: bool, phi: &mut T) {
    if is_inside {
        *phi = -phi.max(T::min_positive_value());
    }
}
