//! Car: the body of Ahmed, Ramm & Faltin (SAE 840300).

use std::f64::consts::PI;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, ShapeError, UNIT_OF_LENGTH, parameters, require};
use crate::surface::{Surface, between, flat, turn};

/// Ahmed body along x, front at x = 0, floor at z = 0.
pub(crate) const KIND: Kind = Kind {
    name: "car",
    summary: "Ahmed body along x, floor at z = 0, front edges rounded, all others sharp, slanted rear; \
              inside test exact, volume in closed form, area by quadrature",
    parameters: &parameters! {
        "length" = 1.044 in POSITIVE, UNIT_OF_LENGTH, "length";
        "width" = 0.389 in POSITIVE, UNIT_OF_LENGTH, "width";
        "height" = 0.288 in POSITIVE, UNIT_OF_LENGTH, "height";
        "front_radius" = 0.1 in POSITIVE, UNIT_OF_LENGTH, "radius of the four front edges";
        "slant" = 25.0 in (0.0, 60.0), "degree", "angle of the rear slant with the horizontal";
        "slant_length" = 0.222 in POSITIVE, UNIT_OF_LENGTH, "length of the slant along itself";
        "stilts" = 0.0 in (0.0, 1e6), UNIT_OF_LENGTH, "length of the four stilts; 0 for none";
        "stilt_radius" = 0.015 in POSITIVE, UNIT_OF_LENGTH, "radius of the stilts";
    },
    time: None,
    build: |p| {
        let car = Car::new(p);
        car.check()?;
        Ok(Box::new(car))
    },
};

#[derive(Debug)]
struct Car {
    length: Jet,
    half_width: Jet,
    height: Jet,
    front: Jet,
    /// Extent of the slant along x and down.
    slant: [Jet; 2],
    stilts: Jet,
    stilt_radius: Jet,
    /// `(x, y)` of the axes of the stilts, in the proportions of the wind-tunnel model.
    stilt_axes: [[Jet; 2]; 4],
}

/// Part of the body along x.
#[derive(Clone, Copy)]
enum Part {
    Front,
    Middle,
    Rear,
}

/// Rectangular cross-section of the body at `x`.
struct Section {
    x: Jet,
    half_width: Jet,
    floor: Jet,
    roof: Jet,
}

const PARTS: [Part; 3] = [Part::Front, Part::Middle, Part::Rear];

/// Patches of the body: 3 on each side, 3 above, 3 below, front and base.
const BODY: usize = 14;
/// The flat patches of the underside, where the stilts are.
const FLOOR: std::ops::Range<usize> = 10..12;

impl Car {
    fn new(p: &[Jet]) -> Self {
        let (sin, cos) = p[4].radians().sin_cos();
        let place = |x: f64, side: f64| [p[0] * (x / 1.044), p[1] * (side * 0.1635 / 0.389)];
        Self {
            length: p[0],
            half_width: p[1] * 0.5,
            height: p[2],
            front: p[3],
            slant: [p[5] * cos, p[5] * sin],
            stilts: p[6],
            stilt_radius: p[7],
            stilt_axes: [
                place(0.202, 1.0),
                place(0.202, -1.0),
                place(0.672, 1.0),
                place(0.672, -1.0),
            ],
        }
    }

    fn check(&self) -> Result<(), ShapeError> {
        let front = self.front.value;
        require(
            front <= self.half_width.value && 2.0 * front <= self.height.value,
            "car: front_radius must be at most half of width and height",
        )?;
        require(
            front + self.slant[0].value <= self.length.value,
            "car: the slant reaches the rounded front; lower slant_length",
        )?;
        require(
            self.slant[1].value < self.height.value,
            "car: the slant reaches the floor; lower slant or slant_length",
        )?;
        let [x, y] = self.stilt_axes[0].map(|axis| axis.value);
        let room = (x - front).min(self.half_width.value - y);
        require(
            !self.has_stilts() || self.stilt_radius.value < room,
            "car: the stilts do not fit under the flat floor; lower stilt_radius",
        )
    }

    fn has_stilts(&self) -> bool {
        self.stilts.value > 0.0
    }

    fn section(&self, part: Part, u: Jet) -> Section {
        let (zero, slant_start) = (Jet::constant(0.0), self.length - self.slant[0]);
        let full = Section {
            x: zero,
            half_width: self.half_width,
            floor: zero,
            roof: self.height,
        };
        match part {
            Part::Front => {
                let (sin, cos) = (u * (0.5 * PI)).sin_cos();
                let inset = self.front * (1.0 - sin);
                Section {
                    x: self.front * (1.0 - cos),
                    half_width: self.half_width - inset,
                    floor: inset,
                    roof: self.height - inset,
                }
            }
            Part::Middle => Section {
                x: between(u, self.front, slant_start),
                ..full
            },
            Part::Rear => Section {
                x: between(u, slant_start, self.length),
                roof: self.height - u * self.slant[1],
                ..full
            },
        }
    }

    fn side(&self, part: Part, sign: f64, u: Jet, v: Jet) -> JetVector {
        let s = self.section(part, u);
        let v = if sign > 0.0 { 1.0 - v } else { v };
        [s.x, s.half_width * sign, between(v, s.floor, s.roof)]
    }

    fn roof(&self, part: Part, u: Jet, v: Jet) -> JetVector {
        let s = self.section(part, u);
        [s.x, s.half_width * (v * 2.0 - 1.0), s.roof]
    }

    fn floor(&self, part: Part, u: Jet, v: Jet) -> JetVector {
        let s = self.section(part, u);
        [s.x, s.half_width * (1.0 - v * 2.0), s.floor]
    }

    /// The flat front (`facing` −1) or the base (1).
    fn end(&self, s: &Section, facing: f64, u: Jet, v: Jet) -> JetVector {
        let zero = Jet::constant(0.0);
        let corner = [s.x, s.half_width * -facing, s.floor];
        let across = [zero, s.half_width * (2.0 * facing), zero];
        flat(corner, across, [zero, zero, s.roof - s.floor], u, v)
    }

    /// Patch 0: the wall of a stilt, 1: its foot.
    fn stilt(&self, stilt: usize, patch: usize, u: Jet, v: Jet) -> JetVector {
        let [x, y] = self.stilt_axes[stilt];
        let (radius, z) = match patch {
            0 => (self.stilt_radius, self.stilts * (u - 1.0)),
            _ => (self.stilt_radius * u, -self.stilts),
        };
        let (cos, sin) = turn(-v);
        [x + radius * cos, y + radius * sin, z]
    }

    fn under_a_stilt(&self, [x, y, _]: [f64; 3]) -> bool {
        let inside = |axis: &[Jet; 2]| {
            (x - axis[0].value).hypot(y - axis[1].value) < self.stilt_radius.value
        };
        self.has_stilts() && self.stilt_axes.iter().any(inside)
    }

    fn body_contains(&self, [x, y, z]: [f64; 3]) -> bool {
        let (front, length) = (self.front.value, self.length.value);
        if !(x > 0.0 && x < length) {
            return false;
        }
        let inset = front - (front.powi(2) - (front - x).max(0.0).powi(2)).sqrt();
        let drop =
            (x - length + self.slant[0].value).max(0.0) / self.slant[0].value * self.slant[1].value;
        y.abs() < self.half_width.value - inset
            && z > inset
            && z < (self.height.value - inset).min(self.height.value - drop)
    }
}

impl Surface for Car {
    fn patches(&self) -> usize {
        if self.has_stilts() { BODY + 8 } else { BODY }
    }

    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        let part = PARTS[patch % 3];
        match patch {
            0..3 => self.side(part, 1.0, u, v),
            3..6 => self.side(part, -1.0, u, v),
            6..9 => self.roof(part, u, v),
            9..12 => self.floor(part, u, v),
            12 => self.end(&self.section(Part::Front, Jet::constant(0.0)), -1.0, u, v),
            13 => self.end(&self.section(Part::Rear, Jet::constant(1.0)), 1.0, u, v),
            p => self.stilt((p - BODY) / 2, (p - BODY) % 2, u, v),
        }
    }

    fn is_union(&self) -> bool {
        self.has_stilts()
    }

    fn exposed(&self, patch: usize, point: [f64; 3]) -> bool {
        !FLOOR.contains(&patch) || !self.under_a_stilt(point)
    }

    fn contains(&self, point: [f64; 3]) -> Option<bool> {
        let [_, _, z] = point;
        let in_stilt = z > -self.stilts.value && z <= 0.0 && self.under_a_stilt(point);
        Some(in_stilt || self.body_contains(point))
    }

    /// Integral over the sections of the rounded front, a box less a wedge, four cylinders.
    fn volume(&self) -> Option<f64> {
        let (w, h, r) = (
            2.0 * self.half_width.value,
            self.height.value,
            self.front.value,
        );
        let (a, b) = (w - 2.0 * r, h - 2.0 * r);
        let front = r * (a * b + 0.5 * PI * r * (a + b) + 8.0 / 3.0 * r * r);
        let wedge = 0.5 * self.slant[0].value * self.slant[1].value * w;
        let stilts = 4.0 * PI * self.stilt_radius.value.powi(2) * self.stilts.value;
        Some(front + (self.length.value - r) * w * h - wedge + stilts)
    }
}
