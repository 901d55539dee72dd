//! One-sided differences at the ends of an axis of `n` cells: weights of the values 1, 2 and 3 `step`s inward,
//! each less the value at the end. Second order, where the axis is long enough for that.

use crate::element::Element;

/// Of the first difference; `side` is 1 at the low end and −1 at the high one.
#[inline(always)]
pub(super) fn first_inward<F: Element>(n: usize, step: usize, side: F) -> F {
    if step == 1 {
        if n < 3 { side } else { F::new(2.0) * side }
    } else if step == 2 && n >= 3 {
        F::new(-0.5) * side
    } else {
        F::new(0.0)
    }
}

/// Of the second difference.
#[inline(always)]
pub(super) fn second_inward<F: Element>(n: usize, step: usize) -> F {
    if n < 3 {
        F::new(0.0)
    } else if step == 1 {
        if n == 3 { F::new(-2.0) } else { F::new(-5.0) }
    } else if step == 2 {
        if n == 3 { F::new(1.0) } else { F::new(4.0) }
    } else if n == 3 {
        F::new(0.0)
    } else {
        F::new(-1.0)
    }
}
