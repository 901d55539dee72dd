//! Eigenvalues and eigenvectors of a symmetric 3×3 matrix.

use crate::vector::{add, cross, dot, norm_squared, scale};

/// A symmetric matrix: `xx, xy, xz, yy, yz, zz`.
pub(crate) type Symmetric = [f64; 6];

/// Eigenvalues in ascending order, and a right-handed orthonormal basis of eigenvectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Eigen {
    pub values: [f64; 3],
    pub vectors: [[f64; 3]; 3],
}

/// Eigenvalues and eigenvectors of `a`, to a few units of rounding of its largest element. Where
/// eigenvalues are equal, or the matrix is zero or not finite, the basis is some orthonormal one: the
/// same every time. The values of a matrix that is not finite are 0.
///
/// The eigenvalue that stands apart from the other two is a root of the characteristic cubic, and the
/// other two are those of the 2×2 problem in the plane normal to its eigenvector, after D. Eberly, "A
/// Robust Eigensolver for 3×3 Symmetric Matrices" (2014). The root is by Newton's method instead of
/// `acos` and `cos`, so that the bits do not depend on the platform's mathematics library. There are
/// choices between values but no branches: a loop over several matrices becomes vector code.
#[inline(always)]
pub(crate) fn eigen(a: Symmetric) -> Eigen {
    let (mut largest, mut finite) = (0.0, true);
    for x in a {
        largest = choose(x.abs() > largest, x.abs(), largest);
        finite &= x.abs() <= f64::MAX;
    }
    let usable = finite & (largest > 0.0);
    let unit = choose(usable, largest, 1.0);
    let mut b = a.map(
        #[inline(always)]
        |x| choose(usable, x, 0.0) / unit,
    );
    let mean = (b[0] + b[3] + b[5]) / 3.0;
    for diagonal in [0, 3, 5] {
        b[diagonal] -= mean;
    }
    let square = b[0] * b[0] + b[3] * b[3] + b[5] * b[5];
    let spread = ((square + 2.0 * (b[1] * b[1] + b[2] * b[2] + b[4] * b[4])) / 6.0).sqrt();
    // The zero matrix goes all the way like any other.
    let inverse = choose(spread > 0.0, 1.0 / spread, 0.0);
    let mut found = eigen_normalized(b.map(
        #[inline(always)]
        |x| x * inverse,
    ));
    found.values = found.values.map(
        #[inline(always)]
        |x| (mean + spread * x) * unit,
    );
    found
}

/// `a` where the condition holds, else `b`; both are there already.
#[inline(always)]
fn choose(condition: bool, a: f64, b: f64) -> f64 {
    if condition { a } else { b }
}

/// [`choose`] for each component.
#[inline(always)]
fn choose_vector(condition: bool, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        choose(condition, a[0], b[0]),
        choose(condition, a[1], b[1]),
        choose(condition, a[2], b[2]),
    ]
}

/// The same for a matrix with trace 0 and `Σ λ² = 6`, or 0.
#[inline(always)]
fn eigen_normalized(b: Symmetric) -> Eigen {
    let half_determinant = 0.5 * determinant(b);
    let apart = eigenvalue_apart(half_determinant);
    let first = eigenvector_apart(b, apart);
    let ([low, high], [second, third]) = eigen_in_plane(b, first);
    // The one apart is the largest where the determinant is positive, else the smallest. Cyclic order
    // keeps the basis right-handed.
    let last = half_determinant >= 0.0;
    let (above, below) = (
        choose(apart > high, apart, high),
        choose(apart < low, apart, low),
    );
    Eigen {
        values: [
            choose(last, low, below),
            choose(last, high, low),
            choose(last, above, high),
        ],
        vectors: [
            choose_vector(last, second, first),
            choose_vector(last, third, second),
            choose_vector(last, first, third),
        ],
    }
}

#[inline(always)]
fn determinant([xx, xy, xz, yy, yz, zz]: Symmetric) -> f64 {
    xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
}

/// The root of `β³ − 3β − 2h = 0` of largest magnitude, which has the sign of `h` (`|h| ≤ 1`).
#[inline(always)]
fn eigenvalue_apart(h: f64) -> f64 {
    let height = choose(h.abs() < 1.0, h.abs(), 1.0);
    let root_of_three = 3f64.sqrt();
    // The chord from (0, √3) to (1, 2) is within 0.007 of the root; each step squares the error.
    let mut beta = root_of_three + (2.0 - root_of_three) * height;
    for _ in 0..4 {
        beta -= (beta * (beta * beta - 3.0) - 2.0 * height) / (3.0 * (beta * beta - 1.0));
    }
    beta.copysign(h)
}

/// Unit eigenvector of a normalized matrix for an eigenvalue at least √3 away from the other two:
/// `b − β` has rank 2, so at least one cross product of its rows is well away from 0.
#[inline(always)]
fn eigenvector_apart([xx, xy, xz, yy, yz, zz]: Symmetric, beta: f64) -> [f64; 3] {
    let rows = [
        [xx - beta, xy, xz],
        [xy, yy - beta, yz],
        [xz, yz, zz - beta],
    ];
    let products = [
        cross(rows[0], rows[1]),
        cross(rows[1], rows[2]),
        cross(rows[2], rows[0]),
    ];
    let mut best = products[0];
    for &other in &products[1..] {
        best = choose_vector(norm_squared(other) > norm_squared(best), other, best);
    }
    scale(best, 1.0 / norm_squared(best).sqrt())
}

/// Eigenvalues (ascending) and eigenvectors of `b` within the plane normal to `axis`, the two vectors
/// and `axis` being right-handed.
#[inline(always)]
fn eigen_in_plane(b: Symmetric, axis: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let u = perpendicular(axis);
    let v = cross(axis, u);
    let (bu, bv) = (product(b, u), product(b, v));
    let (uu, uv, vv) = (dot(u, bu), dot(u, bv), dot(v, bv));
    // One Jacobi rotation is exact: with t = tan of the angle, u − t v has the value uu − t uv, and
    // v + t u the value vv + t uv. The smaller |t| is the stable choice.
    let difference = vv - uu;
    let sum = difference.abs() + (difference * difference + 4.0 * uv * uv).sqrt();
    let t = choose(uv == 0.0, 0.0, 2.0 * uv / sum.copysign(difference));
    let c = 1.0 / (1.0 + t * t).sqrt();
    let s = t * c;
    let (p, q) = (
        add(scale(u, c), scale(v, -s)),
        add(scale(u, s), scale(v, c)),
    );
    let (p_value, q_value) = (uu - t * uv, vv + t * uv);
    let ordered = p_value <= q_value;
    let values = [
        choose(ordered, p_value, q_value),
        choose(ordered, q_value, p_value),
    ];
    let vectors = [
        choose_vector(ordered, p, q),
        choose_vector(ordered, q, scale(p, -1.0)),
    ];
    (values, vectors)
}

/// A unit vector at a right angle to the unit vector `a`.
#[inline(always)]
fn perpendicular(a: [f64; 3]) -> [f64; 3] {
    let first = a[0].abs() > a[1].abs();
    let b = choose_vector(first, [-a[2], 0.0, a[0]], [0.0, a[2], -a[1]]);
    scale(b, 1.0 / norm_squared(b).sqrt())
}

#[inline(always)]
fn product([xx, xy, xz, yy, yz, zz]: Symmetric, x: [f64; 3]) -> [f64; 3] {
    [
        dot([xx, xy, xz], x),
        dot([xy, yy, yz], x),
        dot([xz, yz, zz], x),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::tests::Random;

    /// Cyclic Jacobi, the slow and safe way: eigenvalues in ascending order.
    fn jacobi([xx, xy, xz, yy, yz, zz]: Symmetric) -> [f64; 3] {
        let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        for _ in 0..30 {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                if a[p][q] == 0.0 {
                    continue;
                }
                let angle = 0.5 * (2.0 * a[p][q]).atan2(a[q][q] - a[p][p]);
                let (s, c) = angle.sin_cos();
                for k in 0..3 {
                    (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
                }
                for k in 0..3 {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                }
            }
        }
        let mut values = [a[0][0], a[1][1], a[2][2]];
        values.sort_by(f64::total_cmp);
        values
    }

    /// `V diag(λ) Vᵀ` for a random rotation `V`.
    fn with_values(values: [f64; 3], random: &mut Random) -> Symmetric {
        let mut signed = || random.uniform() - 0.5;
        let x =
            crate::vector::normalized([signed(), signed(), signed()]).unwrap_or([1.0, 0.0, 0.0]);
        let y = perpendicular(x);
        let basis = [x, y, cross(x, y)];
        let element =
            |r: usize, c: usize| (0..3).map(|k| values[k] * basis[k][r] * basis[k][c]).sum();
        [
            element(0, 0),
            element(0, 1),
            element(0, 2),
            element(1, 1),
            element(1, 2),
            element(2, 2),
        ]
    }

    fn matrices() -> Vec<Symmetric> {
        let mut random = Random::new(11);
        let mut all: Vec<Symmetric> = vec![
            [0.0; 6],
            [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            [2.0, 0.0, 0.0, 1.0, 0.0, 3.0],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [1.0, 1e-9, 0.0, 1.0, 1e-9, 1.0],
            [f64::MIN_POSITIVE, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1e300, 1e299, -1e300, 1e298, 3e299, 7e299],
            [1e-300, 1e-299, -1e-300, 1e-298, 3e-299, 7e-299],
        ];
        let shapes = [
            [0.0, 1.0, 1.0],
            [0.0, 0.0, 1.0],
            [1e-12, 0.4, 1.0],
            [-3.0, 1.0, 2.0],
            [1.0, 1.0 + 1e-13, 1.0 + 2e-13],
            [0.5, 0.5 + 1e-8, 1.0],
            [0.5, 1.0 - 1e-8, 1.0],
            [-1.0, 0.0, 1.0],
            [-2.0, -1.0, -1.0],
            [1e-8, 1e-4, 1.0],
        ];
        for shape in shapes {
            for _ in 0..200 {
                all.push(with_values(shape, &mut random));
            }
        }
        for _ in 0..2000 {
            all.push([0; 6].map(|_| random.uniform() - 0.5));
        }
        all
    }

    #[test]
    fn eigenvalues_agree_with_jacobi_and_vectors_satisfy_their_equation() {
        for a in matrices() {
            let found = eigen(a);
            let size = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            // A few dozen roundings of numbers up to the size of the matrix.
            let tolerance = 1e-14 * size;
            let expected = jacobi(a);
            for k in 0..3 {
                let (value, vector) = (found.values[k], found.vectors[k]);
                assert!(
                    (value - expected[k]).abs() <= tolerance,
                    "{a:?}: {found:?}, not {expected:?}"
                );
                let image = product(a, vector);
                for c in 0..3 {
                    assert!(
                        (image[c] - value * vector[c]).abs() <= tolerance,
                        "{a:?}: {found:?}"
                    );
                }
            }
            assert!(found.values.is_sorted(), "{a:?}: {found:?}");
        }
    }

    #[test]
    fn vectors_are_orthonormal_and_right_handed() {
        let bad = [[f64::NAN; 6], [f64::INFINITY; 6], [f64::MAX; 6]];
        for a in matrices().into_iter().chain(bad) {
            let [x, y, z] = eigen(a).vectors;
            for (p, q, expected) in [
                (x, x, 1.0),
                (y, y, 1.0),
                (z, z, 1.0),
                (x, y, 0.0),
                (y, z, 0.0),
                (z, x, 0.0),
            ] {
                assert!(
                    (dot(p, q) - expected).abs() < 1e-14,
                    "{a:?}: {x:?} {y:?} {z:?}"
                );
            }
            assert!(
                (dot(cross(x, y), z) - 1.0).abs() < 1e-14,
                "{a:?}: {x:?} {y:?} {z:?}"
            );
        }
    }
}
