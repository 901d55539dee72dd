//! The automatic orientation on the device: the parts of [`isograd::orient::Method::Auto`].

pub mod graph;
