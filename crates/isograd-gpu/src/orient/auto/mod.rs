//! The parts of the automatic method: see [`isograd::orient`].

pub mod fill;
