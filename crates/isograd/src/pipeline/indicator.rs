//! The stage between the splat and the surface: the indicator and its level.

use super::{Error, Reconstruction, Reconstructor};
use crate::data::cells::CellsMut;
use crate::isosurface::{self, Interpolation, Level, local_level};
use crate::poisson::screened;
use crate::{Real, splat};

impl<T: Real> Reconstructor<T> {
    /// The indicator and the level of its surface.
    pub(super) fn solve(&mut self) -> Result<(), Error> {
        let smoothing = self.result.residuals.smoothing;
        if self.result.sparse.is_some() {
            self.result.report.smoothing = smoothing;
            return self.solve_in_blocks(smoothing);
        }
        let Reconstruction {
            poisson,
            indicator,
            report,
            ..
        } = &mut self.result;
        report.smoothing = smoothing;
        poisson.solve(indicator.values_mut(), smoothing, &mut self.scratch.poisson)?;
        if self.result.options.screening > 0.0 {
            self.screen()?;
        }
        self.level()
    }

    /// The solution of the screened equation, from that of the plain one.
    fn screen(&mut self) -> Result<(), Error> {
        let is_refined = self.result.residuals.is_refined;
        let Reconstruction {
            options,
            poisson,
            points,
            orientation,
            areas,
            indicator,
            residuals,
            ..
        } = &mut self.result;
        let grid = *indicator.grid();
        let equation = screened::Equation {
            plan: poisson,
            grid: &grid,
            samples: splat::SortedSamples {
                samples: (residuals.thickened).samples(points, &orientation.normals, areas),
                order: &residuals.splat,
            },
            area: options.area,
            screening: options.screening,
        };
        screened::forward(
            &equation,
            indicator.values_mut(),
            &mut self.scratch.screened,
        )?;
        if !is_refined {
            residuals.screened = None;
            return Ok(());
        }
        let (points, chi) = (equation.samples.samples.points, (&*indicator).into());
        let values = residuals.screened.get_or_insert_with(Default::default);
        isosurface::iso_value::forward_on(chi, points, areas, Interpolation::Linear, values)?;
        Ok(())
    }

    /// The iso-value, and the indicator relative to the local one.
    pub(super) fn level(&mut self) -> Result<(), Error> {
        let interpolation = match self.result.residuals.is_refined {
            true => Interpolation::Spline,
            false => Interpolation::Linear,
        };
        let Reconstruction {
            options,
            points,
            orientation,
            areas,
            indicator,
            sparse,
            iso_value,
            residuals,
            report,
            ..
        } = &mut self.result;
        let samples = (residuals.thickened).samples(points, &orientation.normals, areas);
        let level = &mut residuals.iso_value;
        let chi = match sparse {
            Some(sparse) => CellsMut::Blocks(&mut sparse.chi),
            None => {
                let (grid, values) = indicator.split_mut();
                CellsMut::Dense(grid, values)
            }
        };
        let points = samples.points;
        *iso_value =
            isosurface::iso_value::forward_on(chi.cells(), points, areas, interpolation, level)?;
        report.iso_value = iso_value.f64();
        if options.level != Level::Mean {
            local_level::forward_on(
                chi,
                splat::SortedSamples {
                    samples,
                    order: &residuals.splat,
                },
                local_level::Options {
                    area: options.area,
                    smoothing: residuals.smoothing,
                    thin: options.level == Level::Thin,
                },
                level,
                &mut self.scratch.level,
                &mut residuals.local_level,
            );
        }
        Ok(())
    }
}
