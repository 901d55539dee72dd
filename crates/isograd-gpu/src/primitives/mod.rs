//! What several stages need: sums from the beginning, orders, totals.

pub mod scan;
pub mod sort;
