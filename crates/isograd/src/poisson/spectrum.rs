//! Eigenvalues along one axis of `n` cells at frequency `k`, `θ = πk/n`.

use std::f64::consts::PI;

/// Eigenvalue of the stiffness `tridiag(−1, 2, −1)`: `2 − 2 cos θ`, without the cancellation at small `θ`.
pub fn stiffness(k: usize, n: usize) -> f64 {
    4.0 * half_angle(k, n).sin().powi(2)
}

/// Eigenvalue of the mass `tridiag(1, 4, 1)/6`: `(2 + cos θ)/3`.
pub fn mass(k: usize, n: usize) -> f64 {
    (2.0 + (PI * k as f64 / n as f64).cos()) / 3.0
}

/// Factor of the smoothing by `sigma` cells: `exp(−σ²(1 − cos θ))`.
pub fn gaussian(k: usize, n: usize, sigma: f64) -> f64 {
    (-2.0 * (sigma * half_angle(k, n).sin()).powi(2)).exp()
}

/// `θ/2`.
fn half_angle(k: usize, n: usize) -> f64 {
    0.5 * PI * k as f64 / n as f64
}
