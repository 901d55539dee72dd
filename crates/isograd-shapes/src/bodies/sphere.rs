//! Sphere.

use std::f64::consts::PI;

use isograd_element::vector::norm;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters};
use crate::surface::{Surface, turn};

/// Sphere centered at the origin.
pub(crate) const KIND: Kind = Kind {
    name: "sphere",
    summary: "sphere centered at the origin; distance, area and volume in closed form",
    parameters: &parameters! {
        "radius" = 0.5 in POSITIVE, UNIT_OF_LENGTH, "radius";
    },
    time: None,
    build: |p| Ok(Box::new(Sphere { radius: p[0] })),
};

#[derive(Debug)]
struct Sphere {
    radius: Jet,
}

/// The unit sphere: `u` from the north pole to the south, `v` around the axis.
pub(crate) fn unit_sphere(u: Jet, v: Jet) -> JetVector {
    let (sin, cos) = (u * PI).sin_cos();
    let (x, y) = turn(v);
    [sin * x, sin * y, cos]
}

impl Surface for Sphere {
    fn patches(&self) -> usize {
        1
    }

    fn map(&self, _patch: usize, u: Jet, v: Jet) -> JetVector {
        unit_sphere(u, v).map(|x| x * self.radius)
    }

    fn distance(&self, point: [f64; 3]) -> Option<f64> {
        Some(norm(point) - self.radius.value)
    }

    fn volume(&self) -> Option<f64> {
        Some(4.0 / 3.0 * PI * self.radius.value.powi(3))
    }

    fn area(&self) -> Option<f64> {
        Some(4.0 * PI * self.radius.value.powi(2))
    }
}
