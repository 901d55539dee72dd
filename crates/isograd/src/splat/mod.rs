//! The splat stage.
