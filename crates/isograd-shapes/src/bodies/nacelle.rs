//! Nacelle: an airfoil section revolved around the x axis, a thin ring.

use std::f64::consts::PI;

use super::airfoil::{area_and_centroid, half_thickness, half_thickness_at};
use crate::jet::{Jet, JetVector, U};
use crate::kind::{Kind, POSITIVE, UNIT_OF_LENGTH, parameters, require};
use crate::surface::{Surface, turn};

/// Duct around the x axis.
pub(crate) const KIND: Kind = Kind {
    name: "nacelle",
    summary: "engine duct: a NACA section revolved around the x axis; distance exact to 1e-12 by its \
              section, volume in closed form (Pappus), area by quadrature",
    parameters: &parameters! {
        "chord" = 1.0 in POSITIVE, UNIT_OF_LENGTH, "length of the section";
        "thickness" = 0.15 in (0.01, 0.4), "chord", "thickness of the section";
        "radius" = 0.4 in POSITIVE, UNIT_OF_LENGTH,
            "radius of the circle through the middle of the chord";
        "incidence" = 4.0 in (-45.0, 45.0), "degree",
            "angle of the chord with the axis; positive opens toward the front";
    },
    time: None,
    build: |p| {
        let (sin, cos) = p[3].radians().sin_cos();
        let nacelle = Nacelle {
            chord: p[0],
            thickness: p[1],
            radius: p[2],
            sin,
            cos,
        };
        require(
            nacelle.inner_radius() > 0.0,
            "nacelle: the section reaches the axis; raise radius, or lower chord, thickness or incidence",
        )?;
        Ok(Box::new(nacelle))
    },
};

#[derive(Debug)]
struct Nacelle {
    chord: Jet,
    thickness: Jet,
    radius: Jet,
    /// Of the incidence.
    sin: Jet,
    cos: Jet,
}

impl Nacelle {
    /// Axial position and radius of the point `(x, y)` of the section of unit chord.
    fn cylindrical(&self, x: Jet, y: Jet) -> [Jet; 2] {
        let x = x - 0.5;
        [
            self.chord * (x * self.cos + y * self.sin) + self.chord * 0.5,
            self.chord * (y * self.cos - x * self.sin) + self.radius,
        ]
    }

    /// Lower bound of the radius of the surface.
    fn inner_radius(&self) -> f64 {
        let radii = (0..=400).map(|k| {
            let root = Jet::constant(f64::from(k) / 400.0);
            let y = half_thickness(self.thickness, root);
            self.cylindrical(root.squared(), -y)[1]
                .value
                .min(self.cylindrical(root.squared(), y)[1].value)
        });
        radii.fold(f64::INFINITY, f64::min) - 1e-3 * self.chord.value
    }
}

impl Surface for Nacelle {
    /// The outer and the inner side of the section.
    fn patches(&self) -> usize {
        2
    }

    /// `u` from the leading edge to the trailing edge, `v` around the axis.
    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        let root = (u * (0.5 * PI)).sin_cos().0;
        let y = half_thickness(self.thickness, root);
        let (side, v) = if patch == 0 { (1.0, -v) } else { (-1.0, v) };
        let [x, radius] = self.cylindrical(root.squared(), y * side);
        let (cos, sin) = turn(v);
        [x, radius * cos, radius * sin]
    }

    /// Distance to the section in the half-plane `(x, r)`: exact, since the section does not reach the axis.
    fn distance(&self, [x, y, z]: [f64; 3]) -> Option<f64> {
        let (a, b) = (x - 0.5 * self.chord.value, y.hypot(z) - self.radius.value);
        let (sin, cos) = (self.sin.value, self.cos.value);
        let local = [a * cos - b * sin, a * sin + b * cos].map(|s| s / self.chord.value);
        Some(
            distance_to_section(self.thickness.value, [local[0] + 0.5, local[1]])
                * self.chord.value,
        )
    }

    /// Pappus: area of the section times the path length of its centroid.
    fn volume(&self) -> Option<f64> {
        let (area, centroid) = area_and_centroid();
        let area = area * self.thickness.value * self.chord.value.powi(2);
        let radius = self.cylindrical(Jet::constant(centroid), Jet::constant(0.0))[1].value;
        Some(2.0 * PI * radius * area)
    }
}

/// Signed distance in the plane to a symmetric section of unit chord, to 1e-12.
///
/// A scan of the upper side finds the local minima; bisection of `(x(θ) − p)·x'(θ)` refines each to
/// rounding. By symmetry the point is mirrored to the upper half-plane first.
fn distance_to_section(thickness: f64, [x, y]: [f64; 2]) -> f64 {
    const SCAN: usize = 96;
    let step = 0.5 * PI / SCAN as f64;
    let point = [x, y.abs()];
    let scan: [f64; SCAN + 1] =
        std::array::from_fn(|k| half_square(thickness, point, k as f64 * step).value);
    let mut best = scan[0].min(scan[SCAN]);
    for k in 0..=SCAN {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(SCAN));
        if scan[k] <= scan[before] && scan[k] <= scan[after] {
            let angle = stationary(thickness, point, before as f64 * step, after as f64 * step);
            best = best.min(half_square(thickness, point, angle).value);
        }
    }
    let inside = x > 0.0 && x < 1.0 && point[1] < half_thickness_at(thickness, x);
    let distance = (2.0 * best).sqrt();
    if inside { -distance } else { distance }
}

/// Half the squared distance from `point` to the section at `x = sin²θ`, and its slope in `θ`.
fn half_square(thickness: f64, point: [f64; 2], angle: f64) -> Jet {
    let root = Jet::variable(angle, U).sin_cos().0;
    let y = half_thickness(Jet::constant(thickness), root);
    ((root.squared() - point[0]).squared() + (y - point[1]).squared()) * 0.5
}

/// Where the slope of [`half_square`] goes from negative to positive.
fn stationary(thickness: f64, point: [f64; 2], mut low: f64, mut high: f64) -> f64 {
    // One bisection per bit of the mantissa.
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if half_square(thickness, point, middle).slope[U] < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
