//! Calls that launch every kernel. The data are nothing; counts that host code asks for are answered.

use isograd_gpu::primitives::{scan, sort};
use isograd_gpu::{Device, Scalar};

use crate::recorder::Recorder;

/// Launches all kernels for one number type.
pub fn launch_all<T: Scalar>(device: &Device<Recorder>) {
    primitives(device);
}

fn primitives(device: &Device<Recorder>) {
    let values = device.empty::<u32>(1000).unwrap();
    scan::exclusive_sum(device, &values).unwrap();
    let order = sort::order(device, &values, 300).unwrap();
    sort::starts(device, &order.keys, 300).unwrap();
}
