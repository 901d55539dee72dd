//! Building blocks of several stages: prefix sums, orders, totals, extremes, flags, medians of a few numbers.

pub(crate) mod ends;
pub mod fill;
pub(crate) mod flags;
pub(crate) mod morton;
pub mod reduce;
pub mod scan;
pub(crate) mod segments;
pub(crate) mod smallest;
pub mod sort;
