//! Smooth functionals of φ, and their derivatives in φ.

use isograd::Field;
use serde::Serialize;

use super::motion::Frame;

/// Half width of the layer around the surface in which the functionals vary, in cells.
pub const LAYER: f64 = 4.0;

/// `F = h³ Σ_o w(x_o) g(φ_o/h)`.
///
/// The weight `w` is linear in the position, so that every motion changes `F`, even one that moves the two faces of a thin
/// body together. Every `g` is constant beyond [`LAYER`], so φ is not needed there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Functional {
    /// `g` falls from 1 to 0 across the layer (quintic): the weighted volume.
    Volume,
    /// `g = (1 − t²/L²)³` within the layer: the weighted area, times a constant.
    Shell,
}

impl Functional {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Volume, Self::Shell];

    /// `g(t)`.
    fn value(self, t: f64) -> f64 {
        let u = (t / LAYER).clamp(-1.0, 1.0);
        match self {
            Self::Volume => 0.5 - u * (15.0 - 10.0 * u * u + 3.0 * u.powi(4)) / 16.0,
            Self::Shell => (1.0 - u * u).powi(3),
        }
    }

    /// `g'(t)`.
    fn slope(self, t: f64) -> f64 {
        let u = (t / LAYER).clamp(-1.0, 1.0);
        let bump = (1.0 - u * u).powi(2) / LAYER;
        match self {
            Self::Volume => -15.0 / 16.0 * bump,
            Self::Shell => -6.0 * u * bump,
        }
    }

    /// `F`.
    pub fn of(self, frame: &Frame, phi: &Field<f64>) -> f64 {
        let (grid, h) = (phi.grid(), phi.grid().spacing());
        let term = |(cell, &phi): (usize, &f64)| frame.weight(grid, cell) * self.value(phi / h);
        h.powi(3) * phi.values().iter().enumerate().map(term).sum::<f64>()
    }

    /// `∂F/∂φ` at every cell.
    pub fn cotangent(self, frame: &Frame, phi: &Field<f64>) -> Vec<f64> {
        let (grid, h) = (phi.grid(), phi.grid().spacing());
        let term =
            |(cell, &phi): (usize, &f64)| h * h * frame.weight(grid, cell) * self.slope(phi / h);
        phi.values().iter().enumerate().map(term).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isograd::Grid;

    #[test]
    fn slopes_agree_with_differences_of_the_values() {
        for functional in Functional::ALL {
            for t in [-5.0, -3.7, -1.0, 0.0, 0.3, 2.2, 3.99, 4.5] {
                let e = 1e-5;
                let differences = (functional.value(t + e) - functional.value(t - e)) / (2.0 * e);
                // The step squared, and rounding over the step.
                assert!((differences - functional.slope(t)).abs() < 1e-9, "{t}");
            }
        }
    }

    #[test]
    fn the_volume_of_a_ball_is_its_volume() {
        let grid = Grid::new([-1.0f64; 3], 2.0 / 40.0, [40; 3]).expect("a grid");
        let mut phi = Field::zeros(grid);
        for cell in 0..grid.cells() {
            let [x, y, z] = grid.center(grid.cell(cell));
            phi.values_mut()[cell] = x.hypot(y).hypot(z) - 0.6;
        }
        let frame = Frame {
            center: [0.0; 3],
            half: [0.6; 3],
            reach: 0.6,
            bending: 2,
        };
        // A ball whose radius is distributed as the slope of the step, whose variance is a seventh of the layer's.
        let variance = (LAYER * grid.spacing()).powi(2) / 7.0;
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        let volume = ball * 0.6 * (0.36 + 3.0 * variance);
        let computed = Functional::Volume.of(&frame, &phi);
        // For a function this smooth, sums over cells converge faster than the square of the cell.
        assert!(
            (computed / volume - 1.0).abs() < 1e-3,
            "{computed} {volume}"
        );
        // Lowering φ everywhere by a length moves the surface outward by that length.
        let slope: f64 = Functional::Volume.cotangent(&frame, &phi).iter().sum();
        let area = 3.0 * ball * (0.36 + variance);
        assert!((-slope / area - 1.0).abs() < 1e-3, "{slope} {area}");
    }
}
