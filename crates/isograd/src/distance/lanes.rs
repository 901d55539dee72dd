//! Small helpers on fixed arrays, one lane per point or box. Written as plain loops: inside
//! `pulp::Arch::dispatch` they become the widest vector code of the machine, with the same bits on every one.

/// The largest entry (no NaN among them).
#[inline(always)]
pub(super) fn largest<const N: usize>(x: &[f64; N]) -> f64 {
    let mut m = x[0];
    for l in 1..N {
        m = if x[l] > m { x[l] } else { m };
    }
    m
}

/// The least entry (no NaN among them).
#[inline(always)]
pub(super) fn least<const N: usize>(x: &[f64; N]) -> f64 {
    let mut m = x[0];
    for l in 1..N {
        m = if x[l] < m { x[l] } else { m };
    }
    m
}
