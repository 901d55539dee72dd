//! Target of a fit: a signed distance field, given as a field, a mesh or a cloud.

use isograd::distance::Query;
use isograd::isosurface::{self, measure};
use isograd::{Field, Grid, Mesh, PointCloud, Reconstructor};

use crate::problem::fixed;

/// Query points per call, to bound memory.
const BATCH: usize = 1 << 18;

/// A field and its zero surface.
#[derive(Clone, Debug)]
pub struct Target {
    sdf: Field<f64>,
    surface: Mesh<f64>,
}

/// Errors of a target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// A value is NaN or infinite.
    #[error("the target's value {index} is not finite; correct the field")]
    NotFinite {
        /// Index of the first such value.
        index: usize,
    },
    /// No cell or every cell is inside.
    #[error(
        "the target has no surface: all its {cells} cells are on one side of 0; φ must be negative inside"
    )]
    NoSurface {
        /// Number of cells.
        cells: usize,
    },
    /// The band has no cells.
    #[error("no cell lies within {cells} cells of the target's surface; make the band wider")]
    EmptyBand {
        /// Half the width of the band, in cells.
        cells: f64,
    },
    /// The mesh has holes.
    #[error(
        "the target mesh is not closed, so its inside is undefined; close it, or give its vertices as a cloud"
    )]
    Open,
    /// The distances to the mesh failed.
    #[error(transparent)]
    Distance(#[from] isograd::distance::Error),
    /// The surface of the field failed.
    #[error(transparent)]
    Isosurface(#[from] isosurface::Error),
    /// The reconstruction of the cloud failed.
    #[error("the target cloud: {0}")]
    Reconstruct(#[from] isograd::Error),
}

impl Target {
    /// A field of signed distances, negative inside; its grid becomes the grid of the fit.
    ///
    /// # Errors
    /// Values that are not finite, or all of one sign.
    pub fn from_sdf(sdf: Field<f64>) -> Result<Self, TargetError> {
        if let Some(index) = sdf.values().iter().position(|v| !v.is_finite()) {
            return Err(TargetError::NotFinite { index });
        }
        let inside = sdf.values().iter().filter(|v| **v < 0.0).count();
        let cells = sdf.grid().cells();
        if inside == 0 || inside == cells {
            return Err(TargetError::NoSurface { cells });
        }
        let mut surface = Mesh::default();
        let mut scratch = isosurface::Scratch::default();
        isosurface::forward(&sdf, 0.0, &mut scratch, &mut surface)?;
        Ok(Self { sdf, surface })
    }

    /// The exact signed distance of a closed mesh on `grid`.
    ///
    /// # Errors
    /// A mesh with holes, or without faces; a grid that misses it.
    pub fn from_mesh(mesh: Mesh<f64>, grid: Grid<f64>) -> Result<Self, TargetError> {
        let query = Query::new(mesh)?;
        if !measure::measure(query.mesh(), &mut measure::Scratch::default()).closed {
            return Err(TargetError::Open);
        }
        let mut values = Vec::with_capacity(grid.cells());
        let mut centers = Vec::new();
        for start in (0..grid.cells()).step_by(BATCH) {
            centers.clear();
            let cells = start..grid.cells().min(start + BATCH);
            centers.extend(cells.map(|i| grid.center(grid.cell(i))));
            values.extend(query.query(&centers, None).iter().map(|hit| hit.distance));
        }
        let mut field = Field::zeros(grid);
        field.values_mut().copy_from_slice(&values);
        Self::from_sdf(field)
    }

    /// The reconstruction of a cloud on `grid`: the best match for a fit with the same options.
    ///
    /// # Errors
    /// Errors of the reconstruction.
    pub fn from_cloud(
        cloud: &PointCloud<f64>,
        grid: Grid<f64>,
        options: &isograd::Options,
    ) -> Result<Self, TargetError> {
        let mut plan = Reconstructor::new(grid, fixed(options))?;
        plan.reconstruct(cloud)?;
        Self::from_sdf(plan.into_reconstruction().sdf().clone())
    }

    /// The field.
    pub fn sdf(&self) -> &Field<f64> {
        &self.sdf
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<f64> {
        self.sdf.grid()
    }

    /// The surface on which the field is 0.
    pub fn surface(&self) -> &Mesh<f64> {
        &self.surface
    }
}

#[cfg(test)]
mod tests {
    use isograd_shapes::{Sampling, by_name};

    use super::*;

    fn grid() -> Grid<f64> {
        Grid::new([-0.8; 3], 0.05, [32, 33, 34]).expect("valid")
    }

    fn worst(target: &Target) -> f64 {
        let sphere = by_name("sphere").expect("a shape");
        let grid = target.grid();
        let off = |i: usize| {
            let exact = sphere.distance(grid.center(grid.cell(i))).expect("known");
            (target.sdf().values()[i] - exact).abs() / grid.spacing()
        };
        (0..grid.cells()).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn the_three_kinds_of_target_agree_on_a_sphere() {
        let sphere = by_name("sphere").expect("a shape");
        let samples = sphere
            .sample::<f64>(4000, &Sampling::default(), 1)
            .expect("samples");
        let options = isograd::Options::default();
        let of_cloud = Target::from_cloud(&samples.cloud, grid(), &options).expect("a target");
        // The error of the reconstruction, 20 cells across the sphere.
        assert!(worst(&of_cloud) < 0.1, "{}", worst(&of_cloud));
        let of_mesh = Target::from_mesh(of_cloud.surface().clone(), grid()).expect("a target");
        assert!(worst(&of_mesh) < 0.15, "{}", worst(&of_mesh));
        let again = Target::from_sdf(of_mesh.sdf().clone()).expect("a target");
        assert_eq!(again.surface(), of_mesh.surface());
    }

    #[test]
    fn targets_without_a_surface_are_refused() {
        let positive = Field::new(grid(), vec![1.0; grid().cells()]).expect("as many");
        assert!(matches!(
            Target::from_sdf(positive),
            Err(TargetError::NoSurface { .. })
        ));
        let bad = Field::new(grid(), vec![f64::NAN; grid().cells()]).expect("as many");
        assert!(matches!(
            Target::from_sdf(bad),
            Err(TargetError::NotFinite { index: 0 })
        ));
        let triangle = Mesh::new(
            vec![[0.0; 3], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]],
            vec![[0, 1, 2]],
        );
        assert!(matches!(
            Target::from_mesh(triangle.expect("a mesh"), grid()),
            Err(TargetError::Open)
        ));
        assert!(Target::from_mesh(Mesh::default(), grid()).is_err());
    }
}
