//! Tests of the readers and writers.

mod files;
mod formats;
mod headers;
mod hostile;
mod meshes;
mod mutations;
mod names;
mod options;
mod polygons;
mod round_trips;
mod scans;
mod stopping;
mod surfaces;
mod traps;
