//! One half of a wing: a straight, tapered panel with a NACA section and a flat tip.

use std::f64::consts::PI;

use super::airfoil::{camber, half_thickness};
use crate::jet::{Jet, JetVector};
use crate::surface::between;

/// Position of the maximum camber, in chords.
const CAMBER_AT: f64 = 0.4;

/// Axes of the body's frame.
pub(crate) const Y: usize = 1;
/// The upward axis.
pub(crate) const Z: usize = 2;

/// A panel with its chord along x. Thickness and camber are measured along `lift_axis` from the chord (the
/// four-digit definition measures thickness perpendicular to the camber line).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    /// Leading edge of the root section.
    pub apex: JetVector,
    /// From the root to the tip along `span_axis`.
    pub span: Jet,
    pub root_chord: Jet,
    pub tip_chord: Jet,
    /// Tangent of the sweep of the leading edge.
    pub sweep: Jet,
    /// Tangent of the dihedral.
    pub dihedral: Jet,
    /// Thickness in chords.
    pub thickness: Jet,
    /// Camber in chords.
    pub camber: Jet,
    pub span_axis: usize,
    /// Direction of the span: 1 or −1.
    pub span_sign: f64,
    pub lift_axis: usize,
}

/// Upper side, lower side, tip.
pub(crate) const SIDES_AND_TIP: usize = 3;

/// A section: leading edge along x, height of the chord, chord.
struct Section {
    leading: Jet,
    height: Jet,
    chord: Jet,
}

impl Panel {
    /// The panel mirrored at the plane of its root.
    pub fn mirrored(self) -> Self {
        Self {
            span_sign: -self.span_sign,
            ..self
        }
    }

    fn section(&self, eta: Jet) -> Section {
        Section {
            leading: eta * self.span * self.sweep,
            height: eta * self.span * self.dihedral,
            chord: between(eta, self.root_chord, self.tip_chord),
        }
    }

    /// Patch 0: upper side, 1: lower side, 2: tip, 3: root. `u` along the chord, `v` along the span, or
    /// across the thickness on tip and root.
    pub fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        // x × span points along the lift axis or against it, depending on the handedness.
        let right_handed = (self.lift_axis == Z) == (self.span_sign > 0.0);
        let v = if right_handed == matches!(patch, 0 | 3) {
            v
        } else {
            1.0 - v
        };
        let (eta, share) = match patch {
            0 => (v, Jet::constant(1.0)),
            1 => (v, Jet::constant(-1.0)),
            2 => (Jet::constant(1.0), v * 2.0 - 1.0),
            _ => (Jet::constant(0.0), v * 2.0 - 1.0),
        };
        let root = (u * (0.5 * PI)).sin_cos().0;
        self.point(eta, root, share)
    }

    /// The point at `x = root²` of the section at `eta`; `share` is −1 on the lower side and 1 on the upper.
    fn point(&self, eta: Jet, root: Jet, share: Jet) -> JetVector {
        let section = self.section(eta);
        let x = root.squared();
        let height =
            camber(self.camber, CAMBER_AT, x) + share * half_thickness(self.thickness, root);
        let mut point = self.apex;
        point[0] = point[0] + section.leading + section.chord * x;
        point[self.span_axis] = point[self.span_axis] + eta * self.span * self.span_sign;
        point[self.lift_axis] = point[self.lift_axis] + section.height + section.chord * height;
        point
    }

    /// Whether `point` is inside.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let along = |axis: usize| point[axis] - self.apex[axis].value;
        let eta = along(self.span_axis) * self.span_sign / self.span.value;
        if !(eta > 0.0 && eta < 1.0) {
            return false;
        }
        let section = self.section(Jet::constant(eta));
        let x = (along(0) - section.leading.value) / section.chord.value;
        if !(x > 0.0 && x < 1.0) {
            return false;
        }
        let height = (along(self.lift_axis) - section.height.value) / section.chord.value;
        let root = Jet::constant(x.sqrt());
        let middle = camber(self.camber, CAMBER_AT, Jet::constant(x)).value;
        (height - middle).abs() < half_thickness(self.thickness, root).value
    }
}
