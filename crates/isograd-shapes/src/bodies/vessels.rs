//! Vessel tree: branches of round cones that split by Murray's law.

mod branch;

use isograd_element::vector::{add, scale};

use crate::jet::{Jet, JetVector, add_scaled, cross, scaled};
use crate::kind::{Kind, POSITIVE, Parameter, UNIT_OF_LENGTH, parameters};
use crate::surface::Surface;
use branch::{Branch, PATCHES};

const PARAMETERS: [Parameter; 6] = {
    let mut table = parameters! {
        "radius" = 0.1 in POSITIVE, UNIT_OF_LENGTH, "radius at the root";
        "branch_length" = 6.0 in (2.0, 50.0), "its radius at its root", "length of a branch";
        "generations" = 4.0 in (1.0, 8.0), "", "generations of branches; each doubles their number";
        "asymmetry" = 0.8 in (0.3, 1.0), "radius of the larger",
            "radius of the smaller of two daughters";
        "taper" = 0.95 in (0.6, 1.0), "radius at its root", "radius at the end of a branch";
        "twist" = 80.0 in (-360.0, 360.0), "degree", "turn of the plane of branching at each joint";
    };
    table[2].whole = true;
    table
};

/// Tree from the origin up the z axis.
pub(crate) const KIND: Kind = Kind {
    name: "vessels",
    summary: "tree of vessels from the origin up z: branches by Murray's law, ends closed by spheres, \
              sharp joints; distance exact outside, and inside away from joints; area and volume by \
              quadrature to 1e-5",
    parameters: &PARAMETERS,
    time: None,
    build: |p| {
        let (sin, cos) = p[5].radians().sin_cos();
        let growth = Growth {
            length: p[1],
            asymmetry: p[3],
            taper: p[4],
            twist: [cos, sin],
        };
        let [zero, one] = [0.0, 1.0].map(Jet::constant);
        let root = Root {
            start: [zero; 3],
            along: [zero, zero, one],
            side: [one, zero, zero],
            radius: p[0],
        };
        let mut branches = Vec::new();
        growth.grow(root, p[2].value as u32, &mut branches);
        Ok(Box::new(Vessels { branches }))
    },
};

/// Parameters of the tree's growth.
struct Growth {
    /// Length of a branch, in radii at its root.
    length: Jet,
    asymmetry: Jet,
    taper: Jet,
    /// Cosine and sine of the twist.
    twist: [Jet; 2],
}

/// Root of a branch.
struct Root {
    start: JetVector,
    along: JetVector,
    /// Unit vector perpendicular to `along`; the daughters leave in the plane of the two.
    side: JetVector,
    radius: Jet,
}

impl Growth {
    fn grow(&self, root: Root, generations: u32, branches: &mut Vec<Branch>) {
        let end = add_scaled(root.start, root.radius * self.length, root.along);
        let end_radius = root.radius * self.taper;
        branches.push(Branch::new(
            root.start,
            end,
            [root.radius, end_radius],
            root.along,
            root.side,
        ));
        if generations > 1 {
            for daughter in self.daughters(&root, end, end_radius) {
                self.grow(daughter, generations - 1, branches);
            }
        }
    }

    /// Murray (1926): `r₀³ = r₁³ + r₂³`, and the angles of least volume,
    /// `cos θ₁ = (r₀⁴ + r₁⁴ − r₂⁴)/(2 r₀² r₁²)`.
    fn daughters(&self, mother: &Root, start: JetVector, radius: Jet) -> [Root; 2] {
        let ratio = self.asymmetry;
        let larger = Jet::constant(1.0) / (ratio * ratio.squared() + 1.0).cbrt();
        let shares = [larger, larger * ratio];
        [(0, 1, 1.0), (1, 0, -1.0)].map(|(own, other, hand)| {
            let [a, b] = [shares[own].squared(), shares[other].squared()];
            let cos = (a.squared() - b.squared() + 1.0) / (a * 2.0);
            let sin = (1.0 - cos.squared()).sqrt() * hand;
            let across = cross(mother.along, mother.side);
            let along = add_scaled(scaled(mother.along, cos), sin, mother.side);
            let in_plane = add_scaled(scaled(mother.side, cos), -sin, mother.along);
            let side = add_scaled(scaled(in_plane, self.twist[0]), self.twist[1], across);
            Root {
                start,
                along,
                side,
                radius: radius * shares[own],
            }
        })
    }
}

#[derive(Debug)]
struct Vessels {
    branches: Vec<Branch>,
}

impl Surface for Vessels {
    fn patches(&self) -> usize {
        self.branches.len() * PATCHES
    }

    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        self.branches[patch / PATCHES].map(patch % PATCHES, u, v)
    }

    fn is_union(&self) -> bool {
        true
    }

    fn exposed(&self, patch: usize, point: [f64; 3]) -> bool {
        self.is_outside_others(patch / PATCHES, point)
    }

    /// Outside: the smallest distance over the branches. Inside: the depth in the deepest branch, if the
    /// closest point of its surface is not inside another branch.
    fn distance(&self, point: [f64; 3]) -> Option<f64> {
        let distances = self.branches.iter().map(|b| b.distance(point));
        let (nearest, closest) = distances
            .enumerate()
            .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let foot = add(point, scale(closest.outward, -closest.distance));
        (closest.distance >= 0.0 || self.is_outside_others(nearest, foot))
            .then_some(closest.distance)
    }

    fn contains(&self, point: [f64; 3]) -> Option<bool> {
        Some(
            self.branches
                .iter()
                .any(|b| b.distance(point).distance < 0.0),
        )
    }
}

impl Vessels {
    /// Whether `point` is inside no branch other than `own`.
    fn is_outside_others(&self, own: usize, point: [f64; 3]) -> bool {
        let mut others = self.branches.iter().enumerate().filter(|(i, _)| *i != own);
        !others.any(|(_, b)| b.contains(point))
    }
}
