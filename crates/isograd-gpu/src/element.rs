//! The formulas of [`isograd::element`], compiled as parts of kernels: the same files.

/// A number in a formula.
pub(crate) use cubecl::prelude::Float as Element;

#[path = "../../isograd/src/element/plane.rs"]
pub(crate) mod plane;

#[path = "../../isograd/src/element/coupling.rs"]
pub(crate) mod coupling;
#[path = "../../isograd/src/element/crossing.rs"]
pub(crate) mod crossing;
#[path = "../../isograd/src/element/curvature.rs"]
pub(crate) mod curvature;
#[path = "../../isograd/src/element/difference.rs"]
pub(crate) mod difference;
#[path = "../../isograd/src/element/disc.rs"]
pub(crate) mod disc;
#[path = "../../isograd/src/element/evidence.rs"]
pub(crate) mod evidence;
#[path = "../../isograd/src/element/fit.rs"]
pub(crate) mod fit;
#[path = "../../isograd/src/element/hat.rs"]
pub(crate) mod hat;
#[path = "../../isograd/src/element/linear.rs"]
pub(crate) mod linear;
#[path = "../../isograd/src/element/plate.rs"]
pub(crate) mod plate;
#[path = "../../isograd/src/element/sheet.rs"]
pub(crate) mod sheet;
#[path = "../../isograd/src/element/sight.rs"]
pub(crate) mod sight;
#[path = "../../isograd/src/element/spline.rs"]
pub(crate) mod spline;
#[path = "../../isograd/src/element/turned.rs"]
pub(crate) mod turned;
#[path = "../../isograd/src/element/winding.rs"]
pub(crate) mod winding;
