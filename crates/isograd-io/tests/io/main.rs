//! Tests of the readers and writers.

mod files;
mod formats;
mod headers;
mod hostile;
mod mutations;
mod names;
mod options;
mod round_trips;
mod stopping;
mod surfaces;
mod traps;
