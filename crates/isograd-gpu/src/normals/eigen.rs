//! Eigenvalues and eigenvectors of a symmetric 3×3 matrix: the method of `isograd`'s `normals/eigen.rs`, in
//! the number type of the kernel. The eigenvalue that stands apart from the other two is a root of the
//! characteristic cubic, by Newton's method, and the other two are those of the 2×2 problem in the plane normal
//! to its eigenvector, after D. Eberly, "A Robust Eigensolver for 3×3 Symmetric Matrices" (2014).
//!
//! No quotient here has a divisor that can be 0: what a kernel makes of infinities is not defined everywhere.

use cubecl::prelude::*;

use crate::vector::Vector3;

/// A symmetric matrix.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Symmetric<F: Float> {
    pub xx: F,
    pub xy: F,
    pub xz: F,
    pub yy: F,
    pub yz: F,
    pub zz: F,
}

/// Eigenvalues in ascending order, and a right-handed orthonormal basis of eigenvectors.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Eigen<F: Float> {
    pub values: Vector3<F>,
    pub first: Vector3<F>,
    pub second: Vector3<F>,
    pub third: Vector3<F>,
}

/// What two eigenvectors in a plane are.
#[derive(CubeType, Clone, Copy)]
struct InPlane<F: Float> {
    low: F,
    high: F,
    of_low: Vector3<F>,
    of_high: Vector3<F>,
}

/// Eigenvalues and eigenvectors, to a few units of rounding of the largest element. Where eigenvalues are equal
/// the basis is some orthonormal one, the same every time.
#[cube]
pub(crate) fn eigen<F: Float>(a: Symmetric<F>) -> Eigen<F> {
    let on = larger::<F>(larger::<F>(a.xx.abs(), a.yy.abs()), a.zz.abs());
    let off = larger::<F>(larger::<F>(a.xy.abs(), a.xz.abs()), a.yz.abs());
    let largest = larger::<F>(on, off);
    let unit = select(largest > F::new(0.0), largest, F::new(1.0));
    let mean = (a.xx / unit + a.yy / unit + a.zz / unit) / F::new(3.0);
    let xx = a.xx / unit - mean;
    let yy = a.yy / unit - mean;
    let zz = a.zz / unit - mean;
    let xy = a.xy / unit;
    let xz = a.xz / unit;
    let yz = a.yz / unit;
    let square = xx * xx + yy * yy + zz * zz;
    let spread = F::sqrt((square + F::new(2.0) * (xy * xy + xz * xz + yz * yz)) / F::new(6.0));
    let spreads = spread > F::new(0.0);
    let divisor = select(spreads, spread, F::new(1.0));
    let inverse = select(spreads, F::new(1.0) / divisor, F::new(0.0));
    let found = eigen_normalized::<F>(Symmetric::<F> {
        xx: xx * inverse,
        xy: xy * inverse,
        xz: xz * inverse,
        yy: yy * inverse,
        yz: yz * inverse,
        zz: zz * inverse,
    });
    let values = Vector3::<F> {
        x: (mean + spread * found.values.x) * unit,
        y: (mean + spread * found.values.y) * unit,
        z: (mean + spread * found.values.z) * unit,
    };
    Eigen::<F> {
        values,
        first: found.first,
        second: found.second,
        third: found.third,
    }
}

#[cube]
fn larger<F: Float>(a: F, b: F) -> F {
    select(a > b, a, b)
}

/// `x` with the sign of `sign`, +1 for 0.
#[cube]
fn with_sign<F: Float>(x: F, sign: F) -> F {
    select(sign < F::new(0.0), -x, x)
}

/// The same for a matrix with trace 0 and `Σ λ² = 6`, or 0.
#[cube]
fn eigen_normalized<F: Float>(b: Symmetric<F>) -> Eigen<F> {
    let half_determinant = F::new(0.5)
        * (b.xx * (b.yy * b.zz - b.yz * b.yz) - b.xy * (b.xy * b.zz - b.yz * b.xz)
            + b.xz * (b.xy * b.yz - b.yy * b.xz));
    let apart = eigenvalue_apart::<F>(half_determinant);
    let own = eigenvector_apart::<F>(b, apart);
    let others = eigen_in_plane::<F>(b, own);
    // The one apart is the largest where the determinant is positive, else the smallest. Cyclic order keeps the
    // basis right-handed.
    let last = half_determinant >= F::new(0.0);
    let above = select(apart > others.high, apart, others.high);
    let below = select(apart < others.low, apart, others.low);
    let values = Vector3::<F> {
        x: select(last, others.low, below),
        y: select(last, others.high, others.low),
        z: select(last, above, others.high),
    };
    Eigen::<F> {
        values,
        first: others.of_low.choose(last, own),
        second: others.of_high.choose(last, others.of_low),
        third: own.choose(last, others.of_high),
    }
}

/// The root of `β³ − 3β − 2h = 0` of largest magnitude, which has the sign of `h` (`|h| ≤ 1`).
#[cube]
fn eigenvalue_apart<F: Float>(h: F) -> F {
    let height = select(h.abs() < F::new(1.0), h.abs(), F::new(1.0));
    // The chord from (0, √3) to (1, 2) is within 0.007 of the root; each step squares the error.
    // √3 is written out: WGSL takes no root of a constant in double precision.
    let mut beta = F::new(1.732_050_8) + F::new(0.267_949_2) * height;
    #[unroll]
    for _ in 0..4 {
        beta -= (beta * (beta * beta - F::new(3.0)) - F::new(2.0) * height)
            / (F::new(3.0) * (beta * beta - F::new(1.0)));
    }
    with_sign::<F>(beta, h)
}

/// Unit eigenvector of a normalized matrix for an eigenvalue at least √3 away from the other two: `b − β` has
/// rank 2, so at least one cross product of its rows is well away from 0.
#[cube]
fn eigenvector_apart<F: Float>(b: Symmetric<F>, beta: F) -> Vector3<F> {
    let first = Vector3::<F> {
        x: b.xx - beta,
        y: b.xy,
        z: b.xz,
    };
    let second = Vector3::<F> {
        x: b.xy,
        y: b.yy - beta,
        z: b.yz,
    };
    let third = Vector3::<F> {
        x: b.xz,
        y: b.yz,
        z: b.zz - beta,
    };
    let p = first.cross(second);
    let q = second.cross(third);
    let r = third.cross(first);
    let pq = q.choose(q.dot(q) > p.dot(p), p);
    let best = r.choose(r.dot(r) > pq.dot(pq), pq);
    best.scale(F::new(1.0) / F::sqrt(best.dot(best)))
}

/// Eigenvalues (ascending) and eigenvectors of `b` within the plane normal to `axis`, the two vectors and
/// `axis` being right-handed.
#[cube]
fn eigen_in_plane<F: Float>(b: Symmetric<F>, axis: Vector3<F>) -> InPlane<F> {
    let u = perpendicular::<F>(axis);
    let v = axis.cross(u);
    let bu = product::<F>(b, u);
    let bv = product::<F>(b, v);
    let uu = u.dot(bu);
    let uv = u.dot(bv);
    let vv = v.dot(bv);
    // One Jacobi rotation is exact: with t = tan of the angle, u − t v has the value uu − t uv, and v + t u the
    // value vv + t uv. The smaller |t| is the stable choice.
    let difference = vv - uu;
    let sum = difference.abs() + F::sqrt(difference * difference + F::new(4.0) * uv * uv);
    // Squares of the smallest numbers vanish.
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
    InPlane::<F> {
        low: select(ordered, p_value, q_value),
        high: select(ordered, q_value, p_value),
        of_low: p.choose(ordered, q),
        of_high: q.choose(ordered, p.scale(F::new(-1.0))),
    }
}

/// A unit vector at a right angle to the unit vector `a`.
#[cube]
fn perpendicular<F: Float>(a: Vector3<F>) -> Vector3<F> {
    let first = a.x.abs() > a.y.abs();
    let zero = F::new(0.0);
    let b = Vector3::<F> {
        x: select(first, -a.z, zero),
        y: select(first, zero, a.z),
        z: select(first, a.x, -a.y),
    };
    b.scale(F::new(1.0) / F::sqrt(b.dot(b)))
}

#[cube]
fn product<F: Float>(b: Symmetric<F>, x: Vector3<F>) -> Vector3<F> {
    Vector3::<F> {
        x: b.xx * x.x + b.xy * x.y + b.xz * x.z,
        y: b.xy * x.x + b.yy * x.y + b.yz * x.z,
        z: b.xz * x.x + b.yz * x.y + b.zz * x.z,
    }
}
