//! Airliner: fuselage, wing, tail and fin, each closed, united.

use std::f64::consts::PI;

use super::wing::{Panel, SIDES_AND_TIP, Y, Z};
use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters, require};
use crate::surface::{Surface, between, turn};

/// Taper of tail and fin.
const TAIL_TAPER: f64 = 0.45;

/// Airliner along x, nose at the origin, z up.
pub(crate) const KIND: Kind = Kind {
    name: "airliner",
    summary: "fuselage, NACA wing, tail and fin as one union, nose at the origin, z up; inside test \
              exact; area and volume by quadrature to 1e-5",
    parameters: &parameters! {
        "length" = 36.0 in POSITIVE, UNIT_OF_LENGTH, "length of the fuselage";
        "radius" = 2.0 in POSITIVE, UNIT_OF_LENGTH, "radius of the fuselage";
        "nose" = 4.5 in POSITIVE, UNIT_OF_LENGTH, "length of the nose";
        "tail" = 13.0 in POSITIVE, UNIT_OF_LENGTH, "length of the tail cone";
        "span" = 34.0 in POSITIVE, UNIT_OF_LENGTH, "wing tip to wing tip";
        "root_chord" = 7.0 in POSITIVE, UNIT_OF_LENGTH, "chord of the wing at the middle";
        "tip_chord" = 2.4 in POSITIVE, UNIT_OF_LENGTH, "chord of the wing at its tips";
        "sweep" = 28.0 in (-60.0, 60.0), "degree",
            "sweep of the leading edges of wing, tail and fin";
        "dihedral" = 5.0 in (-30.0, 30.0), "degree", "rise of the wing toward its tips";
        "thickness" = 0.14 in (0.02, 0.3), "chord", "thickness of all sections";
        "camber" = 0.02 in (0.0, 0.08), "chord", "camber of the wing";
        "wing_at" = 0.32 in (0.0, 0.9), "length", "leading edge of the wing at the middle";
        "wing_height" = -0.5 in (-0.9, 0.9), "radius", "height of the wing at the middle";
        "tail_span" = 13.0 in POSITIVE, UNIT_OF_LENGTH, "tail tip to tail tip";
        "tail_chord" = 4.4 in POSITIVE, UNIT_OF_LENGTH, "chord of the tail at the middle";
        "fin_height" = 7.5 in POSITIVE, UNIT_OF_LENGTH, "from the axis to the tip of the fin";
        "fin_chord" = 6.0 in POSITIVE, UNIT_OF_LENGTH, "chord of the fin on the axis";
    },
    time: None,
    build: |p| {
        let fuselage = Fuselage {
            length: p[0],
            radius: p[1],
            nose: p[2],
            tail: p[3],
        };
        require(
            p[2].value + p[3].value <= p[0].value,
            "airliner: nose and tail together are longer than the fuselage; raise length",
        )?;
        require(
            p[14].value.max(p[16].value) <= 0.5 * p[0].value,
            "airliner: tail_chord and fin_chord must be at most half the length",
        )?;
        let (wing, tail, fin) = (wing(p), tail(p), fin(p));
        Ok(Box::new(Airliner {
            fuselage,
            panels: [wing, wing.mirrored(), tail, tail.mirrored(), fin],
        }))
    },
};

fn wing(p: &[Jet]) -> Panel {
    Panel {
        apex: [p[11] * p[0], Jet::constant(0.0), p[12] * p[1]],
        span: p[4] * 0.5,
        root_chord: p[5],
        tip_chord: p[6],
        sweep: p[7].radians().tan(),
        dihedral: p[8].radians().tan(),
        thickness: p[9],
        camber: p[10],
        span_axis: Y,
        span_sign: 1.0,
        lift_axis: Z,
    }
}

fn tail(p: &[Jet]) -> Panel {
    Panel {
        apex: [p[0] - p[14] * 1.2, Jet::constant(0.0), p[1] * 0.2],
        span: p[13] * 0.5,
        root_chord: p[14],
        tip_chord: p[14] * TAIL_TAPER,
        camber: Jet::constant(0.0),
        ..wing(p)
    }
}

fn fin(p: &[Jet]) -> Panel {
    Panel {
        apex: [p[0] - p[16] * 1.15, Jet::constant(0.0), Jet::constant(0.0)],
        span: p[15],
        root_chord: p[16],
        tip_chord: p[16] * TAIL_TAPER,
        dihedral: Jet::constant(0.0),
        camber: Jet::constant(0.0),
        span_axis: Z,
        lift_axis: Y,
        ..wing(p)
    }
}

#[derive(Debug)]
struct Fuselage {
    length: Jet,
    radius: Jet,
    nose: Jet,
    tail: Jet,
}

/// Nose, cylinder, tail cone.
const FUSELAGE_PATCHES: usize = 3;

impl Fuselage {
    /// Surface of revolution around x: half an ellipse, a straight line, half a parabola. `u` runs from nose to
    /// tail.
    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        let tail_start = self.length - self.tail;
        let (x, radius) = match patch {
            0 => {
                let (sin, cos) = (u * (0.5 * PI)).sin_cos();
                (self.nose * (1.0 - cos), self.radius * sin)
            }
            1 => (between(u, self.nose, tail_start), self.radius),
            _ => (
                between(u, tail_start, self.length),
                self.radius * (1.0 - u.squared()),
            ),
        };
        let (cos, sin) = turn(-v);
        [x, radius * cos, radius * sin]
    }

    fn contains(&self, [x, y, z]: [f64; 3]) -> bool {
        let (length, nose, tail) = (self.length.value, self.nose.value, self.tail.value);
        if !(x > 0.0 && x < length) {
            return false;
        }
        let share = if x < nose {
            (1.0 - (1.0 - x / nose).powi(2)).sqrt()
        } else {
            1.0 - ((x - length + tail) / tail).max(0.0).powi(2)
        };
        y.hypot(z) < self.radius.value * share
    }
}

#[derive(Debug)]
struct Airliner {
    fuselage: Fuselage,
    /// Right and left wing, right and left tail, fin. Right and left share their roots; the fin has a
    /// root patch of its own.
    panels: [Panel; 5],
}

impl Airliner {
    /// Panel of a patch and the patch within it; `None` for the fuselage.
    fn panel_of(patch: usize) -> Option<(usize, usize)> {
        let index = patch.checked_sub(FUSELAGE_PATCHES)?;
        // The last patch is the root of the fin.
        Some(if index == 5 * SIDES_AND_TIP {
            (4, SIDES_AND_TIP)
        } else {
            (index / SIDES_AND_TIP, index % SIDES_AND_TIP)
        })
    }
}

impl Surface for Airliner {
    fn patches(&self) -> usize {
        FUSELAGE_PATCHES + 5 * SIDES_AND_TIP + 1
    }

    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        match Self::panel_of(patch) {
            None => self.fuselage.map(patch, u, v),
            Some((panel, patch)) => self.panels[panel].map(patch, u, v),
        }
    }

    fn is_union(&self) -> bool {
        true
    }

    fn exposed(&self, patch: usize, point: [f64; 3]) -> bool {
        let own = Self::panel_of(patch).map(|(panel, _)| panel);
        let mut panels = self.panels.iter().enumerate();
        let in_panel = panels.any(|(i, panel)| Some(i) != own && panel.contains(point));
        !in_panel && (own.is_none() || !self.fuselage.contains(point))
    }

    fn contains(&self, point: [f64; 3]) -> Option<bool> {
        let in_panel = self.panels.iter().any(|panel| panel.contains(point));
        Some(in_panel || self.fuselage.contains(point))
    }
}
