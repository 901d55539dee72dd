//! Distance to the reconstructed surface at any points.

use super::{Pipeline, Reconstruction};
use crate::Real;
use crate::data::cells::Cells;
use crate::distance::{Error, Hit, cell_agrees, corners_agree, hits_within};

impl<T: Pipeline> Reconstruction<T> {
    /// Distance, gradient and closest point of [`mesh`](Self::mesh) at `(M, 3)` points, on the grid or off it, in their
    /// order. Outside the surface, a point farther than `within`, in the unit of the points, gets that distance and
    /// [no face](Hit::beyond); a point that is not finite gets NaN and none.
    ///
    /// The sign is that of `χ − c`, where the eight values around a point agree, else that of the pseudonormal of the
    /// closest feature. φ is not used, unless the surface is trimmed or a sheet: then the signs are those of φ where these
    /// agree.
    ///
    /// # Errors
    /// [`Error::Range`].
    pub fn query(&self, points: &[[T; 3]], within: f64) -> Result<Vec<Hit<T>>, Error> {
        T::query(self, points, within)
    }
}

impl<T: Real> Reconstruction<T> {
    /// [`query`](Self::query).
    pub(super) fn hits(&self, points: &[[T; 3]], within: f64) -> Result<Vec<Hit<T>>, Error> {
        let mesh = self.mesh();
        match self.open {
            Some(_) => hits_within(mesh, points, within, &|point| {
                corners_agree((&self.sdf).into(), T::zero(), point)
            }),
            None => hits_within(mesh, points, within, &|point| self.is_inside(point)),
        }
    }

    /// Whether a point is inside, where values of the indicator around it agree: those that the surface was found from, or
    /// beyond their blocks all that there are.
    fn is_inside(&self, point: [f64; 3]) -> Option<bool> {
        let level = self.iso_value;
        let near = self.marched();
        let cell = cell_of(near, point);
        // Where values on half cells differ, those on whole ones may agree on the wrong side.
        let is_near = |cell| near.corners(cell).any(|value| value.is_some());
        if near.is_whole() || self.sparse.is_some() || cell.is_some_and(is_near) {
            return cell_agrees(near, level, cell?);
        }
        let all = Cells::from(&self.indicator);
        cell_agrees(all, level, cell_of(all, point)?)
    }
}

/// The cell of centers around a point, or the last one toward the wall that the point is near; `None` off the grid.
fn cell_of<T: Real>(field: Cells<'_, T>, point: [f64; 3]) -> Option<[usize; 3]> {
    let grid = field.grid();
    let (lower, spacing, shape) = (grid.lower(), grid.spacing().f64(), grid.shape());
    let mut cell = [0; 3];
    for a in 0..3 {
        let from_wall = (point[a] - lower[a].f64()) / spacing;
        if !(0.0..=shape[a] as f64).contains(&from_wall) || shape[a] < 2 {
            return None;
        }
        cell[a] = ((from_wall - 0.5).max(0.0) as usize).min(shape[a] - 2);
    }
    Some(cell)
}
