//! The orient stage.
