//! The isosurface stage.
