//! Vectors of three components in loops on the CPU.

use num_traits::Float;

/// `a + b`.
#[inline(always)]
pub fn add<T: Float>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a − b`.
#[inline(always)]
pub fn sub<T: Float>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s a`.
#[inline(always)]
pub fn scale<T: Float>(a: [T; 3], s: T) -> [T; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a · b`.
#[inline(always)]
pub fn dot<T: Float>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline(always)]
pub fn cross<T: Float>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `|a|²`.
#[inline(always)]
pub fn norm_squared<T: Float>(a: [T; 3]) -> T {
    dot(a, a)
}

/// `|a|`.
#[inline(always)]
pub fn norm<T: Float>(a: [T; 3]) -> T {
    dot(a, a).sqrt()
}

/// `a / |a|`, or `None` where the length is zero or not finite.
#[inline(always)]
pub fn normalized<T: Float>(a: [T; 3]) -> Option<[T; 3]> {
    // Scaled by the largest component first, so that tiny and huge vectors neither underflow nor overflow.
    let largest = a[0].abs().max(a[1].abs()).max(a[2].abs());
    // The maximum skips NaN, so it can't stand for all three.
    if !(largest > T::zero()) || !is_finite(a) {
        return None;
    }
    let b = [a[0] / largest, a[1] / largest, a[2] / largest];
    let length = norm(b);
    Some([b[0] / length, b[1] / length, b[2] / length])
}

/// Two unit vectors that make a right-handed basis with the unit vector `a` before them, or `None` where `a`
/// has no direction.
pub fn tangents<T: Float>(a: [T; 3]) -> Option<[[T; 3]; 2]> {
    let smaller = |m: usize, k: usize| if a[k].abs() < a[m].abs() { k } else { m };
    let mut axis = [T::zero(); 3];
    axis[(0..3).fold(0, smaller)] = T::one();
    let first = normalized(cross(a, axis))?;
    Some([first, cross(a, first)])
}

/// Whether all three components are finite.
#[inline(always)]
pub fn is_finite<T: Float>(a: [T; 3]) -> bool {
    a[0].is_finite() && a[1].is_finite() && a[2].is_finite()
}

/// `a` in double precision (exact).
#[inline(always)]
pub fn to_f64<T: Float>(a: [T; 3]) -> [f64; 3] {
    let exact = |x: T| x.to_f64().unwrap_or(f64::NAN);
    [exact(a[0]), exact(a[1]), exact(a[2])]
}

/// The nearest vector of type `T`.
#[inline(always)]
pub fn of_f64<T: Float>(a: [f64; 3]) -> [T; 3] {
    let nearest = |x: f64| T::from(x).unwrap_or_else(T::nan);
    [nearest(a[0]), nearest(a[1]), nearest(a[2])]
}
