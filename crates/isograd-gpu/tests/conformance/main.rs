//! Every kernel beside the CPU's stage or a plain loop, on each device that is here.

mod devices;
mod primitives;
