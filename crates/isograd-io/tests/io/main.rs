//! Tests of the readers and writers.

mod files;
mod formats;
mod mutations;
mod round_trips;
mod stopping;
mod traps;
