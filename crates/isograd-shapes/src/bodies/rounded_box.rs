//! Box with rounded edges.

use std::f64::consts::PI;

use isograd_element::vector::norm;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters, require};
use crate::surface::Surface;

/// Box centered at the origin with rounded edges and corners.
pub(crate) const KIND: Kind = Kind {
    name: "box",
    summary: "box with rounded edges, centered at the origin; distance, area and volume in closed form",
    parameters: &parameters! {
        "x" = 1.2 in POSITIVE, UNIT_OF_LENGTH, "whole length along x";
        "y" = 0.8 in POSITIVE, UNIT_OF_LENGTH, "whole length along y";
        "z" = 0.6 in POSITIVE, UNIT_OF_LENGTH, "whole length along z";
        "radius" = 0.1 in (0.0, 1e6), UNIT_OF_LENGTH,
            "radius of the edges and corners; 0 leaves them sharp";
    },
    time: None,
    build: |p| {
        let half = [p[0] * 0.5, p[1] * 0.5, p[2] * 0.5];
        require(
            half.iter().all(|h| p[3].value <= h.value),
            "box: radius must be at most half of x, y and z; lower it",
        )?;
        Ok(Box::new(RoundedBox { half, radius: p[3] }))
    },
};

#[derive(Debug)]
struct RoundedBox {
    half: [Jet; 3],
    radius: Jet,
}

/// Six faces, then twelve edges, then eight corners.
const FACES: usize = 6;
const EDGES: usize = 12;
const CORNERS: usize = 8;

impl RoundedBox {
    /// Half-sides of the core: the surface is at distance `radius` from this box.
    fn core(&self) -> [Jet; 3] {
        self.half.map(|h| h - self.radius)
    }

    fn face(&self, face: usize, u: Jet, v: Jet) -> JetVector {
        let (axis, sign) = (face / 2, signs(face)[0]);
        let core = self.core();
        let mut x = [Jet::constant(0.0); 3];
        x[axis] = self.half[axis] * sign;
        x[(axis + 1) % 3] = core[(axis + 1) % 3] * (u * 2.0 - 1.0);
        x[(axis + 2) % 3] = core[(axis + 2) % 3] * (v * 2.0 - 1.0) * sign;
        x
    }

    /// Quarter cylinder along `axis`, at the given signs of the other two axes.
    fn edge(&self, edge: usize, u: Jet, v: Jet) -> JetVector {
        let (axis, [s, t, _]) = (edge / 4, signs(edge % 4));
        let core = self.core();
        let (sin, cos) = (u * (0.5 * PI)).sin_cos();
        let mut x = [Jet::constant(0.0); 3];
        x[axis] = core[axis] * (v * 2.0 - 1.0) * (s * t);
        x[(axis + 1) % 3] = (core[(axis + 1) % 3] + self.radius * cos) * s;
        x[(axis + 2) % 3] = (core[(axis + 2) % 3] + self.radius * sin) * t;
        x
    }

    fn corner(&self, corner: usize, u: Jet, v: Jet) -> JetVector {
        let sign = signs(corner);
        let core = self.core();
        let (v, handed) = (v * (0.5 * PI), sign[0] * sign[1] * sign[2]);
        let (sin, cos) = (u * (0.5 * PI)).sin_cos();
        let (sin_v, cos_v) = if handed > 0.0 { v } else { 0.5 * PI - v }.sin_cos();
        let direction = [sin * cos_v, sin * sin_v, cos];
        std::array::from_fn(|k| (core[k] + self.radius * direction[k]) * sign[k])
    }
}

/// The bits of `i` as signs.
fn signs(i: usize) -> [f64; 3] {
    [0, 1, 2].map(|bit| if i >> bit & 1 == 0 { 1.0 } else { -1.0 })
}

impl Surface for RoundedBox {
    fn patches(&self) -> usize {
        FACES + EDGES + CORNERS
    }

    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        match patch {
            0..FACES => self.face(patch, u, v),
            p if p < FACES + EDGES => self.edge(p - FACES, u, v),
            p => self.corner(p - FACES - EDGES, u, v),
        }
    }

    fn distance(&self, point: [f64; 3]) -> Option<f64> {
        let core = self.core();
        let q: [f64; 3] = std::array::from_fn(|k| point[k].abs() - core[k].value);
        let outside = norm(q.map(|x| x.max(0.0)));
        Some(outside + q[0].max(q[1]).max(q[2]).min(0.0) - self.radius.value)
    }

    /// Steiner's formula: the core box grown by the radius.
    fn volume(&self) -> Option<f64> {
        let ([a, b, c], r) = (self.core().map(|x| 2.0 * x.value), self.radius.value);
        let faces = 2.0 * (a * b + b * c + c * a);
        Some(a * b * c + faces * r + PI * (a + b + c) * r * r + 4.0 / 3.0 * PI * r.powi(3))
    }

    fn area(&self) -> Option<f64> {
        let ([a, b, c], r) = (self.core().map(|x| 2.0 * x.value), self.radius.value);
        let faces = 2.0 * (a * b + b * c + c * a);
        Some(faces + 2.0 * PI * (a + b + c) * r + 4.0 * PI * r * r)
    }
}
