//! The command line of isograd.
fn main() {}
