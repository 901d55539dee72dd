//! Formulas of single elements: small pure functions of numbers, apart from the loops that call them.
//!
//! The files beside this one are compiled twice: here as plain Rust, and in `isograd-gpu`, where the cfg
//! `cube` makes parts of kernels of the same lines.

pub mod coupling;
pub mod crossing;
pub mod curvature;
pub mod difference;
pub mod disc;
pub mod evidence;
pub mod fit;
pub mod hat;
pub mod linear;
pub mod plane;
pub mod plate;
pub mod sheet;
pub mod sight;
pub mod spline;
pub mod turned;
pub mod winding;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number in a formula. In kernels, CubeCL's `Float` stands in its place.
pub trait Element:
    Copy
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// The same value. Constants that `f32` can't hold are quotients of those that it can.
    fn new(x: f32) -> Self;
}

impl Element for f32 {
    #[inline(always)]
    fn new(x: f32) -> Self {
        x
    }
}

impl Element for f64 {
    #[inline(always)]
    fn new(x: f32) -> Self {
        f64::from(x)
    }
}
