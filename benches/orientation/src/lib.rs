//! Clouds whose normals are known, and the share of signs that come out wrong on them.
#![warn(missing_docs)]

pub mod body;
pub mod measure;
pub mod page;
pub mod pictures;
pub mod study;
pub mod suite;
