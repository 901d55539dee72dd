//! Numbers with derivatives: forward-mode differentiation of the surface maps.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Slot of the derivative with respect to the first surface coordinate.
pub(crate) const U: usize = 0;
/// Slot of the derivative with respect to the second surface coordinate.
pub(crate) const V: usize = 1;

/// Derivatives per number: as many as fill one or two vector registers.
pub(crate) const SLOTS: usize = 4;

/// A value and its derivatives with respect to [`SLOTS`] variables: `u` and `v`, or parameters.
///
/// Every surface map is written once, in jets. Normals, area elements, velocities and parameter
/// derivatives follow from it, exact to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet {
    pub value: f64,
    pub slope: [f64; SLOTS],
}

impl Jet {
    /// A constant.
    pub const fn constant(value: f64) -> Self {
        Self {
            value,
            slope: [0.0; SLOTS],
        }
    }

    /// The variable of slot `slot`.
    pub fn variable(value: f64, slot: usize) -> Self {
        let mut jet = Self::constant(value);
        jet.slope[slot] = 1.0;
        jet
    }

    /// `f(self)`, given the value and the derivative of `f`.
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self {
            value,
            slope: self.slope.map(|s| derivative * s),
        }
    }

    /// Square root. Its derivative at 0 is infinite, which surface maps avoid by their choice of coordinates.
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    /// Cube root of a positive number.
    pub fn cbrt(self) -> Self {
        let root = self.value.cbrt();
        self.chain(root, 1.0 / (3.0 * root * root))
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    /// Tangent.
    pub fn tan(self) -> Self {
        let (sin, cos) = self.sin_cos();
        sin / cos
    }

    /// `self²`.
    pub fn squared(self) -> Self {
        self * self
    }

    /// From degrees to radians.
    pub fn radians(self) -> Self {
        self * (std::f64::consts::PI / 180.0)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        chain_of_two(self.value + other.value, (self, 1.0), (other, 1.0))
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        chain_of_two(self.value - other.value, (self, 1.0), (other, -1.0))
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        chain_of_two(value, (self, other.value), (other, self.value))
    }
}

impl Div for Jet {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let (value, inverse) = (self.value / other.value, 1.0 / other.value);
        chain_of_two(value, (self, inverse), (other, -value * inverse))
    }
}

/// `f(a, b)`, given its value and its two partial derivatives.
fn chain_of_two(value: f64, (a, by_a): (Jet, f64), (b, by_b): (Jet, f64)) -> Jet {
    Jet {
        value,
        slope: std::array::from_fn(|k| by_a * a.slope[k] + by_b * b.slope[k]),
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        self.chain(self.value + other, 1.0)
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        self.chain(self.value - other, 1.0)
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other)
    }
}

impl Div<f64> for Jet {
    type Output = Self;
    fn div(self, other: f64) -> Self {
        self * (1.0 / other)
    }
}

impl Sub<Jet> for f64 {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        -other + self
    }
}

/// A point or a direction in jets.
pub(crate) type JetVector = [Jet; 3];

/// `a + s b`.
pub(crate) fn add_scaled(a: JetVector, s: Jet, b: JetVector) -> JetVector {
    std::array::from_fn(|k| a[k] + s * b[k])
}

/// `s a`.
pub(crate) fn scaled(a: JetVector, s: Jet) -> JetVector {
    a.map(|x| x * s)
}

/// `a × b`.
pub(crate) fn cross(a: JetVector, b: JetVector) -> JetVector {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i] * b[j] - a[j] * b[i]
    })
}

/// The values alone.
pub(crate) fn values(a: JetVector) -> [f64; 3] {
    a.map(|x| x.value)
}

/// The derivatives of slot `slot`.
pub(crate) fn slopes(a: JetVector, slot: usize) -> [f64; 3] {
    a.map(|x| x.slope[slot])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One expression through every operation of the type.
    fn expression(x: Jet, y: Jet) -> Jet {
        let (sin, cos) = (x * y).sin_cos();
        let root = (x.squared() + y.squared() + 1.0).sqrt();
        (sin / root + cos.tan() - x.cbrt() * 0.3) / (2.0 - y / 3.0) + (-x - 0.5).radians()
    }

    #[test]
    fn slopes_are_finite_differences_of_values() {
        let at = |x: f64, y: f64| expression(Jet::constant(x), Jet::constant(y)).value;
        let (x, y, e) = (0.7, -0.4, 1e-6);
        let jet = expression(Jet::variable(x, U), Jet::variable(y, V));
        let by_u = (at(x + e, y) - at(x - e, y)) / (2.0 * e);
        let by_v = (at(x, y + e) - at(x, y - e)) / (2.0 * e);
        // Central differences of an O(1) function: truncation e² and rounding 1e-16/e.
        assert!((jet.slope[U] - by_u).abs() < 1e-9, "{jet:?} {by_u}");
        assert!((jet.slope[V] - by_v).abs() < 1e-9, "{jet:?} {by_v}");
        assert_eq!(jet.slope[2], 0.0);
    }
}
