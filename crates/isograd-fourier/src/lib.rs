#![doc = include_str!("../README.md")]

use std::sync::Arc;

use rustfft::{FftNum, FftPlanner};

pub use rustfft::{Fft, num_complex};

/// A number type with Fourier transforms: `f32` or `f64`.
pub trait Fourier: FftNum {
    /// Forward and inverse transforms of lines of `n` complex numbers, neither of them normalized.
    fn transforms(n: usize) -> [Arc<dyn Fft<Self>>; 2];
}

impl Fourier for f32 {
    #[inline(never)]
    fn transforms(n: usize) -> [Arc<dyn Fft<Self>>; 2] {
        plan(n)
    }
}

impl Fourier for f64 {
    #[inline(never)]
    fn transforms(n: usize) -> [Arc<dyn Fft<Self>>; 2] {
        plan(n)
    }
}

fn plan<T: FftNum>(n: usize) -> [Arc<dyn Fft<T>>; 2] {
    let mut planner = FftPlanner::new();
    [planner.plan_fft_forward(n), planner.plan_fft_inverse(n)]
}
