//! Torus knot.

use isograd_element::vector::{norm, sub};

use crate::jet::{Jet, JetVector, add_scaled, cross};
use crate::kind::{Kind, ShapeError, length};
use crate::surface::{Surface, turn};

/// Turns of the center line round the z axis, and through the hole.
const WINDINGS: [f64; 2] = [2.0, 3.0];

/// Trefoil: a tube whose center line winds twice round the z axis and three times through the hole of a
/// torus.
pub(crate) const KIND: Kind = Kind {
    name: "knot",
    summary: "trefoil: a tube of round section, knotted on a torus round the z axis",
    parameters: &[
        length("major", "radius of the center line of the torus", 0.7),
        length(
            "minor",
            "distance of the knot's center line from that of the torus",
            0.3,
        ),
        length("tube", "radius of the tube", 0.15),
    ],
    time: None,
    build: |p| {
        let knot = Knot {
            major: p[0],
            minor: p[1],
            tube: p[2],
        };
        if !(knot.minor.value < knot.major.value) {
            return Err(ShapeError::Combination(
                "knot: minor must be below major, or the center line cuts itself".into(),
            ));
        }
        if !(knot.tube.value < knot.widest_tube()) {
            return Err(ShapeError::Combination(
                "knot: the tube meets itself; lower tube, or raise minor and major".into(),
            ));
        }
        Ok(Box::new(knot))
    },
};

#[derive(Debug)]
struct Knot {
    major: Jet,
    minor: Jet,
    tube: Jet,
}

/// Places on the center line that are compared to find where it comes nearest to itself.
const STATIONS: usize = 360;

impl Knot {
    /// The center line, its direction (not of unit length), and the unit normal there of the torus that it
    /// lies on.
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

    /// Half the least distance between parts of the center line that are not next to each other, and no
    /// more than the least radius of its curvature: any tube below that does not cut itself.
    fn widest_tube(&self) -> f64 {
        let stations: Vec<[f64; 3]> = (0..STATIONS)
            .map(|k| {
                let at = Jet::constant(k as f64 / STATIONS as f64);
                self.center_line(at)[0].map(|x| x.value)
            })
            .collect();
        let distance = |a: usize, b: usize| norm(sub(stations[a], stations[b % STATIONS]));
        let mut widest = f64::INFINITY;
        for a in 0..STATIONS {
            let next = (a + 1) % STATIONS;
            widest = widest.min(circumradius([
                distance(a, a + 1),
                distance(next, a + 2),
                distance(a, a + 2),
            ]));
            // A tenth of the line away, it is another strand.
            for b in a + STATIONS / 10..=a + STATIONS / 2 {
                widest = widest.min(0.5 * distance(a, b));
            }
        }
        widest
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
