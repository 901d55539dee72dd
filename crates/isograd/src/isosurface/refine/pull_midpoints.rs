//! Cotangents of the midpoints to cotangents of the vertices between which they lie, the indicator and the level.

use rayon::prelude::*;

use super::midpoint::{Patch, Place, Step, middle};
use crate::isosurface::blocks::{Square, sides};
use crate::{Field, Grid, Mesh, Real};

/// Midpoints that were moved onto the surface, with what their cotangents are worth.
pub(super) struct Midpoints(Vec<Midpoint>);

struct Midpoint {
    /// Cell of the refined grid along x in which its square starts.
    half: usize,
    patch: Patch,
    at: Place,
    /// Cotangents of `χ` and its slopes along both sides, at the midpoint.
    pulls: [f64; 3],
    /// Of each of both ends, in the user's unit.
    ends: [f64; 3],
    is_guarded: bool,
}

impl Midpoints {
    /// From the cotangents of all vertices; where `∇χ` is less than `smallest`, the step counts as constant.
    pub(super) fn new<T: Real>(
        chi: &Field<T>,
        level: T,
        refined: &Grid<T>,
        mesh: &Mesh<T>,
        bars: &[[T; 3]],
        smallest: f64,
    ) -> Self {
        let midpoints = mesh.midpoints().par_iter().zip(&bars[mesh.edges().len()..]);
        let pull = |(&ends, &bar): (&[u32; 2], &[T; 3])| {
            let square = square_of(refined, mesh, ends);
            let sides = square.sides();
            let place = |vertex: u32| {
                let index = refined.to_index(mesh.vertices()[vertex as usize]);
                let along = |side: usize| index[side].f64() - square.cell[side] as f64 - 0.5;
                sides.map(|side| T::of(along(side).clamp(0.0, 1.0)))
            };
            let middle = middle(ends.map(place));
            let patch = Patch::new(chi.grid(), square);
            let at = patch.at(middle);
            let table = patch.table(chi);
            let bar = bar.map(|bar| bar.f64());
            let mut of = Midpoint {
                half: square.cell[0],
                patch,
                at,
                pulls: [0.0; 3],
                ends: bar.map(|bar| 0.5 * bar),
                is_guarded: false,
            };
            // `None` where rounding makes a midpoint of a segment that is hardly split one that stays.
            let Some(step) = Step::new(&of.at, &table, level.f64()) else {
                return of;
            };
            of.is_guarded = step.is_flat(smallest) && bar != [0.0; 3];
            if step.is_flat(smallest) {
                return of;
            }
            let spacing = refined.spacing().f64();
            let found = step.pullback(middle, sides.map(|side| bar[side] * spacing));
            let gradient = step.gradient();
            let bends = of.at.bends(&table);
            of.pulls = [found.excess, found.gradient[0], found.gradient[1]];
            for (n, side) in sides.into_iter().enumerate() {
                let by_gradient = bends[n][0] * found.gradient[0] + bends[n][1] * found.gradient[1];
                let bar = found.middle[n] + found.excess * gradient[n] + by_gradient;
                of.ends[side] = 0.5 * bar / spacing;
            }
            of
        };
        Self(midpoints.map(pull).collect())
    }

    /// Adds the parts of the ends to the cotangents of their vertices.
    pub(super) fn add_to_ends<T: Real>(&self, ends: &[[u32; 2]], bars: &mut [[T; 3]]) {
        for (of, ends) in self.0.iter().zip(ends) {
            for &end in ends {
                for (bar, part) in bars[end as usize].iter_mut().zip(of.ends) {
                    *bar += T::of(part);
                }
            }
        }
    }

    /// The cell of the refined grid along x in which the square of one starts.
    pub(super) fn half(&self, midpoint: usize) -> usize {
        self.0[midpoint].half
    }

    /// The cotangent of the level of one, and whether it was left out.
    pub(super) fn of_level(&self, midpoint: usize) -> (f64, bool) {
        let of = &self.0[midpoint];
        (-of.pulls[0], of.is_guarded)
    }

    /// Calls `visit` with the place in memory and the cotangent of each cell that has a weight at a midpoint.
    pub(super) fn for_each_cell(&self, midpoint: usize, mut visit: impl FnMut(usize, f64)) {
        let of = &self.0[midpoint];
        of.patch.for_each_cell(&of.at, |cell, weights| {
            visit(cell, (0..3).map(|n| weights[n] * of.pulls[n]).sum());
        });
    }
}

/// The square on whose sides both ends of a midpoint lie.
fn square_of<T: Real>(refined: &Grid<T>, mesh: &Mesh<T>, ends: [u32; 2]) -> Square {
    let [first, second] = ends.map(|end| mesh.edges()[end as usize]);
    let [a, b] = [first, second].map(|edge| refined.cell(edge.cell()));
    let is_across =
        |axis: &usize| a[*axis] == b[*axis] && ![first.axis(), second.axis()].contains(axis);
    // Two edges of a square lie in one plane only.
    let axis = (0..3).find(is_across).unwrap_or_default();
    let mut cell = a;
    for side in sides(axis) {
        cell[side] = a[side].min(b[side]);
    }
    Square { cell, axis }
}
