//! The command line, run as a user runs it.

mod backend;
mod bad_input;
mod fit;
mod gradcheck;
mod orient;
mod reading;
mod real_clouds;
mod real_gradients;
mod reconstruct;
mod sandbox;
mod tools;
