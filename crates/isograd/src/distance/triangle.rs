//! One point and one triangle.
//!
//! A triangle is described in its own plane frame: the longest edge is the base, along `u` from a corner
//! `a`; the apex lies at `(cx, cy)` with `0 ≤ cx ≤ base` and `cy ≥ 0`. A point at `(x, y, z)` in that frame
//! is `z² +` (plane distance)² away. The frame is orthonormal whatever the shape of the triangle, so that
//! slivers, needles and single points lose nothing: the result is that of a triangle whose corners moved by
//! a few units in the last place.

use num_traits::Float;

use crate::vector::{add, cross, dot, norm, norm_squared, normalized, scale, sub};

/// The part of a triangle on which a closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside the face.
    Face,
    /// Inside the edge from this corner (0, 1 or 2) to the next.
    Edge(usize),
    /// On this corner.
    Vertex(usize),
}

/// The point of a triangle that is closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Weights of the three corners: not negative, their sum is 1.
    pub barycentric: [f64; 3],
    /// The closest point itself.
    pub point: [f64; 3],
    /// From the closest point to the query.
    pub offset: [f64; 3],
    /// Length of the offset.
    pub distance: f64,
    /// Where on the triangle it lies.
    pub feature: Feature,
}

/// The point of the triangle `corners` that is closest to `query`, in all seven regions (C. Ericson,
/// *Real-Time Collision Detection*, §5.1.5, in an orthonormal frame). A triangle without area is the
/// longest of its edges, or a point.
///
/// The error of the distance is a few `ε` times the way from the query to the nearest corner.
pub fn closest_point(query: [f64; 3], corners: [[f64; 3]; 3]) -> Closest {
    Frame::new(corners).closest(query, corners)
}

/// Unit normal of a triangle by the right-hand rule; `None` where it has no area.
pub fn unit_normal(corners: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    Frame::new(corners).unit_normal()
}

/// The offset is taken from the nearest corner, where the least is lost to cancellation.
fn closest_from(
    query: [f64; 3],
    corners: [[f64; 3]; 3],
    barycentric: [f64; 3],
    feature: Feature,
    normal: [f64; 3],
) -> Closest {
    let near = (1..3).fold(0, |m, k| {
        if barycentric[k] > barycentric[m] {
            k
        } else {
            m
        }
    });
    let from = sub(query, corners[near]);
    let offset = match feature {
        Feature::Face => scale(normal, dot(normal, from)),
        Feature::Edge(k) => {
            let along = sub(corners[(k + 1) % 3], corners[k]);
            let unit = normalized(along).unwrap_or([0.0; 3]);
            sub(from, scale(unit, dot(unit, from)))
        }
        Feature::Vertex(_) => from,
    };
    Closest {
        barycentric,
        point: combine(corners, barycentric),
        offset,
        distance: norm(offset),
        feature,
    }
}

/// `Σ β_k y_k`.
fn combine(corners: [[f64; 3]; 3], weights: [f64; 3]) -> [f64; 3] {
    let ab = add(scale(corners[0], weights[0]), scale(corners[1], weights[1]));
    add(ab, scale(corners[2], weights[2]))
}

/// A triangle in its own plane; see the head of this file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(super) origin: [f64; 3],
    /// Unit vectors along the base, up to the apex, and across the plane.
    pub(super) axes: [[f64; 3]; 3],
    pub(super) outline: Outline<f64>,
    /// Height of the apex.
    height: f64,
    /// For every point `q`: `d²(q, triangle) ≥ min_k |q − y_k|² − slack`.
    slack: f64,
    /// Which corner the origin is.
    first: usize,
}

impl Frame {
    pub(crate) fn new(corners: [[f64; 3]; 3]) -> Self {
        let squared: [f64; 3] =
            std::array::from_fn(|k| norm_squared(sub(corners[(k + 1) % 3], corners[k])));
        let first = (1..3).fold(0, |m, k| if squared[k] > squared[m] { k } else { m });
        let origin = corners[first];
        let side = sub(corners[(first + 1) % 3], origin);
        let to_apex = sub(corners[(first + 2) % 3], origin);
        let base = norm(side);
        let u = normalized(side).unwrap_or([1.0, 0.0, 0.0]);
        // Beyond an end of the base by rounding, where the apex is that end, an angle would be above 90°.
        let foot = clamp(dot(u, to_apex), base);
        let (v, height) = perpendicular(u, to_apex, foot);
        Self {
            origin,
            axes: [u, v, cross(u, v)],
            outline: Outline::new(base, foot, height),
            height,
            slack: slack(base, [foot, height]),
            first,
        }
    }

    /// [`closest_point`], for the corners that the frame was made of.
    pub(crate) fn closest(&self, query: [f64; 3], corners: [[f64; 3]; 3]) -> Closest {
        let (barycentric, feature) = self.barycentric(query);
        closest_from(query, corners, barycentric, feature, self.axes[2])
    }

    /// [`unit_normal`] of the triangle.
    pub(crate) fn unit_normal(&self) -> Option<[f64; 3]> {
        (self.height > 0.0).then_some(self.axes[2])
    }

    /// Corner `k` of the triangle in its plane.
    pub(super) fn corner(&self, k: usize) -> [f64; 2] {
        match (k + 3 - self.first) % 3 {
            0 => [0.0, 0.0],
            1 => [self.outline.base, 0.0],
            _ => [self.outline.foot, self.height],
        }
    }

    pub(crate) fn slack(&self) -> f64 {
        self.slack
    }

    pub(crate) fn longest_edge(&self) -> f64 {
        self.outline.base
    }

    /// Squared distances from points, `[axis][point]`. Without branches, so that it becomes vector code.
    #[inline(always)]
    pub(super) fn distances<const N: usize>(&self, points: &[[f64; N]; 3]) -> [f64; N] {
        let Self {
            origin,
            axes: [u, v, w],
            outline,
            ..
        } = *self;
        let mut squared = [0.0; N];
        for l in 0..N {
            let p = sub([points[0][l], points[1][l], points[2][l]], origin);
            let (x, y, z) = (dot(u, p), dot(v, p), dot(w, p));
            squared[l] = z * z + outline.distance_squared(x, y, rounded_twice);
        }
        squared
    }

    /// The point of the triangle closest to `q`, rounded.
    pub(crate) fn nearest(&self, q: [f64; 3]) -> [f64; 3] {
        let [u, v, _] = self.axes;
        let p = sub(q, self.origin);
        let ([_, b, c], _) = self.plane_barycentric(dot(u, p), dot(v, p));
        let along = b * self.outline.base + c * self.outline.foot;
        add(self.origin, add(scale(u, along), scale(v, c * self.height)))
    }

    /// Weights of the corners, in their own order, at the closest point, and where it lies.
    fn barycentric(&self, q: [f64; 3]) -> ([f64; 3], Feature) {
        let p = sub(q, self.origin);
        let (weights, feature) = self.plane_barycentric(dot(self.axes[0], p), dot(self.axes[1], p));
        let mut turned = [0.0; 3];
        for k in 0..3 {
            turned[(k + self.first) % 3] = weights[k];
        }
        let feature = match feature {
            Feature::Face => Feature::Face,
            Feature::Edge(k) => Feature::Edge((k + self.first) % 3),
            Feature::Vertex(k) => Feature::Vertex((k + self.first) % 3),
        };
        (turned, feature)
    }

    /// Barycentric coordinates in the plane, the origin being corner 0.
    fn plane_barycentric(&self, x: f64, y: f64) -> ([f64; 3], Feature) {
        let Outline { base, foot, .. } = self.outline;
        if !(y > 0.0) {
            return on_edge(0, x, base);
        }
        let (side, way) = self.outline.side(x);
        let (along, across) = side.coordinates(way, y, rounded_twice);
        if across < 0.0 {
            let c = min(y / self.height, 1.0);
            let b = clamp((x - c * foot) / base, 1.0 - c);
            ([1.0 - b - c, b, c], Feature::Face)
        } else if x < foot {
            // The left side runs from corner 2 to corner 0.
            on_edge(2, side.length - along, side.length)
        } else {
            on_edge(1, along, side.length)
        }
    }
}

/// A triangle in its plane, its base from `(0, 0)` to `(base, 0)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline<T> {
    pub base: T,
    /// Where under the apex the base is: in `0..=base`, as the base is the longest edge.
    pub foot: T,
    /// The right side, seen in a mirror, from the other end of the base.
    pub right: Side<T>,
    /// The left side less the right one: to add a number or nothing is one operation of vector code, while a
    /// choice of two numbers in memory would be made of addresses, and gathered.
    pub left_from_right: Side<T>,
}

/// The side from an end of the base, which is the origin, up to the apex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side<T> {
    /// Unit direction; along the base where the apex is on it.
    pub unit: [T; 2],
    pub length: T,
}

impl Outline<f64> {
    fn new(base: f64, foot: f64, height: f64) -> Self {
        let left = Side::new(foot, height);
        let right = Side::new(base - foot, height);
        Self {
            base,
            foot,
            right,
            left_from_right: Side {
                unit: [left.unit[0] - right.unit[0], left.unit[1] - right.unit[1]],
                length: left.length - right.length,
            },
        }
    }
}

impl Side<f64> {
    fn new(foot: f64, height: f64) -> Self {
        let length = (foot * foot + height * height).sqrt();
        let unit = if height > 0.0 && length > 0.0 {
            [foot / length, height / length]
        } else {
            [1.0, 0.0]
        };
        Self { unit, length }
    }
}

impl<T: Float> Side<T> {
    /// Coordinates along the side and across it, positive outside. `multiply_add(a, b, c)` is `a b + c`.
    #[inline(always)]
    fn coordinates(&self, x: T, y: T, multiply_add: impl Fn(T, T, T) -> T) -> (T, T) {
        let [c, s] = self.unit;
        (multiply_add(c, x, s * y), multiply_add(c, y, -(s * x)))
    }
}

impl<T: Float> Outline<T> {
    /// Squared distance from a point of the plane. `multiply_add(a, b, c)` is `a b + c`.
    ///
    /// Angles at the base are not above 90°. So what is closest to a point above the base is on the side on
    /// its side of the apex, or inside; and a point below is as far from the triangle as from the point over
    /// it on the line of the base, and that way besides.
    #[inline(always)]
    pub fn distance_squared(&self, x: T, y: T, multiply_add: impl Fn(T, T, T) -> T + Copy) -> T {
        let zero = T::zero();
        let above = if y > zero { y } else { zero };
        let below = y - above;
        let (side, way) = self.side(x);
        let (along, across) = side.coordinates(way, above, multiply_add);
        let beyond = along - clamp(along, side.length);
        let outside = if across > zero { across } else { zero };
        multiply_add(
            below,
            below,
            multiply_add(beyond, beyond, outside * outside),
        )
    }

    /// The side on this side of the apex, and how far `x` is from its end of the base.
    #[inline(always)]
    fn side(&self, x: T) -> (Side<T>, T) {
        let (zero, left) = (T::zero(), x < self.foot);
        let Side { unit: a, length: m } = self.right;
        let Side { unit: b, length: n } = self.left_from_right;
        let side = Side {
            unit: [
                a[0] + if left { b[0] } else { zero },
                a[1] + if left { b[1] } else { zero },
            ],
            length: m + if left { n } else { zero },
        };
        let back = self.base - x;
        (side, if left { x } else { back })
    }
}

/// `a b + c` with the same bits on every machine.
#[inline(always)]
fn rounded_twice(a: f64, b: f64, c: f64) -> f64 {
    a * b + c
}

/// Weights at the place `along` of edge `k`, whose length is given.
fn on_edge(k: usize, along: f64, length: f64) -> ([f64; 3], Feature) {
    let mut weights = [0.0; 3];
    if !(along > 0.0) {
        weights[k] = 1.0;
        return (weights, Feature::Vertex(k));
    }
    let next = (k + 1) % 3;
    if along >= length {
        weights[next] = 1.0;
        return (weights, Feature::Vertex(next));
    }
    weights[next] = along / length;
    weights[k] = 1.0 - weights[next];
    (weights, Feature::Edge(k))
}

/// `x` held to `0..=high`. As the machine does it: `f64::clamp` and `f64::max` cost more for their NaN rule.
#[inline(always)]
fn clamp<T: Float>(x: T, high: T) -> T {
    let x = if x > T::zero() { x } else { T::zero() };
    if x < high { x } else { high }
}

#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Direction and length of what `side` has across the unit vector `u`, along which it has `along`. What `u` has of the
/// difference is taken off once more: the first time leaves a rounding error that a thin triangle would see. Where little
/// remains, the difference was nothing but rounding: then any direction across `u`, and no length.
fn perpendicular(u: [f64; 3], side: [f64; 3], along: f64) -> ([f64; 3], f64) {
    let rest = sub(side, scale(u, along));
    let across = sub(rest, scale(u, dot(u, rest)));
    let length = norm(across);
    let rounding = 4.0 * f64::EPSILON * norm(side);
    match normalized(across) {
        Some(v) if length > 0.5 * norm(rest) && length > rounding => {
            let v = sub(v, scale(u, dot(u, v)));
            (scale(v, 1.0 / norm(v)), length)
        }
        _ => (any_perpendicular(u), 0.0),
    }
}

/// A unit vector across the unit vector `u`.
fn any_perpendicular(u: [f64; 3]) -> [f64; 3] {
    let least = (1..3).fold(0, |m, k| if u[k].abs() < u[m].abs() { k } else { m });
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    normalized(cross(u, axis)).unwrap_or([0.0, 0.0, 1.0])
}

/// The most by which a point of the triangle can be closer (squared) than its closest corner: for the point
/// `Σ β_k y_k` that is `Σ_{j<k} β_j β_k |y_j − y_k|²`, the power of the point in the circumscribed circle,
/// so `R²` where its center is inside the triangle, else a quarter of the longest edge squared.
fn slack(base: f64, apex: [f64; 2]) -> f64 {
    let longest = base * base;
    let left = apex[0] * apex[0] + apex[1] * apex[1];
    let right = (apex[0] - base) * (apex[0] - base) + apex[1] * apex[1];
    // No triangle has more than a third; thin ones are given it, as their R² is hard to compute.
    let most = longest / 3.0;
    let bound = if left + right <= longest {
        longest / 4.0
    } else if apex[1] < 1e-3 * base {
        most
    } else {
        min(left * right / (4.0 * apex[1] * apex[1]), most)
    };
    bound * (1.0 + 1e-9)
}
