//! The command line, run as a user runs it.

mod backend;
mod bad_input;
mod clean;
mod fields;
mod fit;
mod gradcheck;
#[cfg(target_os = "linux")]
mod memory;
mod orient;
#[cfg(target_os = "linux")]
mod process;
mod reading;
mod real_clouds;
mod real_gradients;
mod real_verdicts;
mod reconstruct;
mod sandbox;
mod tools;
#[cfg(unix)]
mod writing;
