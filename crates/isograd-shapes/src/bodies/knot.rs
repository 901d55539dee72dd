//! Torus knot.

use isograd_element::vector::{norm, sub};

use crate::jet::{Jet, JetVector, add_scaled, cross};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters, require};
use crate::surface::{Surface, turn};

/// Turns of the center line around the z axis, and through the hole.
const WINDINGS: [f64; 2] = [2.0, 3.0];

/// Trefoil: a tube whose center line winds twice around the z axis and three times through the hole of a
/// torus.
pub(crate) const KIND: Kind = Kind {
    name: "knot",
    summary: "trefoil: a tube of round section, knotted on a torus around the z axis",
    parameters: &parameters! {
        "major" = 0.7 in POSITIVE, UNIT_OF_LENGTH, "radius of the center line of the torus";
        "minor" = 0.3 in POSITIVE, UNIT_OF_LENGTH,
            "distance of the knot's center line from that of the torus";
        "tube" = 0.15 in POSITIVE, UNIT_OF_LENGTH, "radius of the tube";
    },
    time: None,
    build: |p| {
        let knot = Knot {
            major: p[0],
            minor: p[1],
            tube: p[2],
        };
        require(
            knot.minor.value < knot.major.value,
            "knot: the center line intersects itself; minor must be below major",
        )?;
        require(
            knot.tube.value < knot.max_tube_radius(),
            "knot: the tube intersects itself; lower tube, or raise minor and major",
        )?;
        Ok(Box::new(knot))
    },
};

#[derive(Debug)]
struct Knot {
    major: Jet,
    minor: Jet,
    tube: Jet,
}

/// Samples of the center line for its smallest distance from itself.
const STATIONS: usize = 360;

impl Knot {
    /// The center line, its tangent (not of unit length), and the unit normal of the torus that it lies on.
    fn center_line(&self, u: Jet) -> [JetVector; 3] {
        let [round, through] = WINDINGS;
        let (x, y) = turn(u * round);
        let (outward, up) = turn(u * through);
        let radius = self.major + self.minor * outward;
        let slide = -(self.minor * up * through);
        let along = [
            slide * x - radius * y * round,
            slide * y + radius * x * round,
            self.minor * outward * through,
        ];
        [
            [radius * x, radius * y, self.minor * up],
            along,
            [outward * x, outward * y, up],
        ]
    }

    /// Upper bound of the radius of a tube that does not intersect itself: half the smallest distance between
    /// strands of the center line, and at most its smallest radius of curvature.
    fn max_tube_radius(&self) -> f64 {
        let stations: Vec<[f64; 3]> = (0..STATIONS)
            .map(|k| {
                let at = Jet::constant(k as f64 / STATIONS as f64);
                self.center_line(at)[0].map(|x| x.value)
            })
            .collect();
        let distance = |a: usize, b: usize| norm(sub(stations[a], stations[b % STATIONS]));
        let mut radius = f64::INFINITY;
        for a in 0..STATIONS {
            let next = (a + 1) % STATIONS;
            radius = radius.min(circumradius([
                distance(a, a + 1),
                distance(next, a + 2),
                distance(a, a + 2),
            ]));
            // Points a tenth of the line apart are on different strands.
            for b in a + STATIONS / 10..=a + STATIONS / 2 {
                radius = radius.min(0.5 * distance(a, b));
            }
        }
        radius
    }
}

/// Radius of the circle through the corners of a triangle with these sides.
fn circumradius([a, b, c]: [f64; 3]) -> f64 {
    let half = 0.5 * (a + b + c);
    let area = (half * (half - a) * (half - b) * (half - c))
        .max(0.0)
        .sqrt();
    a * b * c / (4.0 * area)
}

impl Surface for Knot {
    fn patches(&self) -> usize {
        1
    }

    fn map(&self, _patch: usize, u: Jet, v: Jet) -> JetVector {
        let [center, along, normal] = self.center_line(u);
        let length = (along[0].squared() + along[1].squared() + along[2].squared()).sqrt();
        let side = cross(normal, along.map(|x| x / length));
        let (cos, sin) = turn(v);
        let rim = add_scaled(normal.map(|x| x * cos), sin, side);
        add_scaled(center, self.tube, rim)
    }
}
