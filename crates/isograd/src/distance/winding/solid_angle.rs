//! Sums of signed solid angles of triangles.

use std::f64::consts::PI;

use super::super::bvh::{LANES, Points};

/// A triangle; `normal` is `(b − a) × (c − a)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub corners: [[f64; 3]; 3],
    pub normal: [f64; 3],
}

/// Sum of half the solid angles of some triangles at [`LANES`] points, as the argument of a complex number and full turns:
/// a product of complex numbers adds their arguments without an arc tangent for each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles {
    real: [f64; LANES],
    imaginary: [f64; LANES],
    turns: [f64; LANES],
}

impl Default for Angles {
    fn default() -> Self {
        Self {
            real: [1.0; LANES],
            imaginary: [0.0; LANES],
            turns: [0.0; LANES],
        }
    }
}

impl Angles {
    /// Adds a triangle: half its solid angle is the argument of the complex number of A. van Oosterom and J. Strackee, *The
    /// solid angle of a plane triangle*, 1983.
    #[inline(always)]
    pub(super) fn add(&mut self, triangle: &Triangle, points: &Points) {
        let [a, b, c] = triangle.corners;
        let n = triangle.normal;
        for l in 0..LANES {
            let to = |p: [f64; 3]| {
                [
                    p[0] - points[0][l],
                    p[1] - points[1][l],
                    p[2] - points[2][l],
                ]
            };
            let [a, b, c] = [to(a), to(b), to(c)];
            let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
            let [la, lb, lc] = [dot(a, a).sqrt(), dot(b, b).sqrt(), dot(c, c).sqrt()];
            let y = dot(a, n);
            let x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            let (re, im) = (self.real[l], self.imaginary[l]);
            let product = [re * x - im * y, re * y + im * x];
            let size = product[0].abs() + product[1].abs();
            // At a corner of the triangle the angle has no value, and 0 is added.
            let has_angle = size > 0.0;
            let per_size = if has_angle { 1.0 / size } else { 0.0 };
            let upper = (im >= 0.0) & (y >= 0.0) & (product[1] < 0.0);
            let lower = (im < 0.0) & (y < 0.0) & (product[1] >= 0.0);
            let turn = f64::from(u8::from(upper)) - f64::from(u8::from(lower));
            self.turns[l] += if has_angle { turn } else { 0.0 };
            self.real[l] = if has_angle { product[0] * per_size } else { re };
            self.imaginary[l] = if has_angle { product[1] * per_size } else { im };
        }
    }

    /// The sums over 4π.
    #[inline(always)]
    pub(super) fn turns(&self) -> [f64; LANES] {
        let mut sum = [0.0; LANES];
        for l in 0..LANES {
            let argument = self.imaginary[l].atan2(self.real[l]);
            sum[l] = self.turns[l] + argument / (2.0 * PI);
        }
        sum
    }
}
