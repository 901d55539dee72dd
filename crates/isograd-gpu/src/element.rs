//! The formulas of [`isograd::element`], compiled as parts of kernels: the same files.

/// A number in a formula.
pub(crate) use cubecl::prelude::Float as Element;

#[path = "../../isograd/src/element/plane.rs"]
pub(crate) mod plane;

#[path = "../../isograd/src/element/crossing.rs"]
pub(crate) mod crossing;
#[path = "../../isograd/src/element/curvature.rs"]
pub(crate) mod curvature;
#[path = "../../isograd/src/element/difference.rs"]
pub(crate) mod difference;
#[path = "../../isograd/src/element/fit.rs"]
pub(crate) mod fit;
#[path = "../../isograd/src/element/hat.rs"]
pub(crate) mod hat;
#[path = "../../isograd/src/element/linear.rs"]
pub(crate) mod linear;
#[path = "../../isograd/src/element/plate.rs"]
pub(crate) mod plate;
#[path = "../../isograd/src/element/spline.rs"]
pub(crate) mod spline;
