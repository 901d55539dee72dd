//! What the generated pages share: tables, numbers, sentences and charts.

pub mod bars;
pub mod chart;
pub mod layout;
pub mod table;
pub mod text;
