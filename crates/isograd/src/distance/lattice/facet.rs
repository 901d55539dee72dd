//! A triangle as the search for the closest one sees it: in single precision, and in cells.

use crate::distance::triangle::{Frame, Outline, Side};

/// The frame of a triangle (see [`triangle`](crate::distance::triangle)) without a place in space: points are
/// given from one of its corners.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Facet {
    axes: [[f32; 3]; 3],
    /// Which face of the mesh it is.
    pub face: u32,
    corners: [[f32; 2]; 3],
    outline: Outline<f32>,
}

impl Facet {
    pub(super) fn new(frame: &Frame, face: u32, per_cell: f64) -> Self {
        let outline = &frame.outline;
        let length = |x: f64| (x * per_cell) as f32;
        let side = |side: &Side<f64>| Side {
            unit: side.unit.map(|x| x as f32),
            length: length(side.length),
        };
        Self {
            face,
            axes: frame.axes.map(|axis| axis.map(|x| x as f32)),
            corners: std::array::from_fn(|k| frame.corner(k).map(length)),
            outline: Outline {
                base: length(outline.base),
                foot: length(outline.foot),
                right: side(&outline.right),
                left_from_right: side(&outline.left_from_right),
            },
        }
    }

    /// Squared distances from points, `[axis][point]`, given from corner `corner`.
    #[inline(always)]
    pub(super) fn distances<const N: usize>(&self, corner: u32, from: &[[f32; N]; 3]) -> [f32; N] {
        let Self {
            axes: [u, v, w],
            outline,
            ..
        } = *self;
        let [x0, y0] = self.corners[corner.min(2) as usize];
        let mut squared = [0.0; N];
        for l in 0..N {
            let (a, b, c) = (from[0][l], from[1][l], from[2][l]);
            let x = x0 + (u[0] * a + u[1] * b + u[2] * c);
            let y = y0 + (v[0] * a + v[1] * b + v[2] * c);
            let z = w[0] * a + w[1] * b + w[2] * c;
            squared[l] = z * z + outline.distance_squared(x, y);
        }
        squared
    }
}
