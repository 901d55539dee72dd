//! Closest-point extension: an attribute of the samples (a surface velocity, a temperature), evaluated at the
//! surface point closest to every cell of a band.
//!
//! # Map
//! Attribute `v_i` per sample → value `u_v` at every vertex `y_v` of the surface → value at every cell of a
//! [`Region`], `Σ_k β_k u_k` over the corners of the cell's closest triangle, `β` the barycentric
//! coordinates of the closest point. The value is constant along the normal of the surface, as a
//! boundary condition at a cell near the wall needs it.
//!
//! At a vertex a linear function is fitted to the samples around it and taken at the vertex (moving least
//! squares: D. Levin, *The approximation power of moving least-squares*, Math. Comp. 67, 1998). With
//! `d_j = x_j − y_v`, `r_j = |d_j|`:
//! ```text
//! w_j = (a_j + a₀) K(r_j),  K(r) = (1 − r²/R_v²)² inside R_v, else 0;  W = Σ w_j,  p_j = w_j / W
//! m = Σ p_j d_j,  e_j = d_j − m,  C = Σ p_j e_j e_jᵀ
//! ε = tr C (ε₀ + ε₁ τ²),  τ = |m|² / tr C,  ε₀ = 1e-5,  ε₁ = 1/256
//! s = (C + ε I)⁻¹ m,  t_j = 1 − s·e_j,  u_v = Σ_j p_j t_j v_j
//! ```
//! Linear in `v`, and `Σ_j p_j t_j = 1`: constants are exact, linear fields (translation and rotation of a
//! rigid body) as far as `ε` is small. Samples of a surface lie nearly in a plane, so `C` has nearly rank 2;
//! `ε₀` is the share of its trace below which its third direction counts as noise. `ε₁` lets the slope fade
//! where a vertex is far from its samples compared with how far they are from each other (`τ` of 16 and
//! more), where a slope would be extrapolated. Nothing depends on the unit of length.
//!
//! `R_v = max(R, min(1.5 r₆, 1.05 r₆₄))` with `r_k` the distance to the `k`-th nearest sample: `R` where a vertex has
//! enough samples around it; a vertex in a hole takes the samples around the hole. In the pipeline `R` is the common radius
//! of the neighborhoods, or the cell size of the surface where that is larger: then every sample has a share in a vertex.
//! `a₀` is a millionth of the mean area: outliers, whose area is 0, count only where there is nothing else.
//!
//! # Residual
//! [`Residual`]: `R_v`, `W`, `m` and `s` of every vertex, `a₀`, and `β` of every cell in the band. Besides it
//! the pullback takes the inputs again, and [`Extension::cells`].
//!
//! # Pullback
//! [`pullback`]. From cells to vertices, `ū_k += β_k ū_cell`. To the attribute, exact since the map is linear:
//! ```text
//! v̄_j += Σ_v p_j t_j ū_v
//! ```
//! To points and areas, per vertex, sums over the components of `v` implied in `ū_v v`:
//! ```text
//! q_j = ū_v (v_j − Σ_k p_k v_k),  g = (C + ε I)⁻¹ Σ_j p_j e_j q_j,  ρ_j = q_j − g·e_j
//! D_j = ρ_j t_j + (g·s) [(ε₀ − ε₁ τ²) |e_j|² + 4 ε₁ τ (m·e_j)],  w̄_j = (D_j − Σ_k p_k D_k) / W
//! d̄_j = p_j { −t_j g − ρ_j s + (g·s) [4 ε₁ τ m + 2 (ε₀ − ε₁ τ²) e_j] }
//!       − w̄_j (a_j + a₀) (4/R_v²) (1 − r_j²/R_v²) d_j
//! x̄_j += d̄_j,   ȳ_v −= Σ_j d̄_j,   ā_j += w̄_j K(r_j)
//! ```
//! The value depends on lengths through `d_j/R_v` alone, so `R_v R̄_v = −Σ_j ⟨d̄_j, d_j⟩`. It goes to `R`, or where `R_v` is
//! `1.5 |d_k|` or `1.05 |d_k|` of a sample `k`, to that: `x̄_k += R_v R̄_v d_k/|d_k|²`, and the opposite to `ȳ_v`.
//! To the surface through `β`, per cell of center `q`: let `y_0` be a corner of the feature (face, edge or
//! vertex) that holds the closest point `p`, `E` the columns `y_k − y_0` for its other corners, `o = q − p`
//! and, summed over components, `δ_k = ū (u_k − u_0)`. Then with `γ = (EᵀE)⁻¹ δ` and `G = E γ`
//! ```text
//! q̄ += G,   ȳ_k += γ_k o − β_k G,   ȳ_0 −= Σ_k γ_k o + β_0 G
//! ```
//!
//! # Not differentiable
//! `a₀` and which sample is the 6th or 64th are held constant. Which cells are in the band, which triangle is closest and
//! which of its features: values jump on the medial axis, and their slopes jump from feature to feature. A triangle much
//! thinner than a cell turns without bound when a corner moves: the direction in which it is thinner than `√ε`
//! cells (`ε` of the number type) is left out. Where all samples around a vertex coincide, the fit has no slope,
//! and none is differentiated. [`Cotangent::guarded`] counts both.

mod fit;
mod fit_pullback;
mod forward;
mod pullback;
pub mod rule;
mod shares;
#[cfg(test)]
mod tests;

pub use fit::Fit;
pub use forward::{Scratch, at_vertices, forward};
pub use pullback::{Cotangent, Inputs, pullback};

use super::NO_TRIANGLE;
use crate::neighbors::Neighborhoods;
use crate::{Attribute, Field, Mesh, PointCloud, Real};

/// The samples whose attribute is extended.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a, T> {
    /// Their neighborhoods, which hold the points; the radii in them are not used.
    pub neighborhoods: &'a Neighborhoods<T>,
    /// Least radius `R` of the samples that a vertex takes its value from, in the unit of the points.
    pub radius: T,
    /// `(N,)` area of each, not negative; any common factor makes no difference.
    pub areas: &'a [T],
}

/// The surface, and the grid around it.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a, T> {
    /// The surface itself.
    pub mesh: &'a Mesh<T>,
    /// Signed distance to it.
    pub phi: &'a Field<T>,
    /// `(cells,)` closest face of each cell, or [`NO_TRIANGLE`].
    pub closest: &'a [u32],
}

/// Cells that get values, of those that have a closest face. The width is a distance from the surface above 0, in the
/// unit of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Cells with `|φ|` up to the width.
    Band(f64),
    /// All cells inside, and those outside with `φ` up to the width.
    Inside(f64),
}

impl From<f64> for Region {
    fn from(width: f64) -> Self {
        Self::Band(width)
    }
}

impl Region {
    /// Least and greatest `φ` of its cells.
    ///
    /// # Errors
    /// [`Error::Band`] for a width that is not positive and finite.
    pub fn bounds<T: Real>(self) -> Result<[T; 2], Error> {
        let (Self::Band(width) | Self::Inside(width)) = self;
        if !(width > 0.0) || !width.is_finite() {
            return Err(Error::Band { width });
        }
        let least = match self {
            Self::Band(_) => T::of(-width),
            Self::Inside(_) => T::min_value(),
        };
        Ok([least, T::of(width)])
    }
}

/// An attribute at the vertices of a surface and at the cells around it.
///
/// The cells are a list, as a solver with an immersed boundary goes through them: [`Self::iter`] yields each
/// with its value; [`Self::scatter`] writes them into an array over the whole grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extension<T> {
    /// Components per value.
    pub components: usize,
    /// Cells of the grid along each axis.
    pub shape: [usize; 3],
    /// `(V, components)` at the vertices of the mesh, row by row.
    pub vertices: Vec<T>,
    /// `(B,)` places in memory of the cells in the band, ascending.
    pub cells: Vec<u32>,
    /// `(B, components)` at those cells, row by row.
    pub values: Vec<T>,
}

/// The attribute of a cloud that has a name.
///
/// # Errors
/// [`Error::Missing`].
pub fn attribute<'a, T: Real>(
    cloud: &'a PointCloud<T>,
    name: &str,
) -> Result<&'a Attribute<T>, Error> {
    let attributes = cloud.attributes();
    let missing = || Error::Missing {
        name: name.into(),
        known: attributes.iter().map(|a| a.name.clone()).collect(),
    };
    attributes
        .iter()
        .find(|a| a.name == name)
        .ok_or_else(missing)
}

/// Values that the pullback needs besides the inputs and the list of cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual<T> {
    /// `(V,)` the fit at each vertex.
    pub fits: Vec<Fit>,
    /// `a₀`, in the unit of the areas.
    pub smallest_area: f64,
    /// `(B, 3)` barycentric coordinates of the closest point of each cell in the band.
    pub barycentric: Vec<[T; 3]>,
}

/// Errors of the extension.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The cloud has no attribute of that name.
    #[error("the cloud has no attribute '{name}'; {}", available(.known))]
    Missing {
        /// The requested name.
        name: String,
        /// The names it has.
        known: Vec<String>,
    },
    /// Samples, areas and values differ in number.
    #[error(
        "{areas} areas and {values} values of {components} components for {samples} samples; give one area and one value for each sample, and at least one sample and one component"
    )]
    Samples {
        /// Number of samples in the neighborhoods.
        samples: usize,
        /// Number of areas.
        areas: usize,
        /// Number of values, all components counted.
        values: usize,
        /// Components of the attribute.
        components: usize,
    },
    /// A value of the attribute is NaN or infinite.
    #[error("the attribute of sample {sample} is not finite; correct it, or remove the sample")]
    NotFinite {
        /// Index of the first such sample, from 0.
        sample: usize,
    },
    /// An area is negative, NaN or infinite.
    #[error("the area of sample {sample} is {area}; give a finite area of 0 or more")]
    Area {
        /// Index of the first such sample, from 0.
        sample: usize,
        /// Its area.
        area: f64,
    },
    /// The width of the band is not a positive number.
    #[error(
        "the band has a width of {width}; give a positive, finite length in the unit of the points"
    )]
    Band {
        /// Distance from the surface to the end of the band.
        width: f64,
    },
    /// The closest faces do not match the grid.
    #[error(
        "{entries} closest faces for a grid of {cells} cells; take both from the same call of the distance stage, of a reconstruction with residuals"
    )]
    Closest {
        /// Number of closest faces.
        entries: usize,
        /// Number of cells.
        cells: usize,
    },
    /// A face, or a vertex of it, does not exist.
    #[error(
        "face {face} is not part of the surface; take the closest faces and the mesh from the same reconstruction"
    )]
    Face {
        /// The face.
        face: u32,
    },
    /// Arguments of the pullback have the wrong length.
    #[error(
        "{what} has {length} entries and must have {expected}; give the inputs and outputs of one call of the forward map, and cotangents of its outputs"
    )]
    Mismatch {
        /// The array.
        what: &'static str,
        /// Its length.
        length: usize,
        /// The right length.
        expected: usize,
    },
    /// A cell of the band is outside the grid.
    #[error(
        "the band lists cell {cell} of a grid of {cells} cells; take the extension and the grid from one call"
    )]
    Cell {
        /// The cell.
        cell: u32,
        /// Cells of the grid.
        cells: usize,
    },
    /// An output array has the wrong length.
    #[error("the output has {length} numbers and must have {expected}")]
    Length {
        /// Its length.
        length: usize,
        /// The right length.
        expected: usize,
    },
}

fn available(known: &[String]) -> String {
    match known {
        [] => "it has no attributes at all: read it from a file that has them, or add one".into(),
        _ => format!("it has: {}", known.join(", ")),
    }
}

impl<T: Real> Extension<T> {
    /// Each cell of the band, as its place in memory, with its value of [`Self::components`] numbers.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &[T])> {
        let values = self.values.chunks_exact(self.components.max(1));
        self.cells.iter().map(|&cell| cell as usize).zip(values)
    }

    /// Writes the values into an array `(nx, ny, nz, components)` in C order. Cells outside the band are
    /// left as they are.
    ///
    /// # Errors
    /// [`Error::Length`], and then nothing is written.
    pub fn scatter(&self, dense: &mut [T]) -> Result<(), Error> {
        let expected = self.shape.iter().product::<usize>() * self.components;
        if dense.len() != expected {
            return Err(Error::Length {
                length: dense.len(),
                expected,
            });
        }
        for (cell, value) in self.iter() {
            dense[cell * self.components..][..self.components].copy_from_slice(value);
        }
        Ok(())
    }

    /// Writes the value at a point of a face of `mesh`, the surface of this extension, into `value`, such as at the
    /// closest point of a query. Continuous over the surface.
    ///
    /// # Errors
    /// [`Error::Face`] for a face that does not exist, [`Error::Length`] for another number of components.
    pub fn at(
        &self,
        mesh: &Mesh<T>,
        face: u32,
        barycentric: [T; 3],
        value: &mut [T],
    ) -> Result<(), Error> {
        if value.len() != self.components {
            return Err(Error::Length {
                length: value.len(),
                expected: self.components,
            });
        }
        let corners = mesh
            .faces()
            .get(face as usize)
            .ok_or(Error::Face { face })?;
        if mesh.vertices().len() * self.components != self.vertices.len() {
            return Err(Error::Face { face });
        }
        forward::blend(&self.vertices, *corners, barycentric, value);
        Ok(())
    }
}
