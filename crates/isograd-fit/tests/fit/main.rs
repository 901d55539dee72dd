//! Whole fits, on the CPU and on a device.

mod device;
mod fits;
