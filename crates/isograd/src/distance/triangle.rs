//! One point and one triangle.
//!
//! A triangle is described in its own plane frame: the longest edge is the base, along `u` from a corner
//! `a`; the apex lies at `(cx, cy)` with `0 ≤ cx ≤ base` and `cy ≥ 0`. A point at `(x, y, z)` in that frame
//! is `z² +` (plane distance)² away. The frame is orthonormal whatever the shape of the triangle, so that
//! slivers, needles and single points lose nothing: the result is that of a triangle whose corners moved by
//! a few units in the last place.

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
    origin: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    normal: [f64; 3],
    base: f64,
    apex: [f64; 2],
    /// Unit direction and length of the side from the origin to the apex.
    left: [f64; 2],
    left_length: f64,
    /// Unit direction and length of the side from the end of the base to the apex.
    right: [f64; 2],
    right_length: f64,
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
        let foot = dot(u, to_apex);
        let (v, height) = perpendicular(u, sub(to_apex, scale(u, foot)));
        let apex = [foot, height];
        let (left, left_length) = direction(apex, [1.0, 0.0]);
        let (right, right_length) = direction([foot - base, height], [-1.0, 0.0]);
        Self {
            origin,
            u,
            v,
            normal: cross(u, v),
            base,
            apex,
            left,
            left_length,
            right,
            right_length,
            slack: slack(base, apex),
            first,
        }
    }

    /// [`closest_point`], for the corners that the frame was made of.
    pub(crate) fn closest(&self, query: [f64; 3], corners: [[f64; 3]; 3]) -> Closest {
        let (barycentric, feature) = self.barycentric(query);
        closest_from(query, corners, barycentric, feature, self.normal)
    }

    /// [`unit_normal`] of the triangle.
    pub(crate) fn unit_normal(&self) -> Option<[f64; 3]> {
        (self.apex[1] > 0.0).then_some(self.normal)
    }

    pub(crate) fn centroid(&self) -> [f64; 3] {
        let along = scale(self.u, (self.base + self.apex[0]) / 3.0);
        add(self.origin, add(along, scale(self.v, self.apex[1] / 3.0)))
    }

    pub(crate) fn slack(&self) -> f64 {
        self.slack
    }

    pub(crate) fn longest_edge(&self) -> f64 {
        self.base
    }

    /// Squared distance from `q`. Without branches, so that a loop over points becomes vector code.
    #[inline(always)]
    pub(crate) fn distance_squared(&self, q: [f64; 3]) -> f64 {
        let p = sub(q, self.origin);
        let (x, y, z) = (dot(self.u, p), dot(self.v, p), dot(self.normal, p));
        let beyond = x - clamp(x, self.base);
        let base = beyond * beyond + y * y;
        let (left, left_side) = side_distance(self.left, self.left_length, [x, y]);
        let (right, right_side) = side_distance(self.right, self.right_length, [x - self.base, y]);
        let inside = (y > 0.0) & (left_side < 0.0) & (right_side > 0.0);
        let border = min(base, min(left, right));
        z * z + if inside { 0.0 } else { border }
    }

    /// The point of the triangle closest to `q`, rounded.
    pub(crate) fn nearest(&self, q: [f64; 3]) -> [f64; 3] {
        let p = sub(q, self.origin);
        let ([_, b, c], _) = self.plane_barycentric([dot(self.u, p), dot(self.v, p)]);
        let along = b * self.base + c * self.apex[0];
        let up = c * self.apex[1];
        add(self.origin, add(scale(self.u, along), scale(self.v, up)))
    }

    /// Weights of the corners, in their own order, at the closest point, and where it lies.
    fn barycentric(&self, q: [f64; 3]) -> ([f64; 3], Feature) {
        let p = sub(q, self.origin);
        let (weights, feature) = self.plane_barycentric([dot(self.u, p), dot(self.v, p)]);
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

    /// The same in the plane, the origin being corner 0.
    fn plane_barycentric(&self, [x, y]: [f64; 2]) -> ([f64; 3], Feature) {
        let beyond = x - clamp(x, self.base);
        let base = beyond * beyond + y * y;
        let (left, left_side) = side_distance(self.left, self.left_length, [x, y]);
        let (right, right_side) = side_distance(self.right, self.right_length, [x - self.base, y]);
        if y > 0.0 && left_side < 0.0 && right_side > 0.0 {
            let c = min(y / self.apex[1], 1.0);
            let b = clamp((x - c * self.apex[0]) / self.base, 1.0 - c);
            return ([1.0 - b - c, b, c], Feature::Face);
        }
        if base <= left && base <= right {
            on_edge(0, x, self.base)
        } else if left <= right {
            // The left side runs from corner 2 to corner 0.
            let back = self.left_length - (x * self.left[0] + y * self.left[1]);
            on_edge(2, back, self.left_length)
        } else {
            let along = (x - self.base) * self.right[0] + y * self.right[1];
            on_edge(1, along, self.right_length)
        }
    }
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

/// Squared distance in the plane from `p` to the segment from 0 along a unit direction, and on which side of
/// its line `p` is (positive on the left).
#[inline(always)]
fn side_distance(unit: [f64; 2], length: f64, p: [f64; 2]) -> (f64, f64) {
    let along = unit[0] * p[0] + unit[1] * p[1];
    let across = unit[0] * p[1] - unit[1] * p[0];
    let beyond = along - clamp(along, length);
    (beyond * beyond + across * across, across)
}

/// `x` held to `0..=high`. As the machine does it: `f64::clamp` and `f64::max` cost more for their NaN rule.
#[inline(always)]
fn clamp(x: f64, high: f64) -> f64 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < high { x } else { high }
}

#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Direction and length of `r` after what it has along `u` is taken off once more: the first time leaves a
/// rounding error that a thin triangle would see. Where little remains, `r` was nothing but that error: then
/// any direction across `u`, and no length.
fn perpendicular(u: [f64; 3], r: [f64; 3]) -> ([f64; 3], f64) {
    let across = sub(r, scale(u, dot(u, r)));
    let length = norm(across);
    match normalized(across) {
        Some(v) if length > 0.5 * norm(r) => {
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

/// Unit direction and length of a plane vector. Without a length, or along the base, it is `otherwise`, with
/// which no point is inside: the two sides then ask for opposite signs of `y`.
fn direction(r: [f64; 2], otherwise: [f64; 2]) -> ([f64; 2], f64) {
    let length = (r[0] * r[0] + r[1] * r[1]).sqrt();
    if r[1] > 0.0 {
        ([r[0] / length, r[1] / length], length)
    } else {
        (otherwise, length)
    }
}

/// The most by which a point of the triangle can be closer (squared) than its closest corner: for the point
/// `Σ β_k y_k` that is `Σ_{j<k} β_j β_k |y_j − y_k|²`, the power of the point in the circumscribed circle,
/// so `R²` where its centre is inside the triangle, else a quarter of the longest edge squared.
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
