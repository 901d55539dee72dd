//! Vessel tree: branches of round cones that divide by Murray's law.

mod branch;

use isograd_element::vector::{add, scale};

use crate::jet::{Jet, JetVector, add_scaled, cross, scaled};
use crate::kind::{Kind, Parameter, length, number};
use crate::surface::Surface;
use branch::{Branch, PATCHES};

/// Tree from the origin up the z axis.
pub(crate) const KIND: Kind = Kind {
    name: "vessels",
    summary: "tree of vessels from the origin up z: branches by Murray's law, ends closed by spheres, \
              sharp joints; distance exact outside, and inside away from joints; area and volume by \
              quadrature to 1e-5",
    parameters: &[
        length("radius", "radius at the root", 0.1),
        number(
            "branch_length",
            "length of a branch",
            "its radius at its root",
            6.0,
            (2.0, 50.0),
        ),
        Parameter {
            name: "generations",
            meaning: "generations of branches; each doubles their number",
            unit: "",
            default: 4.0,
            min: 1.0,
            max: 8.0,
            whole: true,
        },
        number(
            "asymmetry",
            "radius of the smaller of two daughters",
            "radius of the larger",
            0.8,
            (0.3, 1.0),
        ),
        number(
            "taper",
            "radius at the end of a branch",
            "radius at its root",
            0.95,
            (0.6, 1.0),
        ),
        number(
            "twist",
            "turn of the plane of branching at each joint",
            "degree",
            80.0,
            (-360.0, 360.0),
        ),
    ],
    time: None,
    build: |p| {
        let (sin, cos) = p[5].radians().sin_cos();
        let rules = Rules {
            length: p[1],
            asymmetry: p[3],
            taper: p[4],
            twist: [cos, sin],
        };
        let [zero, one] = [0.0, 1.0].map(Jet::constant);
        let seed = Seed {
            start: [zero; 3],
            along: [zero, zero, one],
            side: [one, zero, zero],
            radius: p[0],
        };
        let mut branches = Vec::new();
        rules.grow(seed, p[2].value as u32, &mut branches);
        Ok(Box::new(Vessels { branches }))
    },
};

/// How a tree grows.
struct Rules {
    /// Length of a branch in radii of its root.
    length: Jet,
    asymmetry: Jet,
    taper: Jet,
    /// Cosine and sine of the twist.
    twist: [Jet; 2],
}

/// Where a branch starts.
struct Seed {
    start: JetVector,
    along: JetVector,
    /// Unit, at right angles to `along`: its daughters leave in the plane of the two.
    side: JetVector,
    radius: Jet,
}

impl Rules {
    fn grow(&self, seed: Seed, generations: u32, branches: &mut Vec<Branch>) {
        let end = add_scaled(seed.start, seed.radius * self.length, seed.along);
        let end_radius = seed.radius * self.taper;
        branches.push(Branch::new(
            seed.start,
            end,
            [seed.radius, end_radius],
            seed.along,
            seed.side,
        ));
        if generations > 1 {
            for daughter in self.daughters(&seed, end, end_radius) {
                self.grow(daughter, generations - 1, branches);
            }
        }
    }

    /// Murray (1926): `r₀³ = r₁³ + r₂³`, and the angles of least volume,
    /// `cos θ₁ = (r₀⁴ + r₁⁴ − r₂⁴)/(2 r₀² r₁²)`.
    fn daughters(&self, mother: &Seed, start: JetVector, radius: Jet) -> [Seed; 2] {
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
            Seed {
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
        self.is_bare(patch / PATCHES, point)
    }

    /// Outside, the least over the branches. Inside, the depth in the deepest branch, where the point
    /// of its surface that is closest is not buried in another branch.
    fn distance(&self, point: [f64; 3]) -> Option<f64> {
        let distances = self.branches.iter().map(|b| b.distance(point));
        let (nearest, closest) = distances
            .enumerate()
            .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let foot = add(point, scale(closest.outward, -closest.distance));
        (closest.distance >= 0.0 || self.is_bare(nearest, foot)).then_some(closest.distance)
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
    /// Whether `point` is in none of the branches but, at most, `own`.
    fn is_bare(&self, own: usize, point: [f64; 3]) -> bool {
        let mut others = self.branches.iter().enumerate().filter(|(i, _)| *i != own);
        !others.any(|(_, b)| b.contains(point))
    }
}
