//! The stages after the indicator: the surface, the distance to it, and the checks.

use super::open::Open;
use super::sparse::Sparse;
use super::{Error, Reconstruction, Reconstructor};
use crate::data::Field;
use crate::data::blocks::BlockField;
use crate::data::cells::Cells;
use crate::isosurface::measure;
use crate::report::Warning;
use crate::{Mesh, Real, distance, isosurface, sheet};

impl<T: Real> Reconstructor<T> {
    pub(super) fn isosurface(&mut self) -> Result<(), Error> {
        let is_refined = self.result.residuals.is_refined;
        let Reconstruction {
            indicator,
            sparse,
            iso_value,
            refined,
            mesh,
            report,
            ..
        } = &mut self.result;
        let scratch = &mut self.scratch.isosurface;
        let previous = refined.take();
        if is_refined {
            *refined = Some(isosurface::refine::forward(
                indicator, *iso_value, previous,
            )?);
        }
        let mut found = march(indicator, sparse, refined, *iso_value, scratch, mesh);
        if let (Some(_), Err(isosurface::Error::NothingInside { .. })) = (&refined, &found) {
            // A body far smaller than a cell: the spline does not reach the level, which it has at the samples, at the
            // center of any cell, but some coefficient of it does.
            *refined = None;
            found = march(indicator, sparse, refined, *iso_value, scratch, mesh);
        }
        let found = found?;
        if found.touches_wall {
            report.warnings.push(Warning::TouchesWall);
        }
        self.open()
    }

    pub(super) fn distance(&mut self) -> Result<(), Error> {
        let Reconstruction {
            options,
            indicator,
            sparse,
            refined,
            iso_value,
            mesh,
            open,
            sdf,
            closest,
            ..
        } = &mut self.result;
        let closest = options.residuals.then_some(closest);
        if !options.sdf && open.is_none() {
            sdf.values_mut().fill(T::zero());
            if let Some(closest) = closest {
                closest.clear();
                closest.resize(sdf.values().len(), distance::NO_TRIANGLE);
            }
            return Ok(());
        }
        if let (Some(open), Some(thickness)) = (open, options.sheet.thickness()) {
            let scratch = &mut self.scratch.distance;
            let (sheet, mut unused) = (open.trimmed(), Vec::new());
            let closest = closest.unwrap_or(&mut unused);
            sheet::forward(sheet, thickness, options.band, scratch, sdf, closest)?;
            return Ok(());
        }
        distance::lattice::forward_on(
            mesh,
            marched(indicator, sparse, refined),
            *iso_value,
            options.band,
            &mut self.scratch.distance,
            sdf,
            closest,
        )?;
        Ok(())
    }

    /// Measures the result and checks whether it can be trusted.
    pub(super) fn check(&mut self) {
        let options = &self.result.options;
        if !options.checks || !options.sdf {
            return;
        }
        let Reconstruction {
            points,
            sdf,
            mesh,
            open,
            orientation,
            residuals,
            report,
            ..
        } = &mut self.result;
        let neighborhoods = &residuals.neighborhoods;
        let scratch = &mut self.scratch.measure;
        match open.as_deref() {
            Some(open) if open.is_sheet() => {
                let normals = &orientation.normals;
                let built = &self.scratch.distance;
                report.check_sheet(points, normals, sdf, open.trimmed(), built);
            }
            _ => {
                report.check_field(
                    [points, &orientation.normals],
                    neighborhoods,
                    sdf,
                    mesh,
                    scratch,
                    Some(&self.scratch.distance),
                );
            }
        }
        if let Some(open) = open {
            report.surface = measure::measure(open.mesh(), scratch);
        }
        let is_sheet = open.as_deref().is_some_and(Open::is_sheet);
        report.check_samples(points, neighborhoods, orientation, is_sheet);
    }
}

impl<T: Real> Reconstruction<T> {
    /// The indicator whose surface the mesh is.
    pub(super) fn marched(&self) -> Cells<'_, T> {
        marched(&self.indicator, &self.sparse, &self.refined)
    }
}

/// [`Reconstruction::marched`].
fn marched<'a, T: Real>(
    indicator: &'a Field<T>,
    sparse: &'a Option<Sparse<T>>,
    refined: &'a Option<BlockField<T>>,
) -> Cells<'a, T> {
    match (refined, sparse) {
        (Some(refined), _) => refined.into(),
        (None, Some(sparse)) => (&sparse.chi).into(),
        (None, None) => indicator.into(),
    }
}

fn march<T: Real>(
    indicator: &Field<T>,
    sparse: &Option<Sparse<T>>,
    refined: &Option<BlockField<T>>,
    level: T,
    scratch: &mut isosurface::Scratch,
    mesh: &mut Mesh<T>,
) -> Result<isosurface::Report, isosurface::Error> {
    use isosurface::{blocks, refine};
    match (refined, sparse) {
        (Some(refined), _) => {
            let place = |edge| refine::on_edge(indicator, &refined.grid, level, edge);
            blocks::forward(refined, level, &place, mesh)
        }
        (None, Some(sparse)) => {
            let chi = &sparse.chi;
            blocks::forward(chi, level, &|edge| blocks::linear(chi, level, edge), mesh)
        }
        (None, None) => isosurface::forward(indicator, level, scratch, mesh),
    }
}
