//! One branch: a round cone, the convex hull of two spheres.

use isograd_element::vector::{add, dot, norm, norm_squared, scale, sub};

use crate::jet::{Jet, JetVector, add_scaled, cross, scaled, values};
use crate::surface::{between, turn};

/// The wall, the cap at the start, the cap at the end.
pub(super) const PATCHES: usize = 3;

#[derive(Debug)]
pub(super) struct Branch {
    start: JetVector,
    end: JetVector,
    /// Radii of the spheres at the start and at the end.
    radii: [Jet; 2],
    /// Unit vectors along the axis and two perpendicular to it; right-handed in the order across, along.
    along: JetVector,
    across: [JetVector; 2],
    /// Sine and cosine of the half-angle of the cone; the sine is positive where it narrows.
    sin: Jet,
    cos: Jet,
    length: Jet,
    /// Bounding sphere: center and squared radius.
    bound: ([f64; 3], f64),
}

/// Signed distance to a branch and its gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Closest {
    pub distance: f64,
    pub outward: [f64; 3],
}

impl Branch {
    /// A branch from `start` to `end`; `side` is a unit vector perpendicular to `along`. The radii differ by
    /// less than the length.
    pub fn new(
        start: JetVector,
        end: JetVector,
        radii: [Jet; 2],
        along: JetVector,
        side: JetVector,
    ) -> Self {
        let way: JetVector = std::array::from_fn(|k| end[k] - start[k]);
        let length = way[0] * along[0] + way[1] * along[1] + way[2] * along[2];
        let sin = (radii[0] - radii[1]) / length;
        let reach = 0.5 * length.value + radii[0].value.max(radii[1].value);
        Self {
            start,
            end,
            radii,
            along,
            across: [side, cross(along, side)],
            sin,
            cos: (1.0 - sin.squared()).sqrt(),
            length,
            // Slightly larger, so that it encloses the branch despite rounding.
            bound: (
                scale(add(values(start), values(end)), 0.5),
                (1.01 * reach).powi(2),
            ),
        }
    }

    /// `u` along the axis or from the pole of a cap, `v` around it.
    pub fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        let [first, last] = self.radii;
        match patch {
            0 => {
                let axial = between(u, first * self.sin, self.length + last * self.sin);
                let radius = between(u, first, last) * self.cos;
                self.ring(self.start, axial, radius, -v)
            }
            1 => {
                let (height, radius) = cap(self.sin + 1.0, u);
                self.ring(self.start, -height * first, radius * first, -v)
            }
            _ => {
                let (height, radius) = cap(1.0 - self.sin, u);
                self.ring(self.end, height * last, radius * last, v)
            }
        }
    }

    /// The point at `turns` of a ring around the axis, `axial` beyond `center`.
    fn ring(&self, center: JetVector, axial: Jet, radius: Jet, turns: Jet) -> JetVector {
        let (cos, sin) = turn(turns);
        let axis = add_scaled(center, axial, self.along);
        let spoke = add_scaled(scaled(self.across[0], cos), sin, self.across[1]);
        add_scaled(axis, radius, spoke)
    }

    /// Whether `point` is inside.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let (center, reach) = self.bound;
        norm_squared(sub(point, center)) < reach && self.distance(point).distance < 0.0
    }

    /// Exact inside and outside: the closest point is on the cap whose cone of normals contains the point,
    /// otherwise on the wall.
    pub fn distance(&self, point: [f64; 3]) -> Closest {
        let along = values(self.along);
        let from_start = sub(point, values(self.start));
        let axial = dot(from_start, along);
        let spoke = sub(from_start, scale(along, axial));
        let radial = norm(spoke);
        // On the axis all perpendicular directions are equally close.
        let across = if radial > 0.0 {
            scale(spoke, 1.0 / radial)
        } else {
            values(self.across[0])
        };
        let (sin, cos) = (self.sin.value, self.cos.value);
        let foot = cos * axial - sin * radial;
        if foot < 0.0 {
            return to_sphere(from_start, self.radii[0].value, along);
        }
        if foot > cos * self.length.value {
            return to_sphere(sub(point, values(self.end)), self.radii[1].value, along);
        }
        Closest {
            distance: cos * radial + sin * axial - self.radii[0].value,
            outward: add(scale(across, cos), scale(along, sin)),
        }
    }
}

/// Cap of the unit sphere of height `size`, at `u` from its pole to its rim: height above the center
/// and distance from the axis, both smooth at the pole.
fn cap(size: Jet, u: Jet) -> (Jet, Jet) {
    let height = 1.0 - size * u.squared();
    (height, u * (size * (height + 1.0)).sqrt())
}

fn to_sphere(from_center: [f64; 3], radius: f64, otherwise: [f64; 3]) -> Closest {
    let r = norm(from_center);
    let outward = if r > 0.0 {
        scale(from_center, 1.0 / r)
    } else {
        otherwise
    };
    Closest {
        distance: r - radius,
        outward,
    }
}
