//! What the generated pages share: tables, numbers, sentences, charts, and the program that writes them.

pub mod bars;
pub mod chart;
pub mod layout;
pub mod program;
pub mod statistics;
pub mod table;
pub mod text;
