//! Eigenvalues against cyclic Jacobi rotations.

use super::*;
use crate::vector::{cross, dot, normalized};

/// Pseudorandom numbers with a fixed seed (SplitMix64).
struct Random(u64);

impl Random {
    /// In 0..1.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Eigenvalues and eigenvectors.
fn arrays(a: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    let found = eigen(a.into());
    let vectors = [found.first, found.second, found.third];
    (found.values.into(), vectors.map(Into::into))
}

/// Cyclic Jacobi, the slow and safe way: eigenvalues in ascending order.
fn jacobi([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> [f64; 3] {
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
fn with_values(values: [f64; 3], random: &mut Random) -> [f64; 6] {
    let mut signed = || random.uniform() - 0.5;
    let x = normalized([signed(), signed(), signed()]).unwrap_or([1.0, 0.0, 0.0]);
    let y = normalized(cross(x, [0.3, -0.5, 0.8])).unwrap_or([0.0, 1.0, 0.0]);
    let basis = [x, y, cross(x, y)];
    let element = |r: usize, c: usize| (0..3).map(|k| values[k] * basis[k][r] * basis[k][c]).sum();
    [
        element(0, 0),
        element(0, 1),
        element(0, 2),
        element(1, 1),
        element(1, 2),
        element(2, 2),
    ]
}

fn matrices() -> Vec<[f64; 6]> {
    let mut random = Random(11);
    let mut all: Vec<[f64; 6]> = vec![
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
        let found = arrays(a);
        let size = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // A few dozen roundings of numbers up to the size of the matrix.
        let tolerance = 1e-14 * size;
        let expected = jacobi(a);
        for k in 0..3 {
            let (value, vector) = (found.0[k], found.1[k]);
            assert!(
                (value - expected[k]).abs() <= tolerance,
                "{a:?}: {found:?}, not {expected:?}"
            );
            let image = <[f64; 3]>::from(product(
                a.into(),
                Vector3::of(vector[0], vector[1], vector[2]),
            ));
            for c in 0..3 {
                assert!(
                    (image[c] - value * vector[c]).abs() <= tolerance,
                    "{a:?}: {found:?}"
                );
            }
        }
        assert!(found.0.is_sorted(), "{a:?}: {found:?}");
    }
}

#[test]
fn vectors_are_orthonormal_and_right_handed() {
    let bad = [[f64::NAN; 6], [f64::INFINITY; 6], [f64::MAX; 6]];
    for a in matrices().into_iter().chain(bad) {
        let [x, y, z] = arrays(a).1;
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
