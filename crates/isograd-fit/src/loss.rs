//! Mean squared difference between a field and its target, and its cotangent.
//!
//! `L = (1/n) Σ_o ((φ_o − φ̃_o)/h)²` over the `n` cells of a band: the paper's Eq. `sdf_matching_loss`,
//! `‖φ̃ − φ‖²`, in cells² and as a mean, so that its size depends neither on the grid nor on the unit.
//! `φ̄_o = 2 (φ_o − φ̃_o)/(n h²)`.

use std::str::FromStr;

use isograd::Field;
use rayon::prelude::*;

use crate::target::TargetError;

/// Cells in one task: a fixed number, so that the sum has the same bits for any number of threads.
const CHUNK: usize = 8192;

/// Cells on which a field is compared with its target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Band {
    /// Up to 8 cells from the target's surface. There every part of the surface counts by its area; far away one corner
    /// is closest to most cells, and a parameter that has no influence on that corner is hard to find.
    #[default]
    Auto,
    /// Everywhere: parts of the fitted surface that are closest to no cell near the target count as well.
    Full,
    /// Up to this distance from the target's surface, in the unit of the target.
    Within(f64),
}

impl Band {
    /// Half the width, in cells of size `spacing`.
    fn cells(self, spacing: f64) -> f64 {
        match self {
            Self::Auto => 8.0,
            Self::Full => f64::INFINITY,
            Self::Within(distance) => distance / spacing,
        }
    }
}

impl FromStr for Band {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.trim().parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("full", _) => Ok(Self::Full),
            (_, Ok(distance)) if distance > 0.0 && distance < f64::INFINITY => {
                Ok(Self::Within(distance))
            }
            _ => Err(format!(
                "band is '{text}'; give a finite length above 0, 'auto' or 'full'"
            )),
        }
    }
}

/// A target and the cells on which a field is compared with it.
#[derive(Clone, Debug)]
pub struct Matching {
    target: Vec<f64>,
    /// `1/h`.
    per_cell: f64,
    /// Half the width of the band, in cells.
    width: f64,
    cells: usize,
}

/// Difference between a field and the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mismatch {
    /// Mean of the squared difference, in cells².
    pub loss: f64,
    /// Mean absolute difference, in cells.
    pub mean_error: f64,
}

impl Matching {
    /// A comparison with `target` in `band`.
    ///
    /// # Errors
    /// A band without cells or of invalid width.
    pub fn new(target: &Field<f64>, band: Band) -> Result<Self, TargetError> {
        let per_cell = 1.0 / target.grid().spacing();
        let width = band.cells(target.grid().spacing());
        let near = |v: &&f64| (*v * per_cell).abs() <= width;
        let cells = target.values().iter().filter(near).count();
        if cells == 0 || !(width > 0.0) {
            return Err(TargetError::EmptyBand { cells: width });
        }
        Ok(Self {
            target: target.values().to_vec(),
            per_cell,
            width,
            cells,
        })
    }

    /// The difference of `phi` from the target; writes the cotangent of the loss, per unit of φ, into `phi_bar`.
    /// Both have one entry for each cell of the target.
    pub fn evaluate(&self, phi: &[f64], phi_bar: &mut [f64]) -> Mismatch {
        debug_assert!(phi.len() == self.target.len() && phi_bar.len() == phi.len());
        let slope = 2.0 * self.per_cell / self.cells as f64;
        let chunks = phi
            .par_chunks(CHUNK)
            .zip(self.target.par_chunks(CHUNK))
            .zip(phi_bar.par_chunks_mut(CHUNK));
        let partial: Vec<[f64; 2]> = chunks
            .map(|((phi, target), bar)| {
                let mut sums = [0.0; 2];
                for ((phi, target), bar) in phi.iter().zip(target).zip(bar) {
                    let counts = (target * self.per_cell).abs() <= self.width;
                    let off = if counts {
                        (phi - target) * self.per_cell
                    } else {
                        0.0
                    };
                    *bar = slope * off;
                    sums[0] += off * off;
                    sums[1] += off.abs();
                }
                sums
            })
            .collect();
        let total = partial
            .into_iter()
            .fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let [loss, mean_error] = total.map(|sum| sum / self.cells as f64);
        Mismatch { loss, mean_error }
    }
}

#[cfg(test)]
mod tests {
    use isograd::Grid;

    use super::*;

    fn field(h: f64, value: impl Fn([f64; 3]) -> f64) -> Field<f64> {
        let grid = Grid::new([-8.0 * h; 3], h, [16, 17, 18]).expect("valid");
        let values = (0..grid.cells()).map(|i| value(grid.center(grid.cell(i)).map(|x| x / h)));
        let values = values.map(|v| v * h).collect();
        Field::new(grid, values).expect("as many")
    }

    fn sphere(h: f64, radius: f64) -> Field<f64> {
        field(h, |x| isograd_element::vector::norm(x) - radius)
    }

    #[test]
    fn the_loss_has_no_unit_and_its_cotangent_is_its_derivative() {
        for h in [1.0, 1e-3] {
            for band in [Band::Full, Band::Within(1.5 * h)] {
                let matching = Matching::new(&sphere(h, 4.0), band).expect("a target");
                let mut phi = sphere(h, 4.3).into_values();
                let mut bar = vec![0.0; phi.len()];
                let here = matching.evaluate(&phi, &mut bar);
                // Every cell is 0.3 cells off.
                assert!((here.loss - 0.09).abs() < 1e-12 && (here.mean_error - 0.3).abs() < 1e-12);
                for cell in [0, 2345, 2500] {
                    let mut other = vec![0.0; phi.len()];
                    let step = 1e-4 * h;
                    phi[cell] += step;
                    let above = matching.evaluate(&phi, &mut other).loss;
                    phi[cell] -= 2.0 * step;
                    let below = matching.evaluate(&phi, &mut other).loss;
                    phi[cell] += step;
                    // Quadratic: a central difference is exact but for rounding, 1e-16/1e-4 of the loss.
                    let slope = (above - below) / (2.0 * step);
                    assert!(
                        (slope - bar[cell]).abs() * h < 1e-11,
                        "{slope} {}",
                        bar[cell]
                    );
                }
            }
        }
    }

    #[test]
    fn cells_outside_the_band_do_not_count() {
        let matching = Matching::new(&sphere(1.0, 4.0), Band::Within(1.0)).expect("a target");
        let mut phi = sphere(1.0, 4.0).into_values();
        phi[0] += 100.0;
        let mut bar = vec![1.0; phi.len()];
        let here = matching.evaluate(&phi, &mut bar);
        assert_eq!(here, Mismatch::default());
        assert!(bar.iter().all(|b| *b == 0.0));
    }

    #[test]
    fn a_band_without_cells_is_refused() {
        for cells in [0.0, -1.0, f64::NAN] {
            let refused = Matching::new(&sphere(1.0, 4.0), Band::Within(cells));
            assert!(refused.expect_err("refused").to_string().contains("wider"));
        }
    }
}
