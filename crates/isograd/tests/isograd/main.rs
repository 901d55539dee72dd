//! One program for all tests that need none of their own, since each program compiles the stages again.

mod common;
mod continuity;
mod determinism;
mod finite;
mod gradients;
mod orientation;
mod pinned_bits;
mod query;
mod sparse_solve;
mod surface_resolution;
mod thin_parts;
mod torus_accuracy;
mod vertex_values;
mod warnings;
