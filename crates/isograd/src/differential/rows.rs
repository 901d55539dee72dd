//! Finite differences, a row of cells at a time.
//!
//! A difference is `Σ_t w_t (u_t − u)`: neighbors less the cell's own value, so that large values that
//! differ little lose nothing.

use super::difference::{first_inward, second_inward};
use crate::Real;
use crate::data::Field;

/// Which derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    First,
    Second,
}

/// Three places along an axis, and the weight of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stencil<T> {
    pub(super) at: [usize; 3],
    pub(super) weight: [T; 3],
}

impl<T: Real> Stencil<T> {
    /// The difference at cell `i` of `n`: central, or one-sided at the two ends. Second order, where the
    /// axis is long enough for that.
    #[inline(always)]
    pub(super) fn new(order: Order, n: usize, i: usize) -> Self {
        if i > 0 && i + 1 < n {
            let weight = match order {
                Order::First => [0.5, -0.5, 0.0],
                Order::Second => [1.0, 1.0, 0.0],
            };
            return Self {
                at: [i + 1, i - 1, i],
                weight: weight.map(T::of),
            };
        }
        // The sign of a first difference turns with the direction in which the cells are counted.
        let side = if i == 0 { 1.0 } else { -1.0 };
        let weight = |step| match order {
            Order::First => first_inward(n, step, side),
            Order::Second => second_inward(n, step),
        };
        let inward = |steps: usize| {
            let steps = steps.min(n - 1);
            if i == 0 { steps } else { i - steps }
        };
        Self {
            at: [1, 2, 3].map(inward),
            weight: [1, 2, 3].map(|step| T::of(weight(step))),
        }
    }

    /// The difference of `value(place)` at a cell with value `own`.
    #[inline(always)]
    pub(super) fn apply(&self, own: T, value: impl Fn(usize) -> T) -> T {
        let term = |t: usize| self.weight[t] * (value(self.at[t]) - own);
        term(0) + term(1) + term(2)
    }
}

/// `N` rows of `n` zeros.
pub(super) fn buffers<T: Real, const N: usize>(n: usize) -> [Vec<T>; N] {
    std::array::from_fn(|_| vec![T::zero(); n])
}

/// Values in memory order, seen as rows along z. Differences are per unit length: divided by `h` once for
/// a first one; a second one is left times `h`, the natural size of a curvature in cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a, T> {
    pub(super) values: &'a [T],
    pub(super) shape: [usize; 3],
    inverse: T,
}

impl<'a, T: Real> Rows<'a, T> {
    pub(super) fn of(field: &'a Field<T>) -> Self {
        Self::new(field.values(), field)
    }

    /// Of other values on the grid of a field.
    pub(super) fn new(values: &'a [T], field: &Field<T>) -> Self {
        let grid = field.grid();
        Self {
            values,
            shape: grid.shape(),
            inverse: grid.spacing().recip(),
        }
    }

    #[inline(always)]
    pub(super) fn row(&self, [i, j]: [usize; 2]) -> &'a [T] {
        let n = self.shape[2];
        let start = (i * self.shape[1] + j) * n;
        &self.values[start..start + n]
    }

    /// The difference along x (`axis` 0) or y (1).
    #[inline(always)]
    pub(super) fn across(&self, order: Order, axis: usize, at: [usize; 2], out: &mut [T]) {
        let stencil = Stencil::new(order, self.shape[axis], at[axis]);
        let rows = stencil.at.map(|place| {
            let mut there = at;
            there[axis] = place;
            self.row(there)
        });
        combine(
            self.row(at),
            rows,
            stencil.weight.map(|w: T| w * self.inverse),
            out,
        );
    }

    /// The difference along z.
    #[inline(always)]
    pub(super) fn along(&self, order: Order, at: [usize; 2], out: &mut [T]) {
        along(order, self.row(at), self.inverse, out);
    }

    /// `∇φ` on a row.
    #[inline(always)]
    pub(super) fn gradient(&self, at: [usize; 2], [x, y, z]: &mut [Vec<T>; 3]) {
        self.across(Order::First, 0, at, x);
        self.across(Order::First, 1, at, y);
        self.along(Order::First, at, z);
    }
}

/// `Σ_t weight_t (row_t − own)`.
#[inline(always)]
pub(super) fn combine<T: Real>(own: &[T], rows: [&[T]; 3], weight: [T; 3], out: &mut [T]) {
    let n = out.len();
    let (own, [a, b, c]) = (&own[..n], rows.map(|r| &r[..n]));
    for k in 0..n {
        out[k] =
            weight[0] * (a[k] - own[k]) + weight[1] * (b[k] - own[k]) + weight[2] * (c[k] - own[k]);
    }
}

/// The difference within a row, times `factor`.
#[inline(always)]
pub(super) fn along<T: Real>(order: Order, row: &[T], factor: T, out: &mut [T]) {
    let n = row.len();
    if n > 2 {
        let w = Stencil::<T>::new(order, n, 1).weight.map(|w: T| w * factor);
        let own = &row[1..n - 1];
        combine(own, [&row[2..], &row[..n - 2], own], w, &mut out[1..n - 1]);
    }
    for k in [0, n - 1] {
        out[k] = factor * Stencil::new(order, n, k).apply(row[k], |at| row[at]);
    }
}
