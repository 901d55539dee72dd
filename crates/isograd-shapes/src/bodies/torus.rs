//! Torus.

use std::f64::consts::PI;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters, require};
use crate::surface::{Surface, turn};

/// Ring torus around the z axis.
pub(crate) const KIND: Kind = Kind {
    name: "torus",
    summary: "ring torus around the z axis; distance, area and volume in closed form",
    parameters: &parameters! {
        "major" = 0.7 in POSITIVE, UNIT_OF_LENGTH, "radius of the center line";
        "minor" = 0.25 in POSITIVE, UNIT_OF_LENGTH, "radius of the tube";
    },
    time: None,
    build: |p| {
        let (major, minor) = (p[0], p[1]);
        require(
            minor.value < major.value,
            "torus: the surface intersects itself; minor must be below major",
        )?;
        Ok(Box::new(Torus { major, minor }))
    },
};

#[derive(Debug)]
struct Torus {
    major: Jet,
    minor: Jet,
}

impl Surface for Torus {
    fn patches(&self) -> usize {
        1
    }

    fn map(&self, _patch: usize, u: Jet, v: Jet) -> JetVector {
        let (x, y) = turn(u);
        let (outward, up) = turn(v);
        let radius = self.major + self.minor * outward;
        [radius * x, radius * y, self.minor * up]
    }

    fn distance(&self, [x, y, z]: [f64; 3]) -> Option<f64> {
        Some((x.hypot(y) - self.major.value).hypot(z) - self.minor.value)
    }

    fn volume(&self) -> Option<f64> {
        Some(2.0 * PI * PI * self.major.value * self.minor.value.powi(2))
    }

    fn area(&self) -> Option<f64> {
        Some(4.0 * PI * PI * self.major.value * self.minor.value)
    }
}
