//! Motions of a cloud; the fastest point has unit speed.

use isograd::{Grid, PointCloud};
use isograd_element::vector::{add, dot, norm, normalized, scale, sub};
use serde::Serialize;

use crate::output::Outcome;

/// Change of the weight over half the body, along each axis.
const SLOPE: [f64; 3] = [0.5, 0.4, 0.3];

/// A smooth motion of all samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// Translation along the first axis of the grid: every sample crosses cell faces.
    Along,
    /// Translation oblique to all axes.
    Oblique,
    /// Offset along the body's own normals.
    Offset,
    /// Scaling about the center.
    Scaling,
    /// Sideways displacement by the square of the position along the first axis.
    Bending,
}

impl Motion {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Along,
        Self::Oblique,
        Self::Offset,
        Self::Scaling,
        Self::Bending,
    ];

    /// Velocity of a point with normal `n`.
    pub fn velocity(self, frame: &Frame, x: [f64; 3], n: [f64; 3]) -> [f64; 3] {
        let from = sub(x, frame.center);
        match self {
            Self::Along => [1.0, 0.0, 0.0],
            Self::Oblique => scale([3.0, 2.0, 1.0], 1.0 / 14f64.sqrt()),
            Self::Offset => n,
            Self::Scaling => scale(from, 1.0 / frame.reach),
            Self::Bending => scale(frame.aside(), (from[0] / frame.half[0]).powi(2)),
        }
    }

    /// Velocity of the normal `n` under this motion.
    pub fn turning(self, frame: &Frame, x: [f64; 3], n: [f64; 3]) -> [f64; 3] {
        let along = self.turning_unbound(frame, x, n);
        sub(along, scale(n, dot(along, n)))
    }

    /// The normal after a motion of `step`.
    pub fn turned(self, frame: &Frame, x: [f64; 3], n: [f64; 3], step: f64) -> [f64; 3] {
        let new = add(n, scale(self.turning_unbound(frame, x, n), step));
        normalized(new).unwrap_or(n)
    }

    /// `−(∂v/∂x)ᵀ n`, up to its component along `n`. Bending is a shear, so the inverse transpose of `1 + step ∂v/∂x` is
    /// `1 − step (∂v/∂x)ᵀ` for any step.
    fn turning_unbound(self, frame: &Frame, x: [f64; 3], n: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Bending => {
                let slope = 2.0 * (x[0] - frame.center[0]) / frame.half[0].powi(2);
                [-slope * dot(frame.aside(), n), 0.0, 0.0]
            }
            _ => [0.0; 3],
        }
    }

    /// The cloud after a motion of `step`, with its normals.
    pub fn moved(
        self,
        frame: &Frame,
        cloud: &PointCloud<f64>,
        step: f64,
    ) -> Outcome<PointCloud<f64>> {
        let normals = cloud.normals().ok_or("a cloud without normals")?;
        let pairs = || cloud.points().iter().zip(normals);
        let points = pairs().map(|(&x, &n)| add(x, scale(self.velocity(frame, x, n), step)));
        let turned = pairs().map(|(&x, &n)| self.turned(frame, x, n, step));
        let (points, turned) = (points.collect(), turned.collect());
        Ok(PointCloud::new(points)?.with_normals(turned)?)
    }
}

/// Frame of reference of the motions of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Center of the bounding box.
    pub center: [f64; 3],
    /// Half its extent.
    pub half: [f64; 3],
    /// Largest distance of a point from the center.
    pub reach: f64,
    /// Axis of the bending displacement: the shorter one of the last two.
    pub bending: usize,
}

impl Frame {
    /// Weight of a cell in the functionals: `w(x) = 1 + Σ slope_a (x_a − center_a)/half_a`.
    pub fn weight(&self, grid: &Grid<f64>, cell: usize) -> f64 {
        let x = grid.center(grid.cell(cell));
        let along = |a: usize| SLOPE[a] * (x[a] - self.center[a]) / self.half[a];
        1.0 + (0..3).map(along).sum::<f64>()
    }

    /// Frame of a cloud.
    pub fn of(cloud: &PointCloud<f64>) -> Outcome<Self> {
        let (low, high) = cloud.bounds().ok_or("a cloud without points")?;
        let center = scale(add(low, high), 0.5);
        let extent = sub(high, low);
        let distance = |&x: &[f64; 3]| norm(sub(x, center));
        Ok(Self {
            center,
            half: scale(extent, 0.5),
            reach: cloud.points().iter().map(distance).fold(0.0, f64::max),
            bending: if extent[1] < extent[2] { 1 } else { 2 },
        })
    }

    fn aside(&self) -> [f64; 3] {
        std::array::from_fn(|a| f64::from(u8::from(a == self.bending)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isograd_element::vector::cross;

    const FRAME: Frame = Frame {
        center: [0.1, 0.2, 0.3],
        half: [0.7, 0.6, 0.5],
        reach: 0.9,
        bending: 2,
    };

    #[test]
    fn a_turned_normal_is_normal_to_moved_tangents() {
        let x = [0.5, 0.1, 0.35];
        let n = normalized([0.3, -0.5, 0.7]).expect("a direction");
        let tangents = [cross(n, [1.0, 0.0, 0.0]), cross(n, [0.0, 1.0, 0.0])];
        let step = 0.3;
        // An offset keeps the normals of a surface, but not those of a plane patch whose `n` is held.
        for motion in [Motion::Along, Motion::Scaling, Motion::Bending] {
            let place = |x| add(x, scale(motion.velocity(&FRAME, x, n), step));
            let turned = motion.turned(&FRAME, x, n, step);
            for t in tangents {
                let e = 1e-5;
                let ends = [1.0, -1.0].map(|s| place(add(x, scale(t, s * e))));
                let along = scale(sub(ends[0], ends[1]), 0.5 / e);
                // Central differences of a quadratic map are exact but for rounding.
                assert!(dot(along, turned).abs() < 1e-10, "{motion:?}");
            }
        }
    }

    #[test]
    fn turning_is_the_derivative_of_turned() {
        let (x, e) = ([0.5, 0.1, 0.35], 1e-5);
        let n = normalized([0.3, -0.5, 0.7]).expect("a direction");
        for motion in Motion::ALL {
            let ends = [e, -e].map(|step| motion.turned(&FRAME, x, n, step));
            let slope = scale(sub(ends[0], ends[1]), 0.5 / e);
            let off = norm(sub(slope, motion.turning(&FRAME, x, n)));
            // The step squared, times a third derivative of about 10.
            assert!(off < 1e-8, "{motion:?}: {off}");
        }
    }

    #[test]
    fn the_fastest_point_has_unit_speed() {
        let points = vec![[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.5, 0.9, 0.05]];
        let normals = vec![[0.0, 0.0, 1.0]; 3];
        let cloud = PointCloud::new(points).expect("finite");
        let frame = Frame::of(&cloud).expect("points");
        for motion in Motion::ALL {
            let speed = |(&x, &n)| norm(motion.velocity(&frame, x, n));
            let fastest = cloud.points().iter().zip(&normals).map(speed);
            let fastest = fastest.fold(0.0, f64::max);
            assert!((fastest - 1.0).abs() < 1e-12, "{motion:?}: {fastest}");
        }
    }
}
