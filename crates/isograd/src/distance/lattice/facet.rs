//! Triangles in single precision and in cells, for the search of the closest one.

use pulp::Simd;

use crate::distance::triangle::{Frame, Outline, Side};
use crate::simd::multiply_add;

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
    pub(super) fn distances<S: Simd, const N: usize>(
        &self,
        corner: u32,
        from: &[[f32; N]; 3],
    ) -> [f32; N] {
        let Self {
            axes: [u, v, w],
            outline,
            ..
        } = *self;
        let [x0, y0] = self.corners[corner.min(2) as usize];
        let mut squared = [0.0; N];
        for l in 0..N {
            let (a, b, c) = (from[0][l], from[1][l], from[2][l]);
            let along = |axis: [f32; 3], start: f32| {
                let last = multiply_add::<S>(axis[2], c, start);
                multiply_add::<S>(axis[0], a, multiply_add::<S>(axis[1], b, last))
            };
            let (x, y, z) = (along(u, x0), along(v, y0), along(w, 0.0));
            let in_plane = outline.distance_squared(x, y, multiply_add::<S>);
            squared[l] = multiply_add::<S>(z, z, in_plane);
        }
        squared
    }
}
