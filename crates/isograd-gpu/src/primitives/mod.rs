//! What several stages need: sums from the beginning, orders, totals.

pub mod fill;
pub mod reduce;
pub mod scan;
pub(crate) mod segments;
pub mod sort;
