//! Sheets: membranes and sails, a shell of constant thickness around an open surface.
//!
//! # Map
//! `S → φ = d − t/2`, with `d` the unsigned distance to the open mesh `S` and `t` the thickness: negative within `t/2` of
//! it, round at its rim. The shell `φ = 0` is a closed mesh: marching cubes of `d` at `t/2` on the grid of the surface.
//!
//! # Residual
//! `d` and the closest faces on the grid of the surface, in a band around the shell.
//!
//! # Pullback
//! That of the [distance](crate::distance::lattice), with the sign + everywhere; cotangents of the shell pass through
//! [marching cubes](crate::isosurface) to `d`, and from there likewise.
//!
//! # Not differentiable
//! The thickness is a constant, and so are the faces of the sheet: cotangents do not say how its rim moves. `d` has a kink at
//! points with two closest points, on the sheet itself too: there the derivative is that along the normal of the face.

use crate::data::{GridCotangent, Mesh};
use crate::distance::{self, Band, lattice};
use crate::isosurface::{self, Report};
use crate::{Field, Grid, Real};

/// Cells of the band beyond the shell.
const BAND: f64 = 3.0;

/// Whether the surface is a sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sheet {
    /// φ is the signed distance to the closed surface.
    #[default]
    Off,
    /// φ is the unsigned distance to the [trimmed](crate::isosurface::trim) surface less half of this thickness, in the
    /// cloud's unit.
    Thickness(f64),
}

impl Sheet {
    /// The thickness, if it is a sheet.
    pub fn thickness(self) -> Option<f64> {
        match self {
            Self::Off => None,
            Self::Thickness(thickness) => Some(thickness),
        }
    }

    /// Whether the thickness is positive and finite.
    pub fn is_valid(self) -> bool {
        self.thickness()
            .is_none_or(|thickness| thickness > 0.0 && thickness.is_finite())
    }
}

/// The closed shell of a sheet.
#[derive(Clone)]
pub struct Shell<T: Real> {
    /// Unsigned distance to the sheet, on the grid of the surface.
    distance: Field<T>,
    closest: Vec<u32>,
    mesh: Mesh<T>,
    level: T,
}

/// Errors of a sheet.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The distance.
    #[error(transparent)]
    Distance(#[from] distance::Error),
    /// The shell.
    #[error(
        "the shell of the sheet: {0}; use a thickness of 2 cells of the surface or more, or a finer surface"
    )]
    Shell(#[from] isosurface::Error),
}

/// Writes `d − t/2` from every cell center to the open mesh `sheet` into `phi`, in the cloud's unit, and the closest faces
/// into `closest`. Beyond a band, `φ` is its width.
///
/// # Errors
/// As [`lattice::forward`].
pub fn forward<T: Real>(
    sheet: &Mesh<T>,
    thickness: f64,
    band: Band,
    scratch: &mut distance::Scratch<T>,
    phi: &mut Field<T>,
    closest: &mut Vec<u32>,
) -> Result<(), distance::Error> {
    let half = 0.5 * thickness;
    let band = match band {
        Band::Full => Band::Full,
        Band::Within(width) => Band::Within(width + half),
    };
    unsigned(sheet, band, scratch, phi, closest)?;
    let half = T::of(half);
    phi.values_mut().iter_mut().for_each(|d| *d -= half);
    Ok(())
}

/// Unsigned distances to `sheet`.
fn unsigned<T: Real>(
    sheet: &Mesh<T>,
    band: Band,
    scratch: &mut distance::Scratch<T>,
    phi: &mut Field<T>,
    closest: &mut Vec<u32>,
) -> Result<(), distance::Error> {
    // Every cell is outside.
    let outside = Field::zeros(*phi.grid());
    lattice::forward(sheet, &outside, -T::one(), band, scratch, phi, closest)
}

/// Adds the cotangents of the vertices of `sheet` for those of [`forward`]'s `φ` to `bars`, and returns that of the grid.
pub fn pullback<T: Real>(
    sheet: &Mesh<T>,
    grid: &Grid<T>,
    closest: &[u32],
    phi_bar: &[T],
    scratch: &mut lattice::PullbackScratch<T>,
    bars: &mut [[T; 3]],
) -> GridCotangent<f64> {
    let outside = Field::zeros(*grid);
    lattice::pullback(sheet, &outside, closest, phi_bar, scratch, bars)
}

impl<T: Real> Shell<T> {
    /// The shell of a sheet, found on `grid`.
    ///
    /// # Errors
    /// [`Error::Shell`] if no cell of the grid is within the sheet.
    pub fn new(
        sheet: &Mesh<T>,
        thickness: f64,
        grid: Grid<T>,
        scratch: &mut distance::Scratch<T>,
    ) -> Result<(Self, Report), Error> {
        let (mut distance, mut closest) = (Field::zeros(grid), Vec::new());
        let level = T::of(0.5 * thickness);
        let band = Band::Within(0.5 * thickness + BAND * grid.spacing().f64());
        unsigned(sheet, band, scratch, &mut distance, &mut closest)?;
        let mut mesh = Mesh::default();
        let scratch = &mut isosurface::Scratch::default();
        let report = isosurface::forward(&distance, level, scratch, &mut mesh)?;
        let shell = Self {
            distance,
            closest,
            mesh,
            level,
        };
        Ok((shell, report))
    }

    /// The closed mesh.
    pub fn mesh(&self) -> &Mesh<T> {
        &self.mesh
    }

    /// Adds the cotangents of the vertices of `sheet` for those of the shell to `bars`. Returns the cotangent of the grid
    /// of the surface, and the number of derivatives that were bounded.
    pub fn pullback(
        &self,
        sheet: &Mesh<T>,
        vertices_bar: &[[T; 3]],
        scratch: &mut lattice::PullbackScratch<T>,
        bars: &mut [[T; 3]],
    ) -> (GridCotangent<f64>, usize) {
        let mut distance_bar = vec![T::zero(); self.distance.values().len()];
        let found = isosurface::pullback(
            &self.distance,
            self.level,
            &self.mesh,
            vertices_bar,
            &mut distance_bar,
        );
        let (of, closest) = (&self.distance, &self.closest);
        let mut grid = lattice::pullback(sheet, of, closest, &distance_bar, scratch, bars);
        grid.add(&found.grid);
        (grid, found.guarded)
    }
}
