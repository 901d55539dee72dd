//! The normals stage.
