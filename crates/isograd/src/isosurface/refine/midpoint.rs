//! The midpoint of a segment, moved onto the surface of the spline within a square of the refined lattice.

use super::super::blocks::{Places, Square};
use super::edge::{Edge, LENGTH, places};
use crate::data::blocks::BlockField;
use crate::element::stencil::{bspline, bspline_slope};
use crate::{Field, Grid, LatticeEdge, Real};

/// How far the midpoint of a segment is off the surface, in cells of the refined lattice, from where on it is moved, and from
/// where on all the way.
const OFF: [f64; 2] = [0.01, 0.03];

/// Second derivatives of a quadratic B-spline.
const BENDS: [f64; 3] = [1.0, -2.0, 1.0];

/// Vertices and midpoints on the surface of the spline of an indicator.
pub(crate) struct OnSpline<'a, T> {
    pub chi: &'a Field<T>,
    /// That of [`forward`](super::forward).
    pub refined: &'a BlockField<T>,
    pub level: T,
}

impl<T: Real> Places<T> for OnSpline<'_, T> {
    const SPLITS: bool = true;

    fn on_edge(&self, edge: LatticeEdge) -> T {
        let edge = Edge::new(self.chi.grid(), &self.refined.grid, edge);
        let crossing = edge.crossing(&edge.line(self.chi), self.level.f64());
        T::of(crossing.fraction())
    }

    fn in_square(&self, square: Square, ends: [[T; 2]; 2]) -> Option<[T; 2]> {
        let patch = Patch::new(self.chi.grid(), square);
        let table = patch.table(self.chi);
        let middle = middle(ends);
        let step = Step::new(&patch.at(middle), &table, self.level.f64())?;
        Some(step.end(middle).map(T::of))
    }
}

/// Between two ends.
pub(super) fn middle<T: Real>([a, b]: [[T; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|side| 0.5 * (a[side].f64() + b[side].f64()))
}

/// The spline in a square between the centers of four cells half as large as those of the indicator.
pub(super) struct Patch {
    /// Cells of the indicator: four along each side of the square, from the one before that in which it starts, and three
    /// across.
    along: [[usize; 4]; 2],
    across: [usize; 3],
    /// Weights of the cells across.
    weights: [f64; 3],
    /// Where it starts, from the center of the cell of the indicator, in cells: ∓¼.
    start: [f64; 2],
}

/// Weights of 3 of the 4 cells along one side of a square, and their first two derivatives by the place in the square.
struct Row {
    first: usize,
    weights: [[f64; 3]; 3],
}

/// A place in a square.
pub(super) struct Place([Row; 2]);

impl Patch {
    /// That of a square of the refined lattice, for an indicator on `grid`.
    pub(super) fn new<T: Real>(grid: &Grid<T>, square: Square) -> Self {
        let (cell, axis, sides) = (square.cell, square.axis, square.sides());
        Self {
            along: sides.map(|a| places(grid, a, cell[a])),
            across: places(grid, axis, cell[axis]),
            weights: std::array::from_fn(|t| super::weight(cell[axis], t)),
            start: sides.map(|a| if cell[a] % 2 == 0 { -0.25 } else { 0.25 }),
        }
    }

    /// The spline at a place, from 0 to 1 along both sides.
    pub(super) fn at(&self, place: [f64; 2]) -> Place {
        Place([0, 1].map(|side| {
            let at = self.start[side] + LENGTH * place[side];
            let first = usize::from(at > 0.5);
            let offset = at - first as f64;
            let slopes: [f64; 3] = bspline_slope(offset).into();
            Row {
                first,
                weights: [
                    bspline(offset).into(),
                    slopes.map(|slope| LENGTH * slope),
                    BENDS.map(|bend| LENGTH * LENGTH * bend),
                ],
            }
        }))
    }

    /// The values of `chi` in the cells along both sides, each the weighted sum over the cells across.
    pub(super) fn table<T: Real>(&self, chi: &Field<T>) -> [[f64; 4]; 4] {
        let [x, y] = self.along;
        x.map(|x| {
            y.map(|y| {
                let across = self.across.iter().zip(self.weights);
                let value = |z: usize| chi.values()[x + y + z].f64();
                across.map(|(&z, weight)| weight * value(z)).sum()
            })
        })
    }

    /// Calls `visit` for the 3³ cells that have a weight at a place, with their place in memory and the weights of the value
    /// and of its derivatives along both sides.
    pub(super) fn for_each_cell(&self, at: &Place, mut visit: impl FnMut(usize, [f64; 3])) {
        let [x, y] = &at.0;
        for i in 0..3 {
            for j in 0..3 {
                let offset = self.along[0][x.first + i] + self.along[1][y.first + j];
                let weights =
                    [[0, 0], [1, 0], [0, 1]].map(|[a, b]| x.weights[a][i] * y.weights[b][j]);
                for (&z, across) in self.across.iter().zip(self.weights) {
                    visit(offset + z, weights.map(|weight| weight * across));
                }
            }
        }
    }
}

impl Place {
    /// The spline, or a derivative: how often along each side.
    fn derivative(&self, table: &[[f64; 4]; 4], [a, b]: [usize; 2]) -> f64 {
        let [x, y] = &self.0;
        let rows = x.weights[a].iter().zip(&table[x.first..]);
        let row = |row: &[f64; 4]| -> f64 {
            let values = y.weights[b].iter().zip(&row[y.first..]);
            values.map(|(weight, value)| weight * value).sum()
        };
        rows.map(|(weight, values)| weight * row(values)).sum()
    }

    /// `∂²χ` along both sides, and mixed.
    pub(super) fn bends(&self, table: &[[f64; 4]; 4]) -> [[f64; 2]; 2] {
        let [xx, xy, yy] = [[2, 0], [1, 1], [0, 2]].map(|order| self.derivative(table, order));
        [[xx, xy], [xy, yy]]
    }
}

/// How a midpoint moves: `e = −w F g/(g² + F²)`, with `F = χ − c` and `g = ∇χ` at it, both in the square: where χ is nearly
/// linear Newton's step, and half the side of a square at most. The share `w` rises from 0 to 1 while the distance `|F|/|g|`
/// does from one end of [`OFF`] to the other. All but `e` is in units of `m = |(F, g)|`, whose square may not be a number.
pub(super) struct Step {
    excess: f64,
    gradient: [f64; 2],
    share: f64,
    /// By the distance.
    share_slope: f64,
    /// `m`.
    size: f64,
}

/// Cotangents of `F`, `g` and the place of the midpoint.
pub(super) struct StepCotangent {
    pub excess: f64,
    pub gradient: [f64; 2],
    pub middle: [f64; 2],
}

impl Step {
    /// `None` if the midpoint stays.
    pub(super) fn new(at: &Place, table: &[[f64; 4]; 4], level: f64) -> Option<Self> {
        let excess = at.derivative(table, [0, 0]) - level;
        let gradient = [[1, 0], [0, 1]].map(|order| at.derivative(table, order));
        let slope = gradient[0].hypot(gradient[1]);
        let [from, to] = OFF;
        if excess.abs() <= from * slope {
            return None;
        }
        let rise = ((excess.abs() / slope - from) / (to - from)).min(1.0);
        let size = slope.hypot(excess);
        Some(Self {
            excess: excess / size,
            gradient: gradient.map(|slope| slope / size),
            size,
            share: rise * rise * (3.0 - 2.0 * rise),
            share_slope: 6.0 * rise * (1.0 - rise) / (to - from),
        })
    }

    fn whole(&self) -> [f64; 2] {
        let factor = -self.share * self.excess;
        self.gradient.map(|slope| factor * slope)
    }

    /// The largest share of the step, at most 1, with which it ends in the square, and the side that limits it.
    fn limit(&self, middle: [f64; 2]) -> (f64, Option<usize>) {
        let mut limit = (1.0, None);
        for (side, step) in self.whole().into_iter().enumerate() {
            let room = if step > 0.0 {
                1.0 - middle[side]
            } else {
                -middle[side]
            };
            if step != 0.0 && room / step < limit.0 {
                limit = (room / step, Some(side));
            }
        }
        limit
    }

    /// Where the midpoint comes to lie.
    pub(super) fn end(&self, middle: [f64; 2]) -> [f64; 2] {
        let (limit, step) = (self.limit(middle).0, self.whole());
        [0, 1].map(|side| (middle[side] + limit * step[side]).clamp(0.0, 1.0))
    }

    /// From the cotangent of [`Self::end`].
    pub(super) fn pullback(&self, middle: [f64; 2], bar: [f64; 2]) -> StepCotangent {
        let (limit, side) = self.limit(middle);
        let step = self.whole();
        let mut middle_bar = bar;
        let mut step_bar = bar.map(|bar| limit * bar);
        if let Some(side) = side {
            let limit_bar = bar[0] * step[0] + bar[1] * step[1];
            middle_bar[side] -= limit_bar / step[side];
            step_bar[side] -= limit_bar * limit / step[side];
        }
        // `F² + g²` is 1.
        let (excess, gradient) = (self.excess, self.gradient);
        let along = gradient[0] * step_bar[0] + gradient[1] * step_bar[1];
        let share_bar = -excess * along;
        let divisor_bar = self.share * excess * along;
        let mut of = StepCotangent {
            excess: -self.share * along + 2.0 * excess * divisor_bar,
            gradient: [0, 1].map(|side| {
                2.0 * gradient[side] * divisor_bar - self.share * excess * step_bar[side]
            }),
            middle: middle_bar,
        };
        if self.share_slope > 0.0 {
            // The distance is |F|/|g|.
            let slope = gradient[0].hypot(gradient[1]);
            let distance_bar = self.share_slope * share_bar;
            of.excess += distance_bar * excess.signum() / slope;
            for side in 0..2 {
                of.gradient[side] -=
                    distance_bar * excess.abs() * gradient[side] / (slope * slope * slope);
            }
        }
        of.excess /= self.size;
        of.gradient = of.gradient.map(|bar| bar / self.size);
        of
    }

    /// `g`.
    pub(super) fn gradient(&self) -> [f64; 2] {
        self.gradient.map(|slope| slope * self.size)
    }

    /// Whether the spline has no slope over `smallest` and hardly another value than that of the surface.
    pub(super) fn is_flat(&self, smallest: f64) -> bool {
        self.size < smallest
    }
}
