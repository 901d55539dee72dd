//! One point and one triangle, in kernels.
//!
//! As on the CPU (`isograd::distance::triangle`) a triangle is described in its own plane frame: the longest
//! edge is the base, along `u` from its first corner; the apex is at `(foot, height)`, and `back` before the
//! other end, neither of them negative. Both are kept, as one of them may be much the shorter. The frame is orthonormal whatever the shape, so slivers, segments and single points
//! need no case of their own.

use cubecl::prelude::*;

use super::MeshArrays;
use crate::vector::Vector3;

/// Numbers of a frame in memory: origin, `u`, `v`, foot, back, height.
pub(super) const FRAME: usize = 12;

/// The corners of a triangle, as seen from some origin, and its edges. These are taken between the corners as
/// they stand in memory: a thin triangle would see the rounding of another origin.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Corners<F: Float> {
    pub a: Vector3<F>,
    pub b: Vector3<F>,
    pub c: Vector3<F>,
    pub ab: Vector3<F>,
    pub bc: Vector3<F>,
    pub ca: Vector3<F>,
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

/// The number of the face among the features of a triangle, after those of its corners a, b, c and of the edges
/// from each to the next.
pub(super) const FACE_ITSELF: u32 = 6;

/// The point of a triangle that is closest to a query.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Closest<F: Float> {
    /// Weights of the corners a, b, c: not negative, their sum is 1.
    pub weights: Vector3<F>,
    /// From the closest point to the query.
    pub offset: Vector3<F>,
    /// Unit normal by the right-hand rule; zero where there is no area.
    pub normal: Vector3<F>,
    /// Number of the feature that it lies on; see [`FACE_ITSELF`].
    pub feature: u32,
}

/// The corners of a face, as seen from `origin`.
#[cube]
pub(super) fn corners<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    face: u32,
    origin: Vector3<F>,
) -> Corners<F> {
    let at = face as usize * 3;
    let a = Vector3::<F>::at(&mesh.vertices, mesh.faces[at] as usize);
    let b = Vector3::<F>::at(&mesh.vertices, mesh.faces[at + 1] as usize);
    let c = Vector3::<F>::at(&mesh.vertices, mesh.faces[at + 2] as usize);
    Corners::<F> {
        a: a.sub(origin),
        b: b.sub(origin),
        c: c.sub(origin),
        ab: b.sub(a),
        bc: c.sub(b),
        ca: a.sub(c),
    }
}

/// Which corner the longest edge begins at: the first of equals.
#[cube]
pub(super) fn first_corner<F: Float>(t: Corners<F>) -> u32 {
    let ab = t.ab.dot(t.ab);
    let bc = t.bc.dot(t.bc);
    let ca = t.ca.dot(t.ca);
    let first = select(bc > ab, 1u32, 0u32);
    select(ca > max(ab, bc), 2u32, first)
}

/// The corners from `first` on.
#[cube]
pub(super) fn turned<F: Float>(t: Corners<F>, first: u32) -> Corners<F> {
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
    a.choose(which == 0u32, b.choose(which == 1u32, c))
}

/// The frame of a triangle.
#[cube]
pub(super) fn frame<F: Float>(corners: Corners<F>) -> Frame<F> {
    frame_of_turned::<F>(turned::<F>(corners, first_corner::<F>(corners)))
}

/// The frame of a triangle whose longest edge runs from its first corner to its second.
#[cube]
fn frame_of_turned<F: Float>(t: Corners<F>) -> Frame<F> {
    let base = t.ab.norm();
    let along_x = Vector3::<F>::of(F::new(1.0), F::new(0.0), F::new(0.0));
    let u = t.ab.direction().choose(base > F::new(0.0), along_x);
    // From the nearer end of the base, where a needle keeps its direction.
    let left = t.ca.dot(t.ca) <= t.bc.dot(t.bc);
    let to_apex = t.ca.scale(F::new(-1.0)).choose(left, t.bc);
    let run = u.dot(to_apex);
    let zero = F::new(0.0);
    let foot = max(select(left, run, base + run), zero);
    let back = max(select(left, base - run, -run), zero);
    let rest = to_apex.sub(u.scale(run));
    // Once more: what the first time leaves is a rounding error that a thin triangle would see. Where little
    // remains, the rest was nothing but that error: then any direction across `u`, and no height.
    let up = rest.sub(u.scale(u.dot(rest)));
    let length = up.norm();
    let has_area = length > F::new(0.5) * rest.norm();
    let along = up.direction();
    let straight = along.sub(u.scale(u.dot(along))).direction();
    let v = straight.choose(has_area, any_across::<F>(u));
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
    u.cross(axis).direction()
}

/// Writes a frame as number `index` of `frames`.
#[cube]
pub(super) fn store_frame<F: Float>(frames: &mut Array<F>, index: usize, frame: Frame<F>) {
    frame.origin.write(frames, 4 * index);
    frame.u.write(frames, 4 * index + 1);
    frame.v.write(frames, 4 * index + 2);
    let rest = Vector3::<F>::of(frame.foot, frame.back, frame.height);
    rest.write(frames, 4 * index + 3);
}

#[cube]
pub(super) fn load_frame<F: Float>(frames: &Array<F>, index: u32) -> Frame<F> {
    let first = index * 4u32;
    let at = index as usize * 12;
    Frame::<F> {
        origin: Vector3::<F>::at(frames, first as usize),
        u: Vector3::<F>::at(frames, (first + 1u32) as usize),
        v: Vector3::<F>::at(frames, (first + 2u32) as usize),
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
    let p = q.sub(frame.origin);
    let z = frame.u.cross(frame.v).dot(p);
    let in_plane = planar::<F>(frame, frame.u.dot(p), frame.v.dot(p));
    z * z + in_plane.squared
}

/// The point of the triangle that is closest to `q`, as exact as the frame.
#[cube]
pub(super) fn foot<F: Float>(frame: Frame<F>, q: Vector3<F>) -> Vector3<F> {
    let p = q.sub(frame.origin);
    let (x, y) = (frame.u.dot(p), frame.v.dot(p));
    let w = weights::<F>(frame, planar::<F>(frame, x, y), x, y);
    let along = w.y * (frame.foot + frame.back) + w.z * frame.foot;
    frame
        .origin
        .add(frame.u.scale(along))
        .add(frame.v.scale(w.z * frame.height))
}

/// The point of the triangle that is closest to `q`, in all seven regions (C. Ericson, *Real-Time Collision
/// Detection*, §5.1.5, in an orthonormal frame). The offset is taken from the nearest corner, where the least
/// is lost to cancellation.
#[cube]
pub(super) fn closest<F: Float>(corners: Corners<F>, q: Vector3<F>) -> Closest<F> {
    let first = first_corner::<F>(corners);
    let t = turned::<F>(corners, first);
    let frame = frame_of_turned::<F>(t);
    let p = q.sub(frame.origin);
    let (x, y) = (frame.u.dot(p), frame.v.dot(p));
    let place = planar::<F>(frame, x, y);
    let w = weights::<F>(frame, place, x, y);
    let normal = frame.u.cross(frame.v);

    let near_c = w.z > w.x && w.z > w.y;
    let near_b = !near_c && w.y > w.x;
    let corner = t.c.choose(near_c, t.b.choose(near_b, t.a));
    let from = q.sub(corner);
    let edge = t.ab.choose(place.on_base, t.ca.choose(place.on_left, t.bc));
    let unit = edge.direction();
    let on_edge = place.along > F::new(0.0) && place.along < F::new(1.0);
    let from_edge = from.sub(unit.scale(unit.dot(from)));
    let from_face = normal.scale(normal.dot(from));
    let outside = from_edge.choose(on_edge, from);
    let offset = from_face.choose(place.inside, outside);
    let area = select(frame.height > F::new(0.0), F::new(1.0), F::new(0.0));
    let side = select(place.on_base, 0u32, select(place.on_left, 2u32, 1u32));
    let tip = select(near_c, 2u32, select(near_b, 1u32, 0u32));
    let outline = select(on_edge, 3u32 + (side + first) % 3u32, (tip + first) % 3u32);
    Closest::<F> {
        weights: turned_back::<F>(w, first),
        offset,
        normal: normal.scale(area),
        feature: select(place.inside, FACE_ITSELF, outline),
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
pub(super) fn turned_back<F: Float>(w: Vector3<F>, first: u32) -> Vector3<F> {
    Vector3::<F> {
        x: select(first == 0u32, w.x, select(first == 1u32, w.z, w.y)),
        y: select(first == 0u32, w.y, select(first == 1u32, w.x, w.z)),
        z: select(first == 0u32, w.z, select(first == 1u32, w.y, w.x)),
    }
}
