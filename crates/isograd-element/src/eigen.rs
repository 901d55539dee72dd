//! Eigenvalues and eigenvectors of a symmetric 3×3 matrix.
//!
//! The eigenvalue that stands apart from the other two is a root of the characteristic cubic. The other two are those
//! of the 2×2 problem in the plane normal to its eigenvector, after D. Eberly, "A Robust Eigensolver for 3×3 Symmetric
//! Matrices" (2014). The root is found by Newton's method instead of `acos` and `cos`, so that the bits do not depend
//! on the platform's mathematics library.
//!
//! There are choices between values but no branches: a loop over several matrices becomes vector code. No divisor is
//! ever 0: infinities are not defined in kernels on every device.
#![allow(
    clippy::eq_op,
    reason = "x - x is 0 only if x is finite; kernels know no other test"
)]

#[cfg(cube)]
use cubecl::prelude::*;

use super::vector3::Vector3;
use super::{Element, root_of_three, select, with_sign};

/// A symmetric matrix.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Symmetric<F: Element> {
    pub xx: F,
    pub xy: F,
    pub xz: F,
    pub yy: F,
    pub yz: F,
    pub zz: F,
}

/// Eigenvalues in ascending order, and a right-handed orthonormal basis of eigenvectors.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen<F: Element> {
    /// The eigenvalues.
    pub values: Vector3<F>,
    /// Eigenvector of the smallest eigenvalue.
    pub first: Vector3<F>,
    /// Eigenvector of the middle eigenvalue.
    pub second: Vector3<F>,
    /// Eigenvector of the largest eigenvalue.
    pub third: Vector3<F>,
}

/// Eigenvalues (ascending) and eigenvectors within a plane.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy)]
struct EigenInPlane<F: Element> {
    low: F,
    high: F,
    of_low: Vector3<F>,
    of_high: Vector3<F>,
}

#[cfg(not(cube))]
impl<F: Element> From<[F; 6]> for Symmetric<F> {
    #[inline(always)]
    fn from([xx, xy, xz, yy, yz, zz]: [F; 6]) -> Self {
        Self {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        }
    }
}

/// Eigenvalues and eigenvectors of `a`, to a few units of rounding of its largest element. Where eigenvalues are
/// equal, or the matrix is zero or not finite, the basis is some orthonormal one, the same every time. The
/// eigenvalues of a matrix that is not finite are 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn eigen<F: Element>(a: Symmetric<F>) -> Eigen<F> {
    let on = larger::<F>(larger::<F>(a.xx.abs(), a.yy.abs()), a.zz.abs());
    let off = larger::<F>(larger::<F>(a.xy.abs(), a.xz.abs()), a.yz.abs());
    // 0 unless an element is not finite.
    let infinite = (a.xx - a.xx) + (a.yy - a.yy) + (a.zz - a.zz);
    let infinite = infinite + (a.xy - a.xy) + (a.xz - a.xz) + (a.yz - a.yz);
    let largest = select(infinite == F::new(0.0), larger::<F>(on, off), F::new(0.0));
    let usable = largest > F::new(0.0);
    let unit = select(usable, largest, F::new(1.0));
    let b = Symmetric::<F> {
        xx: select(usable, a.xx, F::new(0.0)) / unit,
        xy: select(usable, a.xy, F::new(0.0)) / unit,
        xz: select(usable, a.xz, F::new(0.0)) / unit,
        yy: select(usable, a.yy, F::new(0.0)) / unit,
        yz: select(usable, a.yz, F::new(0.0)) / unit,
        zz: select(usable, a.zz, F::new(0.0)) / unit,
    };
    let mean = (b.xx + b.yy + b.zz) / F::new(3.0);
    let xx = b.xx - mean;
    let yy = b.yy - mean;
    let zz = b.zz - mean;
    let square = xx * xx + yy * yy + zz * zz;
    let mixed = b.xy * b.xy + b.xz * b.xz + b.yz * b.yz;
    let spread = F::sqrt((square + F::new(2.0) * mixed) / F::new(6.0));
    // The zero matrix goes all the way like any other.
    let spreads = spread > F::new(0.0);
    let inverse = select(
        spreads,
        F::new(1.0) / select(spreads, spread, F::new(1.0)),
        F::new(0.0),
    );
    let normalized = eigen_normalized::<F>(Symmetric::<F> {
        xx: xx * inverse,
        xy: b.xy * inverse,
        xz: b.xz * inverse,
        yy: yy * inverse,
        yz: b.yz * inverse,
        zz: zz * inverse,
    });
    Eigen::<F> {
        values: Vector3::<F> {
            x: (mean + spread * normalized.values.x) * unit,
            y: (mean + spread * normalized.values.y) * unit,
            z: (mean + spread * normalized.values.z) * unit,
        },
        first: normalized.first,
        second: normalized.second,
        third: normalized.third,
    }
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn larger<F: Element>(a: F, b: F) -> F {
    select(a > b, a, b)
}

/// Eigenvalues and eigenvectors of a matrix with trace 0 and `Σ λ² = 6`, or of the zero matrix.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn eigen_normalized<F: Element>(b: Symmetric<F>) -> Eigen<F> {
    let half_determinant = F::new(0.5) * determinant::<F>(b);
    let apart = eigenvalue_apart::<F>(half_determinant);
    let axis = eigenvector_apart::<F>(b, apart);
    let plane = eigen_in_plane::<F>(b, axis);
    // The one apart is the largest where the determinant is positive, else the smallest. Cyclic order keeps the
    // basis right-handed.
    let last = half_determinant >= F::new(0.0);
    let above = select(apart > plane.high, apart, plane.high);
    let below = select(apart < plane.low, apart, plane.low);
    Eigen::<F> {
        values: Vector3::<F> {
            x: select(last, plane.low, below),
            y: select(last, plane.high, plane.low),
            z: select(last, above, plane.high),
        },
        first: plane.of_low.choose(last, axis),
        second: plane.of_high.choose(last, plane.of_low),
        third: axis.choose(last, plane.of_high),
    }
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn determinant<F: Element>(b: Symmetric<F>) -> F {
    b.xx * (b.yy * b.zz - b.yz * b.yz) - b.xy * (b.xy * b.zz - b.yz * b.xz)
        + b.xz * (b.xy * b.yz - b.yy * b.xz)
}

/// The root of `β³ − 3β − 2h = 0` of largest magnitude, which has the sign of `h` (`|h| ≤ 1`).
#[cfg_attr(cube, cube)]
#[inline(always)]
fn eigenvalue_apart<F: Element>(h: F) -> F {
    let height = select(h.abs() < F::new(1.0), h.abs(), F::new(1.0));
    // The chord from (0, √3) to (1, 2) is within 0.007 of the root; each step squares the error.
    let root = root_of_three::<F>();
    let start = root + (F::new(2.0) - root) * height;
    let once = newton_step::<F>(start, height);
    let twice = newton_step::<F>(once, height);
    let thrice = newton_step::<F>(twice, height);
    with_sign::<F>(newton_step::<F>(thrice, height), h)
}

/// A step of Newton's method for `β³ − 3β − 2h = 0`.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn newton_step<F: Element>(beta: F, h: F) -> F {
    let square = beta * beta;
    beta - (beta * (square - F::new(3.0)) - F::new(2.0) * h)
        / (F::new(3.0) * (square - F::new(1.0)))
}

/// Unit eigenvector of a normalized matrix for an eigenvalue at least √3 away from the other two: `b − β` has rank 2,
/// so at least one cross product of its rows is well away from 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn eigenvector_apart<F: Element>(b: Symmetric<F>, beta: F) -> Vector3<F> {
    let first = Vector3::<F>::of(b.xx - beta, b.xy, b.xz);
    let second = Vector3::<F>::of(b.xy, b.yy - beta, b.yz);
    let third = Vector3::<F>::of(b.xz, b.yz, b.zz - beta);
    let p = first.cross(second);
    let q = second.cross(third);
    let r = third.cross(first);
    let pq = q.choose(q.dot(q) > p.dot(p), p);
    let best = r.choose(r.dot(r) > pq.dot(pq), pq);
    best.scale(F::new(1.0) / F::sqrt(best.dot(best)))
}

/// Eigenvalues and eigenvectors of `b` within the plane normal to `axis`, the two vectors and `axis` being
/// right-handed.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn eigen_in_plane<F: Element>(b: Symmetric<F>, axis: Vector3<F>) -> EigenInPlane<F> {
    let u = perpendicular::<F>(axis);
    let v = axis.cross(u);
    let bu = product::<F>(b, u);
    let bv = product::<F>(b, v);
    let uu = u.dot(bu);
    let uv = u.dot(bv);
    let vv = v.dot(bv);
    // One Jacobi rotation is exact: with t = tan of the angle, u − t v has the value uu − t uv, and v + t u the value
    // vv + t uv. The smaller |t| is the stable choice.
    let difference = vv - uu;
    let root = F::sqrt(difference * difference + F::new(4.0) * uv * uv);
    let sum = select(uv == F::new(0.0), F::new(0.0), difference.abs() + root);
    // The squares of tiny numbers underflow.
    let turns = sum > F::new(0.0);
    let divisor = with_sign::<F>(select(turns, sum, F::new(1.0)), difference);
    let t = select(turns, F::new(2.0) * uv / divisor, F::new(0.0));
    let c = F::new(1.0) / F::sqrt(F::new(1.0) + t * t);
    let s = t * c;
    let p = u.scale(c).sub(v.scale(s));
    let q = u.scale(s).add(v.scale(c));
    let p_value = uu - t * uv;
    let q_value = vv + t * uv;
    let ordered = p_value <= q_value;
    EigenInPlane::<F> {
        low: select(ordered, p_value, q_value),
        high: select(ordered, q_value, p_value),
        of_low: p.choose(ordered, q),
        of_high: q.choose(ordered, p.scale(F::new(-1.0))),
    }
}

/// A unit vector at a right angle to the unit vector `a`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn perpendicular<F: Element>(a: Vector3<F>) -> Vector3<F> {
    let zero = F::new(0.0);
    let of_xz = Vector3::<F>::of(-a.z, zero, a.x);
    let of_yz = Vector3::<F>::of(zero, a.z, -a.y);
    let b = of_xz.choose(a.x.abs() > a.y.abs(), of_yz);
    b.scale(F::new(1.0) / F::sqrt(b.dot(b)))
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn product<F: Element>(b: Symmetric<F>, x: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: b.xx * x.x + b.xy * x.y + b.xz * x.z,
        y: b.xy * x.x + b.yy * x.y + b.yz * x.z,
        z: b.xz * x.x + b.yz * x.y + b.zz * x.z,
    }
}

#[cfg(all(test, not(cube)))]
mod tests;
