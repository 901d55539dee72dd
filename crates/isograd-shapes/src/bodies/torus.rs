//! Torus.

use std::f64::consts::PI;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, ShapeError, length};
use crate::surface::{Surface, turn};

/// Ring torus round the z axis.
pub(crate) const KIND: Kind = Kind {
    name: "torus",
    summary: "ring torus round the z axis; distance, area and volume in closed form",
    parameters: &[
        length("major", "radius of the center line", 0.7),
        length("minor", "radius of the tube", 0.25),
    ],
    time: None,
    build: |p| {
        if !(p[1].value < p[0].value) {
            return Err(ShapeError::Combination(
                "torus: minor must be below major, or the surface cuts itself".into(),
            ));
        }
        Ok(Box::new(Torus {
            major: p[0],
            minor: p[1],
        }))
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
