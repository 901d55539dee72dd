//! Transposed finite differences, a row of cells at a time: each cell gathers from the differences that use it.

use super::rows::{Order, Stencil};
use crate::Real;

/// The cells along an axis whose difference takes the value at one place, with the weight that it has there: the
/// neighbors, the place itself, and the two ends, whose differences reach three cells inward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column<T> {
    pub(super) at: [usize; 5],
    pub(super) weight: [T; 5],
}

impl<T: Real> Column<T> {
    /// Of place `i` on an axis of `n` cells.
    #[inline(always)]
    pub(super) fn new(order: Order, n: usize, i: usize) -> Self {
        let at = [i.saturating_sub(1), (i + 1).min(n - 1), i, 0, n - 1];
        let weight = |t: usize| {
            if at[..t].contains(&at[t]) {
                T::zero()
            } else {
                weight_of(order, n, at[t], i)
            }
        };
        Self {
            at,
            weight: [0, 1, 2, 3, 4].map(weight),
        }
    }
}

/// The weight of the value at `column` in the difference at `row`.
#[inline(always)]
fn weight_of<T: Real>(order: Order, n: usize, row: usize, column: usize) -> T {
    let stencil = Stencil::<T>::new(order, n, row);
    let mut sum = T::zero();
    for (at, weight) in stencil.at.into_iter().zip(stencil.weight) {
        if at == column {
            sum += weight;
        }
        if row == column {
            sum -= weight;
        }
    }
    sum
}

/// Rows of values: where row 0 begins, and how far the next one is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strided<'a, U> {
    pub(super) values: &'a [U],
    pub(super) start: usize,
    pub(super) stride: usize,
}

/// Adds `factor Σ_t weight_t row(at_t)`: the transpose of a difference across rows.
#[inline(always)]
pub(super) fn add_across<T: Real, U>(
    column: &Column<T>,
    factor: T,
    rows: Strided<'_, U>,
    pick: impl Fn(&U) -> T,
    out: &mut [T],
) {
    let n = out.len();
    for t in 0..5 {
        let weight = factor * column.weight[t];
        if weight == T::zero() {
            continue;
        }
        let row = &rows.values[rows.start + column.at[t] * rows.stride..][..n];
        for k in 0..n {
            out[k] += weight * pick(&row[k]);
        }
    }
}

/// Adds `factor` times the transpose of a difference within a row.
#[inline(always)]
pub(super) fn add_along<T: Real, U>(
    order: Order,
    factor: T,
    row: &[U],
    pick: impl Fn(&U) -> T,
    out: &mut [T],
) {
    let n = row.len();
    // From here on no end reaches.
    let ends = 4.min(n)..n.saturating_sub(4).max(4.min(n));
    if !ends.is_empty() {
        let [low, high, own, ..] = Column::<T>::new(order, n, 4).weight.map(|w: T| w * factor);
        let (before, after) = (&row[ends.start - 1..], &row[ends.start + 1..]);
        let (here, out) = (&row[ends.clone()], &mut out[ends.clone()]);
        let n = out.len();
        let (before, after, here) = (&before[..n], &after[..n], &here[..n]);
        for k in 0..n {
            out[k] += low * pick(&before[k]) + high * pick(&after[k]) + own * pick(&here[k]);
        }
    }
    for k in (0..ends.start).chain(ends.end..n) {
        let column = Column::<T>::new(order, n, k);
        for t in 0..5 {
            out[k] += factor * column.weight[t] * pick(&row[column.at[t]]);
        }
    }
}

/// Identity.
#[inline(always)]
pub(super) fn same<T: Real>(x: &T) -> T {
    *x
}

/// A component of a vector.
#[inline(always)]
pub(super) fn component<const A: usize, T: Real>(v: &[T; 3]) -> T {
    v[A]
}
