//! Vectors of three components in formulas.

#[cfg(cube)]
use cubecl::prelude::*;

use super::{Element, select};

/// A point, a direction, or one number for each corner of a triangle.
#[cfg_attr(cube, derive(CubeType, CubeTypeMut))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector3<F: Element> {
    /// Component along x.
    pub x: F,
    /// Component along y.
    pub y: F,
    /// Component along z.
    pub z: F,
}

#[cfg_attr(cube, cube)]
#[allow(clippy::should_implement_trait)] // kernels have no operators for structs
impl<F: Element> Vector3<F> {
    /// The vector `(x, y, z)`.
    #[inline(always)]
    pub fn of(x: F, y: F, z: F) -> Self {
        Vector3::<F> { x, y, z }
    }

    /// `self + other`.
    #[inline(always)]
    pub fn add(self, other: Self) -> Self {
        Vector3::<F> {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }

    /// `self − other`.
    #[inline(always)]
    pub fn sub(self, other: Self) -> Self {
        Vector3::<F> {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }

    /// `factor · self`.
    #[inline(always)]
    pub fn scale(self, factor: F) -> Self {
        Vector3::<F> {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    /// `self · other`.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// `self × other`.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Vector3::<F> {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// `self` where the condition holds, else `other`.
    #[inline(always)]
    pub fn choose(self, condition: bool, other: Self) -> Self {
        Vector3::<F> {
            x: select(condition, self.x, other.x),
            y: select(condition, self.y, other.y),
            z: select(condition, self.z, other.z),
        }
    }
}

#[cfg(not(cube))]
impl<F: Element> From<[F; 3]> for Vector3<F> {
    #[inline(always)]
    fn from([x, y, z]: [F; 3]) -> Self {
        Self { x, y, z }
    }
}

#[cfg(not(cube))]
impl<F: Element> From<Vector3<F>> for [F; 3] {
    #[inline(always)]
    fn from(v: Vector3<F>) -> Self {
        [v.x, v.y, v.z]
    }
}
