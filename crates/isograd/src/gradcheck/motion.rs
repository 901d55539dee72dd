//! Directions in which all points of a cloud are moved.

use crate::vector::{add, cross, dot, norm, scale, sub};

/// A direction for every point of a cloud. The longest of its vectors has length 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// A random unit vector for each point by itself.
    Noise,
    /// A random smooth field: a cosine of place for each component, about the body's length long.
    Waves,
    /// Along an axis: 0, 1 or 2.
    Translation(usize),
    /// Round an axis through the center of the bounding box.
    Rotation(usize),
    /// Away from the center of the bounding box, in proportion to the distance.
    Growth,
    /// Across the longest side of the bounding box, with the square of the distance from its middle.
    Bending,
}

impl Motion {
    /// One of each kind and axis.
    pub const ALL: [Self; 10] = [
        Self::Noise,
        Self::Waves,
        Self::Translation(0),
        Self::Translation(1),
        Self::Translation(2),
        Self::Rotation(0),
        Self::Rotation(1),
        Self::Rotation(2),
        Self::Growth,
        Self::Bending,
    ];

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Waves => "waves",
            Self::Translation(0) => "translation x",
            Self::Translation(1) => "translation y",
            Self::Translation(_) => "translation z",
            Self::Rotation(0) => "rotation x",
            Self::Rotation(1) => "rotation y",
            Self::Rotation(_) => "rotation z",
            Self::Growth => "growth",
            Self::Bending => "bending",
        }
    }

    /// `(N, 3)` directions for these points.
    pub fn direction(self, points: &[[f64; 3]], seed: u64) -> Vec<[f64; 3]> {
        let (low, high) = crate::data::bounds(points).unwrap_or_default();
        let (center, size) = (scale(add(low, high), 0.5), sub(high, low));
        let unit = |axis: usize| {
            let mut unit = [0.0; 3];
            unit[axis.min(2)] = 1.0;
            unit
        };
        let mut random = Random::new(seed);
        let directions: Vec<[f64; 3]> = match self {
            Self::Noise => points.iter().map(|_| random.direction()).collect(),
            Self::Waves => {
                let waves = [0; 3].map(|_| Wave::new(norm(size), &mut random));
                let at = |p: &[f64; 3]| waves.each_ref().map(|wave| wave.at(sub(*p, center)));
                points.iter().map(at).collect()
            }
            Self::Translation(axis) => vec![unit(axis); points.len()],
            Self::Rotation(axis) => {
                let around = |p: &[f64; 3]| cross(unit(axis), sub(*p, center));
                points.iter().map(around).collect()
            }
            Self::Growth => points.iter().map(|p| sub(*p, center)).collect(),
            Self::Bending => {
                let long = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
                let across = unit((long + 1) % 3);
                let bent = |p: &[f64; 3]| scale(across, (p[long] - center[long]).powi(2));
                points.iter().map(bent).collect()
            }
        };
        let longest = directions.iter().fold(0.0, |m: f64, &v| m.max(norm(v)));
        let factor = if longest > 0.0 { 1.0 / longest } else { 0.0 };
        directions.into_iter().map(|v| scale(v, factor)).collect()
    }
}

/// `cos(k·x + phase)`.
struct Wave {
    number: [f64; 3],
    phase: f64,
}

impl Wave {
    /// A wave of about this length.
    fn new(length: f64, random: &mut Random) -> Self {
        let number = (4.0 + 4.0 * random.uniform()) / length.max(f64::MIN_POSITIVE);
        Self {
            number: scale(random.direction(), number),
            phase: std::f64::consts::TAU * random.uniform(),
        }
    }

    fn at(&self, x: [f64; 3]) -> f64 {
        (dot(self.number, x) + self.phase).cos()
    }
}

/// Steele, Lea and Flood's generator: the same numbers for ever.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// From 0 to 1.
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A unit vector, every direction as likely.
    pub(super) fn direction(&mut self) -> [f64; 3] {
        let z = 2.0 * self.uniform() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        [across * cos, across * sin, z]
    }
}
