//! Helpers of the tests of all rooms.

use crate::neighbors::tests::Random;
use crate::splat::SampleCotangent;
use crate::vector;

/// Bound of the relative difference between a pullback and a central difference, see [`assert_adjoint`].
const TOLERANCE: f64 = 1e-6;

/// Checks that `run` gives the same bits on 1, 2 and 5 threads.
pub(crate) fn assert_same_bits<R: PartialEq + Send>(run: impl Fn() -> R + Sync) {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(&run)
    };
    let one = on(1);
    for threads in [2, 5] {
        assert!(on(threads) == one, "{threads} threads");
    }
}

/// Checks `⟨Jv, w⟩ = ⟨v, Jᵀw⟩`: compares `pulled`, the right side, with the central difference of `loss(s) = ⟨f(s), w⟩`,
/// where `f(s)` is the map with its inputs moved by `s v`.
pub(crate) fn assert_adjoint(what: &str, pulled: f64, step: f64, loss: impl Fn(f64) -> f64) {
    let difference = (loss(step) - loss(-step)) / (2.0 * step);
    let error = (pulled - difference).abs() / pulled.abs().max(difference.abs());
    assert!(
        error < TOLERANCE,
        "{what}: {pulled}, not {difference} ({error:e})"
    );
}

/// The quadratic B-spline.
pub(crate) fn bspline(x: f64) -> f64 {
    match x.abs() {
        x if x < 0.5 => 0.75 - x * x,
        x if x < 1.5 => 0.5 * (1.5 - x).powi(2),
        _ => 0.0,
    }
}

/// Stream of numbers in [−1, 1) from a seed.
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// `n` numbers between −1 and 1.
pub(crate) fn numbers(n: usize, random: &mut Random) -> Vec<f64> {
    (0..n).map(|_| 2.0 * random.uniform() - 1.0).collect()
}

/// `n` vectors with components between −1 and 1.
pub(crate) fn vectors(n: usize, random: &mut Random) -> Vec<[f64; 3]> {
    (0..n)
        .map(|_| [0; 3].map(|_| 2.0 * random.uniform() - 1.0))
        .collect()
}

/// Vectors moved along others.
pub(crate) fn moved(vectors: &[[f64; 3]], v: &[[f64; 3]], step: f64) -> Vec<[f64; 3]> {
    let pairs = vectors.iter().zip(v);
    pairs
        .map(|(p, v)| vector::add(*p, vector::scale(*v, step)))
        .collect()
}

/// Numbers moved along others.
pub(crate) fn moved_numbers(numbers: &[f64], v: &[f64], step: f64) -> Vec<f64> {
    numbers.iter().zip(v).map(|(x, v)| x + step * v).collect()
}

/// Inner product of lists of numbers.
pub(crate) fn product(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Inner product of lists of vectors.
pub(crate) fn inner(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| vector::dot(*a, *b)).sum()
}

/// A direction of samples and grid.
pub(crate) struct Direction {
    pub points: Vec<[f64; 3]>,
    pub normals: Vec<[f64; 3]>,
    pub areas: Vec<f64>,
    pub lower: [f64; 3],
    pub spacing: f64,
}

impl Direction {
    pub(crate) fn new(n: usize, random: &mut Random) -> Self {
        Self {
            points: vectors(n, random),
            normals: vectors(n, random),
            areas: numbers(n, random),
            lower: vectors(1, random)[0],
            spacing: 0.1 * numbers(1, random)[0],
        }
    }

    /// Inner product with a cotangent.
    pub(crate) fn inner(&self, bar: &SampleCotangent<f64>) -> f64 {
        inner(&bar.points, &self.points)
            + inner(&bar.normals, &self.normals)
            + product(&bar.areas, &self.areas)
            + vector::dot(bar.grid.lower, self.lower)
            + bar.grid.spacing * self.spacing
    }
}

impl SampleCotangent<f64> {
    /// Zeros for `n` samples.
    pub(crate) fn zeros(n: usize) -> Self {
        Self {
            points: vec![[0.0; 3]; n],
            normals: vec![[0.0; 3]; n],
            areas: vec![0.0; n],
            ..Self::default()
        }
    }
}
