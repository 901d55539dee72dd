//! The distance stage.
