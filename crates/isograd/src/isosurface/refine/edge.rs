//! The spline along an edge of the refined lattice, and where its vertex lies.

use crate::data::LatticeEdge;
use crate::element::crossing::{bounded, crossing};
use crate::element::stencil::{bspline, bspline_slope};
use crate::{Field, Grid, Real};

/// Most steps to the crossing. Newton's method takes two or three.
const STEPS: usize = 30;

/// The odds of a vertex are at most so many times those of linear interpolation, and at least that part of them.
const SKEW: f64 = 16.0;

/// Length of an edge, in cells of the indicator.
const LENGTH: f64 = 0.5;

/// An edge between the centers of two cells half as large as those of the indicator.
pub(super) struct Edge {
    /// Cells of the indicator: four along the axis of the edge, from the one before that in which it starts, and three along
    /// the other two axes, in their order.
    along: [usize; 4],
    across: [[usize; 3]; 2],
    /// Weights of the cells across.
    weights: [[f64; 3]; 2],
    /// Where it starts, from the center of the cell of the indicator, in cells: ∓¼.
    start: f64,
}

/// Where a vertex lies on an edge.
pub(super) enum Crossing {
    /// Where the spline has the level, from 0 to 1.
    OnSpline(f64),
    /// With odds that are `skew` times those of linear interpolation between the `ends`, the spline less the level there.
    Bounded { ends: [f64; 2], skew: f64 },
}

impl Crossing {
    /// From 0 to 1.
    pub(super) fn fraction(&self) -> f64 {
        match *self {
            Self::OnSpline(fraction) => fraction,
            Self::Bounded { ends, skew } => skewed(ends, skew),
        }
    }
}

/// Where the odds are `skew` times those of linear interpolation.
fn skewed([below, above]: [f64; 2], skew: f64) -> f64 {
    crossing(skew * below, above, 0.0)
}

/// The spline at a place on an edge, as weights of 3 of the 4 cells along it.
pub(super) struct Place {
    /// The first of the three.
    first: usize,
    weights: [f64; 3],
    slopes: [f64; 3],
}

impl Edge {
    /// The edge with this name on the lattice of `fine`, for an indicator on `grid`.
    #[inline(always)]
    pub(super) fn new<T: Real>(grid: &Grid<T>, fine: &Grid<T>, edge: LatticeEdge) -> Self {
        let (cell, axis) = (fine.cell(edge.cell()), edge.axis());
        let others = sides(axis);
        Self {
            along: places(grid, axis, cell[axis]),
            across: others.map(|a| places(grid, a, cell[a])),
            weights: others.map(|a| std::array::from_fn(|t| super::weight(cell[a], t))),
            start: if cell[axis] % 2 == 0 { -0.25 } else { 0.25 },
        }
    }

    /// The spline at a fraction of the edge, from 0 to 1.
    #[inline(always)]
    pub(super) fn at(&self, fraction: f64) -> Place {
        let place = self.start + LENGTH * fraction;
        let first = usize::from(place > 0.5);
        let offset = place - first as f64;
        Place {
            first,
            weights: bspline(offset).into(),
            slopes: bspline_slope(offset).into(),
        }
    }

    /// Where the vertex lies, with [`Self::line`] of the indicator. One end is below the level and the other one is not.
    #[inline(always)]
    pub(super) fn crossing(&self, line: &[f64; 4], level: f64) -> Crossing {
        let excess = |fraction: f64| self.at(fraction).value(line) - level;
        let ends = [0.0, 1.0].map(excess);
        if (ends[0] < 0.0) == (ends[1] < 0.0) {
            // By rounding: the one that is nearer to the level is on the other side.
            let is_last = ends[1].abs() < ends[0].abs();
            return Crossing::OnSpline(if is_last { 1.0 } else { 0.0 });
        }
        let fraction = self.root(line, level, ends);
        let [least, most] = [1.0 / SKEW, SKEW];
        if fraction < skewed(ends, least) {
            Crossing::Bounded { ends, skew: least }
        } else if fraction > skewed(ends, most) {
            Crossing::Bounded { ends, skew: most }
        } else {
            Crossing::OnSpline(fraction)
        }
    }

    /// Where the spline has the level, as a fraction of the edge, from the spline less the level at both ends.
    #[inline(always)]
    fn root(&self, line: &[f64; 4], level: f64, [below, above]: [f64; 2]) -> f64 {
        let [mut low, mut high] = [0.0, 1.0];
        let mut fraction = crossing(below, above, 0.0);
        for _ in 0..STEPS {
            let at = self.at(fraction);
            let value = at.value(line) - level;
            match (value < 0.0) == (below < 0.0) {
                true => low = fraction,
                false => high = fraction,
            }
            let newton = fraction - value / (LENGTH * at.slope(line));
            let next = match newton >= low && newton <= high {
                true => newton,
                false => 0.5 * (low + high),
            };
            let step = (next - fraction).abs();
            fraction = next;
            if step < 1e-15 {
                break;
            }
        }
        fraction
    }

    /// From the cotangent `bar` of the vertex along the edge, in cells of the indicator. A slope less than `smallest` counts as
    /// that much.
    #[inline(always)]
    pub(super) fn pull(
        &self,
        line: &[f64; 4],
        crossing: &Crossing,
        bar: f64,
        smallest: f64,
    ) -> Pull {
        match *crossing {
            Crossing::OnSpline(fraction) => {
                let slope = self.at(fraction).slope(line);
                Pull {
                    parts: [(fraction, -bar / bounded(slope, smallest)), (0.0, 0.0)],
                    is_guarded: slope.abs() < smallest && bar != 0.0,
                }
            }
            Crossing::Bounded { ends, skew } => {
                let [below, above] = ends;
                let difference = above - skew * below;
                let pull = LENGTH * bar / bounded(difference, smallest);
                let fraction = crossing.fraction();
                Pull {
                    parts: [
                        (0.0, pull * skew * (fraction - 1.0)),
                        (1.0, -pull * fraction),
                    ],
                    is_guarded: difference.abs() < smallest && bar != 0.0,
                }
            }
        }
    }

    /// The values of `chi` in the cells along the edge, each the weighted sum over the cells across.
    #[inline(always)]
    pub(super) fn line<T: Real>(&self, chi: &Field<T>) -> [f64; 4] {
        let mut line = [0.0; 4];
        self.for_each_across(|offset, weight| {
            for (sum, cell) in line.iter_mut().zip(self.along) {
                *sum += weight * chi.values()[offset + cell].f64();
            }
        });
        line
    }

    /// Calls `visit` for the 3³ cells that have a weight at a place, with their place in memory.
    #[inline(always)]
    pub(super) fn for_each_cell(&self, at: &Place, mut visit: impl FnMut(usize, f64)) {
        self.for_each_across(|offset, weight| {
            for (cell, along) in self.along[at.first..].iter().zip(at.weights) {
                visit(offset + cell, weight * along);
            }
        });
    }

    /// Calls `visit` for the 3² rows of cells along the edge, with the place in memory to which those of [`Self::along`] are
    /// added, and their weight.
    #[inline(always)]
    fn for_each_across(&self, mut visit: impl FnMut(usize, f64)) {
        for (first, x) in self.across[0].into_iter().zip(self.weights[0]) {
            for (second, y) in self.across[1].into_iter().zip(self.weights[1]) {
                visit(first + second, x * y);
            }
        }
    }
}

/// Cotangents of the spline on an edge, from that of its vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pull {
    /// One or two places, as fractions of the edge, and the cotangent at each; 0 for none.
    pub parts: [(f64, f64); 2],
    /// Whether a slope was bounded.
    pub is_guarded: bool,
}

impl Place {
    #[inline(always)]
    fn value(&self, line: &[f64; 4]) -> f64 {
        let weights = self.weights.iter().zip(&line[self.first..]);
        weights.map(|(weight, value)| weight * value).sum()
    }

    /// The slope of the spline along the edge, per cell of the indicator.
    #[inline(always)]
    pub(super) fn slope(&self, line: &[f64; 4]) -> f64 {
        let slopes = self.slopes.iter().zip(&line[self.first..]);
        slopes.map(|(slope, value)| slope * value).sum()
    }
}

/// The two other axes.
fn sides(axis: usize) -> [usize; 2] {
    [usize::from(axis == 0), if axis == 2 { 1 } else { 2 }]
}

/// Places in memory, along one axis, of the cells of the indicator from the one before that of cell `half` of the refined
/// grid on.
#[inline(always)]
fn places<T: Real, const N: usize>(grid: &Grid<T>, axis: usize, half: usize) -> [usize; N] {
    std::array::from_fn(|n| super::cell_near(grid.shape()[axis], half, n) * grid.strides()[axis])
}
