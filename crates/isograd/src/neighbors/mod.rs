//! The neighbors stage.
