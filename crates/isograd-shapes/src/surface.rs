//! Interface of a body: the map from surface coordinates to points, and quantities in closed form.

use std::f64::consts::PI;
use std::fmt::Debug;

use crate::jet::{Jet, JetVector};

/// A body with fixed parameters.
///
/// Its surface is a set of patches, each the image of the unit square under a smooth map whose
/// `∂x/∂u × ∂x/∂v` points outward. The parameters are jets, so that the map can be differentiated in
/// them as well as in `(u, v)`. The number of patches changes only with integer parameters, and where the
/// length of an optional part becomes 0.
pub(crate) trait Surface: Debug + Send + Sync {
    /// Number of patches.
    fn patches(&self) -> usize;

    /// The point at `(u, v)` of a patch. At `0 < u, v < 1` it is finite and smooth.
    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector;

    /// Whether `point`, on `patch`, is on the surface of the body rather than inside another part of it.
    fn exposed(&self, _patch: usize, _point: [f64; 3]) -> bool {
        true
    }

    /// Whether patches overlap, so that [`Surface::exposed`] must be evaluated.
    fn is_union(&self) -> bool {
        false
    }

    /// Exact signed distance, negative inside.
    fn distance(&self, _point: [f64; 3]) -> Option<f64> {
        None
    }

    /// Whether `point` is inside, if known.
    fn contains(&self, point: [f64; 3]) -> Option<bool> {
        self.distance(point).map(|d| d < 0.0)
    }

    /// Volume in closed form.
    fn volume(&self) -> Option<f64> {
        None
    }

    /// Area in closed form.
    fn area(&self) -> Option<f64> {
        None
    }
}

/// `t` in `[0, 1]` mapped to `[from, to]`.
pub(crate) fn between(t: Jet, from: Jet, to: Jet) -> Jet {
    from + t * (to - from)
}

/// Cosine and sine of the angle `2π t`.
pub(crate) fn turn(t: Jet) -> (Jet, Jet) {
    let (sin, cos) = (t * (2.0 * PI)).sin_cos();
    (cos, sin)
}

/// The flat patch `corner + u a + v b`.
pub(crate) fn flat(corner: JetVector, a: JetVector, b: JetVector, u: Jet, v: Jet) -> JetVector {
    std::array::from_fn(|k| corner[k] + u * a[k] + v * b[k])
}
