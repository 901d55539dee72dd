//! Vectors of three numbers in kernels.

use cubecl::prelude::*;

/// Three numbers: a place, a direction, or one number for each corner of a triangle.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Vector3<F: Float> {
    pub x: F,
    pub y: F,
    pub z: F,
}

/// Vector `index` of a flat `(N, 3)` array.
#[cube]
pub(super) fn load<F: Float>(values: &Array<F>, index: u32) -> Vector3<F> {
    let at = index as usize * 3;
    Vector3::<F> {
        x: values[at],
        y: values[at + 1],
        z: values[at + 2],
    }
}

#[cube]
pub(super) fn zero<F: Float>() -> Vector3<F> {
    Vector3::<F> {
        x: F::new(0.0),
        y: F::new(0.0),
        z: F::new(0.0),
    }
}

#[cube]
pub(super) fn add<F: Float>(a: Vector3<F>, b: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: a.x + b.x,
        y: a.y + b.y,
        z: a.z + b.z,
    }
}

#[cube]
pub(super) fn sub<F: Float>(a: Vector3<F>, b: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: a.x - b.x,
        y: a.y - b.y,
        z: a.z - b.z,
    }
}

#[cube]
pub(super) fn scale<F: Float>(a: Vector3<F>, s: F) -> Vector3<F> {
    Vector3::<F> {
        x: a.x * s,
        y: a.y * s,
        z: a.z * s,
    }
}

#[cube]
pub(super) fn dot<F: Float>(a: Vector3<F>, b: Vector3<F>) -> F {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[cube]
pub(super) fn cross<F: Float>(a: Vector3<F>, b: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: a.y * b.z - a.z * b.y,
        y: a.z * b.x - a.x * b.z,
        z: a.x * b.y - a.y * b.x,
    }
}

#[cube]
pub(super) fn norm<F: Float>(a: Vector3<F>) -> F {
    F::sqrt(dot::<F>(a, a))
}

/// `a / |a|`; zero where `a` is. Scaled by the largest component first, so that short vectors keep their
/// direction.
#[cube]
pub(super) fn direction<F: Float>(a: Vector3<F>) -> Vector3<F> {
    let largest = max(max(F::abs(a.x), F::abs(a.y)), F::abs(a.z));
    let scaled = divide::<F>(a, largest);
    divide::<F>(scaled, norm::<F>(scaled))
}

/// `a / s`; zero where `s` is not positive.
#[cube]
fn divide<F: Float>(a: Vector3<F>, s: F) -> Vector3<F> {
    let zero = F::new(0.0);
    let positive = s > zero;
    let by = select(positive, s, F::new(1.0));
    Vector3::<F> {
        x: select(positive, a.x / by, zero),
        y: select(positive, a.y / by, zero),
        z: select(positive, a.z / by, zero),
    }
}

/// One of two vectors.
#[cube]
pub(super) fn choose<F: Float>(first: bool, a: Vector3<F>, b: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: select(first, a.x, b.x),
        y: select(first, a.y, b.y),
        z: select(first, a.z, b.z),
    }
}
