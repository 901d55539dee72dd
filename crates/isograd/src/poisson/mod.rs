//! The poisson stage.
