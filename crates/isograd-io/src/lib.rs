//! Readers and writers of point clouds, meshes and fields.
