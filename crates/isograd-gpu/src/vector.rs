//! Vectors of three numbers in kernels.

use cubecl::prelude::*;

pub(crate) use crate::element::vector3::{Vector3, Vector3Expand};

#[cube]
impl<F: Float> Vector3<F> {
    /// Row `i` of an `(N, 3)` array.
    pub fn at(array: &Array<F>, i: usize) -> Self {
        Vector3::<F>::load(array, 3 * i)
    }

    /// Three numbers of an array, from `start` on.
    pub fn load(array: &Array<F>, start: usize) -> Self {
        Vector3::<F>::of(array[start], array[start + 1], array[start + 2])
    }

    pub fn write(self, array: &mut Array<F>, i: usize) {
        self.store(array, 3 * i);
    }

    /// Three numbers of an array, from `start` on.
    pub fn store(self, array: &mut Array<F>, start: usize) {
        array[start] = self.x;
        array[start + 1] = self.y;
        array[start + 2] = self.z;
    }

    /// Adds it to three numbers of an array, from `start` on.
    pub fn add_to(self, array: &mut Array<F>, start: usize) {
        array[start] += self.x;
        array[start + 1] += self.y;
        array[start + 2] += self.z;
    }

    /// Squared distance to the box between two corners; 0 inside.
    pub fn to_box_squared(self, low: Self, high: Self) -> F {
        let zero = F::new(0.0);
        let x = max(max(low.x - self.x, self.x - high.x), zero);
        let y = max(max(low.y - self.y, self.y - high.y), zero);
        let z = max(max(low.z - self.z, self.z - high.z), zero);
        x * x + y * y + z * z
    }

    pub fn zero() -> Self {
        Vector3::<F>::of(F::new(0.0), F::new(0.0), F::new(0.0))
    }

    pub fn is_finite(self) -> bool {
        is_finite::<F>(self.x) && is_finite::<F>(self.y) && is_finite::<F>(self.z)
    }

    pub fn norm(self) -> F {
        F::sqrt(self.dot(self))
    }

    /// The absolute value of the largest component.
    pub fn largest(self) -> F {
        max(max(F::abs(self.x), F::abs(self.y)), F::abs(self.z))
    }

    /// Of length 1; zero where there is no direction. Divided by the largest component first, so that short
    /// vectors keep theirs.
    pub fn direction(self) -> Self {
        let scaled = self.divide(self.largest());
        scaled.divide(scaled.norm())
    }

    /// Divided by a number.
    pub fn over(self, divisor: F) -> Self {
        Vector3::<F>::of(self.x / divisor, self.y / divisor, self.z / divisor)
    }

    /// [`Self::over`], but zero where the divisor is not positive.
    pub fn divide(self, divisor: F) -> Self {
        let zero = F::new(0.0);
        let positive = divisor > zero;
        let by = select(positive, divisor, F::new(1.0));
        Vector3::<F> {
            x: select(positive, self.x / by, zero),
            y: select(positive, self.y / by, zero),
            z: select(positive, self.z / by, zero),
        }
    }
}

/// Whether a number is neither infinite nor NaN.
#[cube]
pub(crate) fn is_finite<F: Float>(x: F) -> bool {
    // Nothing that is compared with NaN is true.
    x.abs() <= F::max_value()
}
