//! Machine parts with sharp edges: unions of prisms and cylinders.

use isograd_element::vector::{add, dot, scale, sub};

use super::body::{Body, Random};

/// A convex prism along its own y axis, moved and turned about y and then z.
#[derive(Clone, Debug)]
pub struct Prism {
    /// Corners of its cross-section in x and z, counter-clockwise.
    pub corners: Vec<[f64; 2]>,
    /// Length along y.
    pub length: f64,
    /// Turns about y and z, in degrees.
    pub turned: [f64; 2],
    /// Center of the cross-section half-way along.
    pub center: [f64; 3],
}

impl Prism {
    /// A box of these sides, not turned.
    pub fn cuboid([x, y, z]: [f64; 3], center: [f64; 3]) -> Self {
        let (a, c) = (0.5 * x, 0.5 * z);
        Self {
            corners: vec![[-a, -c], [a, -c], [a, c], [-a, c]],
            length: y,
            turned: [0.0; 2],
            center,
        }
    }

    /// A regular prism with this number of sides.
    pub fn regular(sides: usize, radius: f64, length: f64, center: [f64; 3]) -> Self {
        let corner = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
            [radius * cos, radius * sin]
        };
        Self {
            corners: (0..sides).map(corner).collect(),
            length,
            turned: [0.0; 2],
            center,
        }
    }

    /// Turned about y and then z, in degrees.
    #[must_use]
    pub fn turned(mut self, turned: [f64; 2]) -> Self {
        self.turned = turned;
        self
    }

    /// Axes of the prism in space.
    fn frame(&self) -> [[f64; 3]; 3] {
        let [(sy, cy), (sz, cz)] = self.turned.map(|t| t.to_radians().sin_cos());
        let turn_z = |[x, y, z]: [f64; 3]| [cz * x - sz * y, sz * x + cz * y, z];
        [[cy, 0.0, -sy], [0.0, 1.0, 0.0], [sy, 0.0, cy]].map(turn_z)
    }

    fn edges(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(&a, &b)| (a, b))
    }

    /// Area of the cross-section: triangles to the center.
    fn section(&self) -> f64 {
        let twice = self.edges().map(|(a, b)| a[0] * b[1] - a[1] * b[0]);
        0.5 * twice.sum::<f64>()
    }

    fn area(&self) -> f64 {
        let side = |(a, b): ([f64; 2], [f64; 2])| self.length * (b[0] - a[0]).hypot(b[1] - a[1]);
        2.0 * self.section() + self.edges().map(side).sum::<f64>()
    }

    /// Whether a point lies inside, by more than rounding.
    fn contains(&self, point: [f64; 3]) -> bool {
        let offset = sub(point, self.center);
        let [x, y, z] = self.frame().map(|axis| dot(axis, offset));
        let left = |(a, b): ([f64; 2], [f64; 2])| {
            (b[0] - a[0]) * (z - a[1]) - (b[1] - a[1]) * (x - a[0]) > 1e-9
        };
        y.abs() < 0.5 * self.length - 1e-9 && self.edges().all(left)
    }

    /// Random sample of the surface, uniform by area, with its outward normal.
    fn sample(&self, random: &mut Random) -> ([f64; 3], [f64; 3]) {
        let mut pick = random.unit() * self.area();
        let [u, v, w] = [(); 3].map(|()| random.unit());
        for (a, b) in self.edges() {
            let (dx, dz) = (b[0] - a[0], b[1] - a[1]);
            let side = dx.hypot(dz);
            pick -= side * self.length;
            if pick < 0.0 {
                let local = [a[0] + u * dx, (v - 0.5) * self.length, a[1] + u * dz];
                return self.placed(local, [dz / side, 0.0, -dx / side]);
            }
        }
        let end = if w < 0.5 { -1.0 } else { 1.0 };
        let mut place = 2.0 * (w - if w < 0.5 { 0.0 } else { 0.5 }) * self.section();
        let (mut x, mut z) = (0.0, 0.0);
        for (a, b) in self.edges() {
            let (s, t) = (u.sqrt(), v);
            (x, z) = (
                s * (a[0] + t * (b[0] - a[0])),
                s * (a[1] + t * (b[1] - a[1])),
            );
            place -= 0.5 * (a[0] * b[1] - a[1] * b[0]);
            if place < 0.0 {
                break;
            }
        }
        self.placed([x, 0.5 * end * self.length, z], [0.0, end, 0.0])
    }

    fn placed(&self, point: [f64; 3], normal: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let frame = self.frame();
        let in_space = |v: [f64; 3]| {
            let terms = [0, 1, 2].map(|a| scale(frame[a], v[a]));
            add(terms[0], add(terms[1], terms[2]))
        };
        (add(self.center, in_space(point)), in_space(normal))
    }
}

/// About `n` random samples of the surface of a union of prisms.
pub fn union(prisms: &[Prism], n: usize, seed: u64) -> Body {
    let mut random = Random::new(seed);
    let total: f64 = prisms.iter().map(Prism::area).sum();
    let mut body = Body::default();
    for (k, prism) in prisms.iter().enumerate() {
        for _ in 0..(n as f64 * prism.area() / total) as usize {
            let (x, normal) = prism.sample(&mut random);
            let others = prisms.iter().enumerate().filter(|&(l, _)| l != k);
            if !others.clone().any(|(_, other)| other.contains(x)) {
                body.points.push(x);
                body.normals.push(normal);
            }
        }
    }
    body
}

/// A plate of 1 × 1 with six ribs across; walls and ribs of the given thickness.
pub fn ribbed_plate(thickness: f64) -> Vec<Prism> {
    let rib = |k: usize| {
        let x = -0.4 + 0.16 * k as f64;
        Prism::cuboid([thickness, 0.9, 0.2], [x, 0.0, 0.1])
    };
    let plate = Prism::cuboid([1.0, 1.0, thickness], [0.0; 3]);
    std::iter::once(plate).chain((0..6).map(rib)).collect()
}

/// Walls of the given thickness, seven along x and seven along y.
pub fn grating(thickness: f64) -> Vec<Prism> {
    let places = (0..7).map(|k| -0.48 + 0.16 * f64::from(k));
    let walls = places.flat_map(|at| {
        [
            Prism::cuboid([thickness, 1.0, 0.3], [at, 0.0, 0.0]),
            Prism::cuboid([1.0, thickness, 0.3], [0.0, at, 0.0]),
        ]
    });
    walls.collect()
}

/// Seven discs of the given thickness on a shaft, so far apart.
pub fn discs(thickness: f64, gap: f64) -> Vec<Prism> {
    let pitch = thickness + gap;
    let disc = |k: u32| Prism::regular(24, 0.3, thickness, [0.0, pitch * f64::from(k), 0.0]);
    let middle = [0.0, 3.0 * pitch + 0.5 * thickness, 0.0];
    let shaft = Prism::regular(8, 0.1, 6.0 * pitch + 3.0 * thickness, middle);
    (0..7).map(disc).chain([shaft]).collect()
}

/// A hub with seven slanted blades of the given thickness.
pub fn rotor(thickness: f64) -> Vec<Prism> {
    let blade = |k: u32| {
        let turn = 360.0 * f64::from(k) / 7.0;
        let (sin, cos) = turn.to_radians().sin_cos();
        let center = [-0.31 * sin, 0.31 * cos, 0.0];
        Prism::cuboid([0.25, 0.42, thickness], center).turned([40.0, turn])
    };
    let hub = Prism::cuboid([0.25, 0.25, 0.4], [0.0; 3]);
    (0..7).map(blade).chain([hub]).collect()
}

/// A blade with two sharp edges, a diamond in cross-section: chord 1, length 3.
pub fn blade(thickness: f64) -> Prism {
    let t = 0.5 * thickness;
    Prism {
        corners: vec![[-0.5, 0.0], [-0.1, -t], [0.5, 0.0], [-0.1, t]],
        length: 3.0,
        turned: [20.0, 35.0],
        center: [0.0; 3],
    }
}

/// Seven hexagonal tubes side by side, whose surfaces are `gap` apart.
pub fn bundle(gap: f64) -> Vec<Prism> {
    let radius = 0.1;
    let pitch = 3.0f64.sqrt() * radius + gap;
    let around = (0..6).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * (f64::from(k) + 0.5) / 6.0).sin_cos();
        [pitch * cos, 0.0, pitch * sin]
    });
    let centers = std::iter::once([0.0; 3]).chain(around);
    centers.map(|c| Prism::regular(6, radius, 1.0, c)).collect()
}

/// A bracket: an octagonal post, a plate, a wedge and a slanted bar.
pub fn bracket(seed: u64) -> Vec<Prism> {
    let mut random = Random::new(seed);
    let mut turn = |most: f64| most * (2.0 * random.unit() - 1.0);
    let wedge = Prism {
        corners: vec![[-0.3, -0.1], [0.4, -0.1], [-0.3, 0.25]],
        length: 0.4,
        turned: [turn(20.0), turn(40.0)],
        center: [0.25, 0.15, 0.1],
    };
    vec![
        Prism::regular(8, 0.2, 0.9, [-0.2, 0.0, 0.2]).turned([turn(20.0), turn(30.0)]),
        Prism::cuboid([1.0, 0.7, 0.12], [0.0; 3]).turned([turn(5.0), turn(90.0)]),
        wedge,
        Prism::cuboid([0.15, 1.1, 0.1], [0.1, -0.1, 0.3]).turned([turn(30.0), turn(60.0)]),
    ]
}

#[cfg(test)]
mod tests {
    use isograd_element::vector::norm;

    use super::*;

    /// By the divergence theorem, the mean of (x, n) over the surface is three times volume over area.
    #[test]
    fn samples_are_uniform_with_outward_normals() {
        let prism = Prism::regular(6, 0.3, 0.8, [1.0, 2.0, 3.0]).turned([30.0, 50.0]);
        let body = union(std::slice::from_ref(&prism), 200_000, 1);
        let moments = body.points.iter().zip(&body.normals);
        let sum: f64 = moments.map(|(&x, &n)| dot(sub(x, prism.center), n)).sum();
        let mean = sum / body.points.len() as f64;
        let expected = 3.0 * prism.section() * prism.length / prism.area();
        assert!((mean - expected).abs() < 2e-3, "{mean} {expected}");
        assert!(body.normals.iter().all(|&n| (norm(n) - 1.0).abs() < 1e-9));
        // A step inward is inside, and one outward is not.
        for (&x, &n) in body.points.iter().zip(&body.normals).take(1000) {
            assert!(prism.contains(sub(x, scale(n, 1e-6))));
            assert!(!prism.contains(add(x, scale(n, 1e-6))));
        }
    }
}
