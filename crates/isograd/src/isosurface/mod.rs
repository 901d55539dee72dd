//! The isosurface stage: marching cubes on the lattice of cell centers.
//!
//! # Map
//! `(χ, c) → mesh`. A cell with `χ < c` is inside; a value exactly at the level is outside. Each lattice
//! edge `(p, q)` from a cell center to the next one along an axis whose ends differ carries one vertex,
//! `y = (1−η) p + η q` with `η = (c − χ_p)/(χ_q − χ_p)`. The signs of a cube's eight corners give the
//! closed loops of vertices that its triangles fill. On a face with two inside corners on a diagonal those
//! two are kept apart, whichever side the face is looked at from, so neighboring cubes fit: away from the
//! walls every edge belongs to exactly two triangles, with opposite directions, and the triangles around a
//! vertex form one ring. Of the triangulations of a loop for which that holds, the one that encloses the most is
//! taken: the surface then does not jump where another is. Faces are counter-clockwise seen from the side
//! where `χ ≥ c`.
//!
//! Vertices are stored in the order of their [`LatticeEdge`](crate::LatticeEdge), faces in the order of
//! their cube. A triangle may have no area: where a corner lies exactly at the level, the vertices round
//! it coincide.
//!
//! The lattice ends at the outermost cell centers. Where inside cells reach them the surface is left
//! **open**: a cap would need vertices that lie on no lattice edge, and a larger grid is the
//! remedy. [`Report::walls`] lists the walls.
//!
//! # Residual
//! Nothing beyond `χ`, `c` and [`Mesh::edges`](crate::Mesh::edges): `η` is two loads and a division.
//!
//! # Pullback
//! With `ȳ` the cotangent of a vertex and `s = ȳ·(q − p)`:
//! `χ̄_p −= s (1−η)/(χ_q−χ_p)`, `χ̄_q −= s η/(χ_q−χ_p)`, `c̄ += s/(χ_q−χ_p)`. The difference is never zero,
//! since the ends of a crossed edge differ, but it may be so small that its reciprocal overflows: below a
//! millionth of the range of `χ` it counts as that much. Each vertex adds to two cells only: [`pullback`].
//!
//! [`measure_pullback`] is where `ȳ` may come from: the gradient of area and volume.
//!
//! # Not differentiable
//! The signs and the choice of triangulations, hence the list of faces. When a value passes the level, vertices appear or
//! vanish at that cell center; positions stay continuous, and so does the surface, but where parts of it join or separate.
//!
//! # Source
//! Lorensen and Cline, *Marching cubes*, SIGGRAPH 1987; the rule for faces is that of Montani, Scateni and
//! Scopigno, *A modified look-up table for implicit disambiguation of marching cubes*, 1994. The table is
//! computed, not copied, and has all triangulations of a loop instead of one.

pub(crate) mod blocks;
pub mod iso_value;
pub mod local_level;
mod march;
pub mod measure;
mod measure_pullback;
#[cfg(test)]
mod measure_pullback_tests;
mod pullback;
pub(crate) mod refine;
mod signs;
mod spline;
mod tables;
#[cfg(test)]
mod tests;
pub mod trim;

pub use crate::element::crossing::crossing;
pub use march::{Scratch, forward};
pub use measure::Measures;
pub use measure_pullback::pullback as measure_pullback;
pub(crate) use pullback::pullback_on;
pub use pullback::{LevelCotangent, SMALLEST_DIFFERENCE, pullback};
pub use tables::{Loop, TIE, loops_of};

/// Iso-value of the indicator at which the surface is extracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// Local value at the samples nearby, also on parts thinner than a cell, which are made about a cell thick: hardly any
    /// of them is missed. Where the surface has a grid of its own, samples of such parts are moved apart until these are
    /// thick enough, if samples have areas and are not less than about a sixth of a cell of the surface apart. Where its cells
    /// are larger than 0.95 of the distance between samples, as automatic ones are, and the solve is dense, the surface is also that of
    /// quadratic B-splines, marched on cells half as large: it hardly depends on how the body lies on the grid, and derivatives vary
    /// less within a cell.
    #[default]
    Thin,
    /// Local value at the samples nearby: [`local_level`]. Parts thinner than two cells of the surface may be cut off.
    Local,
    /// The mean at all samples: [`iso_value`], as in the paper.
    Mean,
}

/// The indicator between cell centers, where samples read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// Trilinear, as between the ends of the edges on which vertices lie.
    #[default]
    Linear,
    /// Quadratic B-splines, as for the values of a [refined](refine) indicator. For dense fields.
    Spline,
}

/// Report of the stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Whether inside cells lie at a wall of the grid. The surface is open there; if all of the
    /// outermost cells are inside, it is inside out.
    pub touches_wall: bool,
    /// At which walls: `walls[axis][0]` at the low end of the axis, `walls[axis][1]` at the high one.
    pub walls: [[bool; 2]; 3],
    /// Number of cells with `χ < c`.
    pub inside: usize,
}

/// Errors of the isosurface stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The level is NaN or infinite.
    #[error(
        "the level is {level}; it must be finite: look for NaN or overflow in the stage that computed it"
    )]
    Level {
        /// The level.
        level: f64,
    },
    /// A value is NaN or infinite.
    #[error(
        "the field is {value} at cell {cell:?}; every value must be finite: scale the input down or use f64 if it overflowed"
    )]
    NotFinite {
        /// The first such cell, in memory order.
        cell: [usize; 3],
        /// Its value.
        value: f64,
    },
    /// No cell is inside.
    #[error(
        "no cell is below the level {level:?} (values run from {min:?} to {max:?}), so there is no surface; use smaller cells if the body is thinner than a few of them, and check that the normals point outward"
    )]
    NothingInside {
        /// The level.
        level: f64,
        /// Least value of the field.
        min: f64,
        /// Greatest value of the field.
        max: f64,
    },
    /// No cell is outside.
    #[error(
        "every cell is below the level {level:?} (values run from {min:?} to {max:?}), so there is no surface; check that the normals point outward and that the grid is larger than the body"
    )]
    NothingOutside {
        /// The level.
        level: f64,
        /// Least value of the field.
        min: f64,
        /// Greatest value of the field.
        max: f64,
    },
    /// More vertices than 32-bit indices can address.
    #[error(
        "the surface has {vertices} vertices, more than 32-bit indices can address; use a coarser grid, or smooth the field if it is noise"
    )]
    TooManyVertices {
        /// Number of vertices.
        vertices: usize,
    },
}
