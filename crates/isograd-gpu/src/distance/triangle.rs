//! One point and one triangle, in kernels.
//!
//! As on the CPU (`isograd::distance::triangle`) a triangle is described in its own plane frame: the longest
//! edge is the base, along `u` from its first corner; the apex is at `(foot, height)`, and `back` before the
//! other end, neither of them negative. Both are kept, as one of them may be much the shorter. The frame is orthonormal whatever the shape, so slivers, segments and single points
//! need no case of their own.

use cubecl::prelude::*;

use super::vector::{Vector3, add, choose, cross, direction, dot, load, norm, scale, sub};

/// Numbers of a frame in memory: origin, `u`, `v`, foot, back, height.
pub(super) const FRAME: usize = 12;

/// The corners of a triangle, as seen from some origin, and its edges. These are taken between the corners as
/// they stand in memory: a thin triangle would see the rounding of another origin.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Corners<F: Float> {
    pub a: Vector3<F>,
    pub b: Vector3<F>,
    pub c: Vector3<F>,
    ab: Vector3<F>,
    bc: Vector3<F>,
    ca: Vector3<F>,
}

/// A triangle in its own plane; see the head of this file.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Frame<F: Float> {
    pub origin: Vector3<F>,
    pub u: Vector3<F>,
    pub v: Vector3<F>,
    pub foot: F,
    pub back: F,
    pub height: F,
}

/// The point of a triangle that is closest to a query.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Closest<F: Float> {
    /// Weights of the corners a, b, c: not negative, their sum is 1.
    pub weights: Vector3<F>,
    /// From the closest point to the query.
    pub offset: Vector3<F>,
    /// Unit normal by the right-hand rule; zero where there is no area.
    pub normal: Vector3<F>,
}

/// The corners of a face, as seen from `origin`.
#[cube]
pub(super) fn corners<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    face: u32,
    origin: Vector3<F>,
) -> Corners<F> {
    let at = face as usize * 3;
    let a = load::<F>(vertices, faces[at]);
    let b = load::<F>(vertices, faces[at + 1]);
    let c = load::<F>(vertices, faces[at + 2]);
    Corners::<F> {
        a: sub::<F>(a, origin),
        b: sub::<F>(b, origin),
        c: sub::<F>(c, origin),
        ab: sub::<F>(b, a),
        bc: sub::<F>(c, b),
        ca: sub::<F>(a, c),
    }
}

/// Which corner the longest edge begins at: the first of equals.
#[cube]
fn first_corner<F: Float>(t: Corners<F>) -> u32 {
    let ab = dot::<F>(t.ab, t.ab);
    let bc = dot::<F>(t.bc, t.bc);
    let ca = dot::<F>(t.ca, t.ca);
    let first = select(bc > ab, 1u32, 0u32);
    select(ca > max(ab, bc), 2u32, first)
}

/// The corners from `first` on.
#[cube]
fn turned<F: Float>(t: Corners<F>, first: u32) -> Corners<F> {
    Corners::<F> {
        a: one_of::<F>(first, t.a, t.b, t.c),
        b: one_of::<F>(first, t.b, t.c, t.a),
        c: one_of::<F>(first, t.c, t.a, t.b),
        ab: one_of::<F>(first, t.ab, t.bc, t.ca),
        bc: one_of::<F>(first, t.bc, t.ca, t.ab),
        ca: one_of::<F>(first, t.ca, t.ab, t.bc),
    }
}

#[cube]
fn one_of<F: Float>(which: u32, a: Vector3<F>, b: Vector3<F>, c: Vector3<F>) -> Vector3<F> {
    choose::<F>(which == 0u32, a, choose::<F>(which == 1u32, b, c))
}

/// The frame of a triangle.
#[cube]
pub(super) fn frame<F: Float>(corners: Corners<F>) -> Frame<F> {
    frame_of_turned::<F>(turned::<F>(corners, first_corner::<F>(corners)))
}

/// The frame of a triangle whose longest edge runs from its first corner to its second.
#[cube]
fn frame_of_turned<F: Float>(t: Corners<F>) -> Frame<F> {
    let base = norm::<F>(t.ab);
    let along_x = Vector3::<F> {
        x: F::new(1.0),
        y: F::new(0.0),
        z: F::new(0.0),
    };
    let u = choose::<F>(base > F::new(0.0), direction::<F>(t.ab), along_x);
    // From the nearer end of the base, where a needle keeps its direction.
    let left = dot::<F>(t.ca, t.ca) <= dot::<F>(t.bc, t.bc);
    let to_apex = choose::<F>(left, scale::<F>(t.ca, F::new(-1.0)), t.bc);
    let run = dot::<F>(u, to_apex);
    let zero = F::new(0.0);
    let foot = max(select(left, run, base + run), zero);
    let back = max(select(left, base - run, -run), zero);
    let rest = sub::<F>(to_apex, scale::<F>(u, run));
    // Once more: what the first time leaves is a rounding error that a thin triangle would see. Where little
    // remains, the rest was nothing but that error: then any direction across `u`, and no height.
    let up = sub::<F>(rest, scale::<F>(u, dot::<F>(u, rest)));
    let length = norm::<F>(up);
    let has_area = length > F::new(0.5) * norm::<F>(rest);
    let along = direction::<F>(up);
    let straight = direction::<F>(sub::<F>(along, scale::<F>(u, dot::<F>(u, along))));
    let v = choose::<F>(has_area, straight, any_across::<F>(u));
    let height = select(has_area, length, F::new(0.0));
    Frame::<F> {
        origin: t.a,
        u,
        v,
        foot,
        back,
        height,
    }
}

/// A unit vector across the unit vector `u`.
#[cube]
fn any_across<F: Float>(u: Vector3<F>) -> Vector3<F> {
    let (x, y, z) = (F::abs(u.x), F::abs(u.y), F::abs(u.z));
    let along_x = x <= y && x <= z;
    let along_y = !along_x && y <= z;
    let axis = Vector3::<F> {
        x: select(along_x, F::new(1.0), F::new(0.0)),
        y: select(along_y, F::new(1.0), F::new(0.0)),
        z: select(along_x || along_y, F::new(0.0), F::new(1.0)),
    };
    direction::<F>(cross::<F>(u, axis))
}

/// Writes a frame as number `index` of `frames`.
#[cube]
pub(super) fn store_frame<F: Float>(frames: &mut Array<F>, index: usize, frame: Frame<F>) {
    let at = index * 12;
    frames[at] = frame.origin.x;
    frames[at + 1] = frame.origin.y;
    frames[at + 2] = frame.origin.z;
    frames[at + 3] = frame.u.x;
    frames[at + 4] = frame.u.y;
    frames[at + 5] = frame.u.z;
    frames[at + 6] = frame.v.x;
    frames[at + 7] = frame.v.y;
    frames[at + 8] = frame.v.z;
    frames[at + 9] = frame.foot;
    frames[at + 10] = frame.back;
    frames[at + 11] = frame.height;
}

#[cube]
pub(super) fn load_frame<F: Float>(frames: &Array<F>, index: u32) -> Frame<F> {
    let first = index * 4u32;
    let at = index as usize * 12;
    Frame::<F> {
        origin: load::<F>(frames, first),
        u: load::<F>(frames, first + 1u32),
        v: load::<F>(frames, first + 2u32),
        foot: frames[at + 9],
        back: frames[at + 10],
        height: frames[at + 11],
    }
}

/// A place in the plane of a frame, and which part of the triangle is closest to it.
#[derive(CubeType, Clone, Copy)]
struct Planar<F: Float> {
    /// Squared distance in the plane.
    squared: F,
    /// Whether the place is over the inside of the triangle.
    inside: bool,
    /// Whether the base is closest, or the side on the left of the apex, unless inside.
    on_base: bool,
    on_left: bool,
    /// How far along that edge, 0 to 1: of the base from the origin, of a side from its end of the base.
    along: F,
}

/// Angles at the base are not above 90°. So what is closest to a point above the base is on the side on its
/// side of the apex, or inside; and a point below is as far from the triangle as from the point over it on the
/// line of the base, and that way besides.
#[cube]
fn planar<F: Float>(frame: Frame<F>, x: F, y: F) -> Planar<F> {
    let zero = F::new(0.0);
    let above = max(y, zero);
    let below = y - above;
    let on_left = x < frame.foot;
    let base = frame.foot + frame.back;
    let run = select(on_left, frame.foot, frame.back);
    let way = select(on_left, x, base - x);
    let across = run * above - frame.height * way;
    let length_squared = run * run + frame.height * frame.height;
    let mut along = zero;
    if length_squared > zero {
        along = (way * run + above * frame.height) / length_squared;
        along = min(max(along, zero), F::new(1.0));
    }
    let beyond = way - along * run;
    let over = above - along * frame.height;
    let outside = select(across < zero, zero, beyond * beyond + over * over);
    let on_base = !(y > zero);
    if on_base {
        along = zero;
        if base > zero {
            along = min(max(x / base, zero), F::new(1.0));
        }
    }
    Planar::<F> {
        squared: below * below + outside,
        inside: across < zero && !on_base,
        on_base,
        on_left,
        along,
    }
}

/// Squared distance from `q`. Its error is a few `ε` times that distance and the one to the frame's origin.
#[cube]
pub(super) fn distance_squared<F: Float>(frame: Frame<F>, q: Vector3<F>) -> F {
    let p = sub::<F>(q, frame.origin);
    let z = dot::<F>(cross::<F>(frame.u, frame.v), p);
    let in_plane = planar::<F>(frame, dot::<F>(frame.u, p), dot::<F>(frame.v, p));
    z * z + in_plane.squared
}

/// The point of the triangle that is closest to `q`, in all seven regions (C. Ericson, *Real-Time Collision
/// Detection*, §5.1.5, in an orthonormal frame). The offset is taken from the nearest corner, where the least
/// is lost to cancellation.
#[cube]
pub(super) fn closest<F: Float>(corners: Corners<F>, q: Vector3<F>) -> Closest<F> {
    let first = first_corner::<F>(corners);
    let t = turned::<F>(corners, first);
    let frame = frame_of_turned::<F>(t);
    let p = sub::<F>(q, frame.origin);
    let (x, y) = (dot::<F>(frame.u, p), dot::<F>(frame.v, p));
    let place = planar::<F>(frame, x, y);
    let w = weights::<F>(frame, place, x, y);
    let normal = cross::<F>(frame.u, frame.v);

    let near_c = w.z > w.x && w.z > w.y;
    let near_b = !near_c && w.y > w.x;
    let corner = choose::<F>(near_c, t.c, choose::<F>(near_b, t.b, t.a));
    let from = sub::<F>(q, corner);
    let edge = choose::<F>(place.on_base, t.ab, choose::<F>(place.on_left, t.ca, t.bc));
    let unit = direction::<F>(edge);
    let on_edge = place.along > F::new(0.0) && place.along < F::new(1.0);
    let from_edge = sub::<F>(from, scale::<F>(unit, dot::<F>(unit, from)));
    let from_face = scale::<F>(normal, dot::<F>(normal, from));
    let outside = choose::<F>(on_edge, from_edge, from);
    let offset = choose::<F>(place.inside, from_face, outside);
    let area = select(frame.height > F::new(0.0), F::new(1.0), F::new(0.0));
    Closest::<F> {
        weights: turned_back::<F>(w, first),
        offset,
        normal: scale::<F>(normal, area),
    }
}

/// Weights of origin, end of the base, and apex.
#[cube]
fn weights<F: Float>(frame: Frame<F>, place: Planar<F>, x: F, y: F) -> Vector3<F> {
    let one = F::new(1.0);
    let zero = F::new(0.0);
    let rest = one - place.along;
    let mut a = rest;
    let mut b = place.along;
    let mut c = zero;
    if place.inside {
        c = min(y / frame.height, one);
        b = min(
            max((x - c * frame.foot) / (frame.foot + frame.back), zero),
            one - c,
        );
        a = one - b - c;
    } else {
        if !place.on_base {
            a = select(place.on_left, rest, zero);
            b = select(place.on_left, zero, rest);
            c = place.along;
        }
    }
    Vector3::<F> { x: a, y: b, z: c }
}

/// Weights of corners from `first` on, in the order of the face.
#[cube]
fn turned_back<F: Float>(w: Vector3<F>, first: u32) -> Vector3<F> {
    Vector3::<F> {
        x: select(first == 0u32, w.x, select(first == 1u32, w.z, w.y)),
        y: select(first == 0u32, w.y, select(first == 1u32, w.x, w.z)),
        z: select(first == 0u32, w.z, select(first == 1u32, w.y, w.x)),
    }
}

/// `Σ β_k y_k`, from the first corner.
#[cube]
pub(super) fn combine<F: Float>(t: Corners<F>, weights: Vector3<F>) -> Vector3<F> {
    let b = scale::<F>(t.ab, weights.y);
    let c = scale::<F>(t.ca, weights.z);
    add::<F>(t.a, sub::<F>(b, c))
}
