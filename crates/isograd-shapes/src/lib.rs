//! Parametric bodies whose points, normals, volumes and (where known) distances are exact.
