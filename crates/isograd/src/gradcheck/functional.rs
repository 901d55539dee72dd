//! The functional of φ whose derivatives are compared.

use super::Parting;
use crate::vector::{add, scale, sub};
use crate::{Field, Grid, PointCloud, parallel};

/// Width of the soft edge, in cells.
const WIDTH: f64 = 6.0;

/// Least length over which the weights rise, in cells: sums over cells then hardly depend on the place on the grid.
const LEAST_RISE: f64 = 16.0;

/// Cells along each side of the blocks in which a parting is looked for.
const BLOCK: usize = 8;

/// `u = 1 + ⅓ Σ_a sin(π ξ_a) + 4/3 (ξ_x ξ_y + ξ_y ξ_z + ξ_z ξ_x)`, `ξ` from −½ to ½ across a box of this size.
/// It rises from one end of the body to the other, so that translations change `L` by as much as can be; the
/// last term is for rotations.
fn weight(center: [f64; 3], size: [f64; 3], place: [f64; 3]) -> f64 {
    let x = sub(place, center);
    let [x, y, z] = [0, 1, 2].map(|a| x[a] / size[a]);
    let rise = |t: f64| (std::f64::consts::PI * t.clamp(-0.5, 0.5)).sin();
    let products = x * y + y * z + z * x;
    1.0 + (rise(x) + rise(y) + rise(z) + 4.0 * products.clamp(-1.0, 1.0)) / 3.0
}

/// `h³ Σ_o u(x_o) g(φ_o)`: the weights `h³ u` are kept.
pub(super) struct Functional {
    weights: Vec<f64>,
    /// Of the soft edge, in the cloud's unit.
    width: f64,
}

impl Functional {
    pub(super) fn new(cloud: &PointCloud<f64>, grid: &Grid<f64>) -> Self {
        let (low, high) = cloud.bounds().unwrap_or_default();
        let least = LEAST_RISE * grid.spacing();
        let (center, size) = (
            scale(add(low, high), 0.5),
            sub(high, low).map(|side| side.max(least)),
        );
        let volume = grid.spacing().powi(3);
        let weight = |cell: usize| volume * weight(center, size, grid.center_f64(grid.cell(cell)));
        Self {
            weights: parallel::map(grid.cells(), weight),
            width: WIDTH * grid.spacing(),
        }
    }

    /// The part of every cell.
    pub(super) fn parts(&self, phi: &Field<f64>) -> Vec<f64> {
        let (phi, u) = (phi.values(), &self.weights);
        parallel::map(phi.len(), |cell| u[cell] * fall(phi[cell] / self.width))
    }

    /// `∂L/∂φ` at every cell.
    pub(super) fn cotangent(&self, phi: &Field<f64>) -> Vec<f64> {
        let (phi, u) = (phi.values(), &self.weights);
        parallel::map(phi.len(), |cell| {
            u[cell] * slope(phi[cell] / self.width) / self.width
        })
    }
}

/// From 1 at `t = 0` to 0 at `t = 1`, with two continuous derivatives.
fn fall(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t))
}

/// The derivative of [`fall`].
fn slope(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    -30.0 * (t * (1.0 - t)).powi(2)
}

/// The block of cells in which two derivatives, given cell by cell, differ most.
pub(super) fn parting(grid: &Grid<f64>, small: &[f64], large: &[f64]) -> Parting {
    let shape = grid.shape();
    let blocks = shape.map(|n| n.div_ceil(BLOCK));
    let mut sums = vec![0.0; blocks.iter().product()];
    for (index, (a, b)) in small.iter().zip(large).enumerate() {
        let [i, j, k] = grid.cell(index).map(|c| c / BLOCK);
        sums[(i * blocks[1] + j) * blocks[2] + k] += b - a;
    }
    let total: f64 = sums.iter().map(|s: &f64| s.abs()).sum();
    let most = (0..sums.len()).fold(0, |m, i| if sums[i].abs() > sums[m].abs() { i } else { m });
    let block = [
        most / (blocks[1] * blocks[2]),
        most / blocks[2] % blocks[1],
        most % blocks[2],
    ];
    let middle = [0, 1, 2].map(|a| {
        let (from, to) = (block[a] * BLOCK, shape[a].min((block[a] + 1) * BLOCK));
        0.5 * (from + to) as f64
    });
    Parting {
        place: grid.from_index(middle),
        share: if total > 0.0 {
            sums[most].abs() / total
        } else {
            0.0
        },
    }
}
