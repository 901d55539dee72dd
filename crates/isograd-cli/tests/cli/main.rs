//! The command line, run as a user runs it.

mod attributes;
mod backend;
mod bad_input;
mod clean;
mod fields;
mod fit;
mod generate;
mod gradcheck;
#[cfg(target_os = "linux")]
mod memory;
mod numbers;
mod orient;
mod outputs;
#[cfg(target_os = "linux")]
mod process;
mod reading;
mod real_clouds;
mod real_gradients;
mod real_verdicts;
mod reconstruct;
mod sandbox;
mod several;
mod shared_data;
mod tools;
#[cfg(unix)]
mod writing;
