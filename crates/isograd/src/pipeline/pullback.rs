//! Pullback of the pipeline: cotangents of its results → cotangents of its inputs.

mod scratch;

use std::sync::PoisonError;

use super::sparse::Bars;
use super::{CloudCotangent, Cotangent, Pipeline, PullbackError, Reconstruction, Residuals};
use crate::data::GridCotangent;
use crate::data::blocks::BlockField;
use crate::data::cells::CellsMut;
use crate::distance::extend;
use crate::isosurface::{Level, local_level};
use crate::large::is_large;
use crate::neighbors::RadiiCotangent;
use crate::orient::Method;
use crate::poisson::screened;
use crate::splat::{SampleCotangent, SortedSamples};
use crate::{
    Real, isosurface, neighbors, normals, orient, parallel, poisson, refine, splat, vector,
};
pub use scratch::PullbackScratch;
pub(super) use scratch::Workspace;

impl<T: Pipeline> Reconstruction<T> {
    /// Cotangents of the samples and of the grid, from cotangents of any of the results: the transpose of the derivative
    /// of the whole pipeline, stage by stage in reverse.
    ///
    /// Held constant, as the stages say: signs of the normals, which cells are inside, which face is closest. A derivative
    /// without a bound is replaced by a bounded one, one that the number type cannot hold by the nearest number that it can,
    /// or 0; both are counted in [`CloudCotangent::guarded`]. The result has the same bits for any number of threads.
    ///
    /// # Errors
    /// As [`PullbackError`] lists.
    pub fn pullback(
        &self,
        cotangent: &Cotangent<'_, T>,
    ) -> Result<CloudCotangent<T>, PullbackError> {
        let mut out = CloudCotangent::default();
        T::pull(self, cotangent, &mut PullbackScratch::default(), &mut out)?;
        Ok(out)
    }

    /// Like [`pullback`](Self::pullback), writing into `out`. The scratch buffers of up to a million samples stay with
    /// the reconstruction, or with the plan that holds it: a second call then allocates nothing of the size of a field.
    ///
    /// # Errors
    /// As [`pullback`](Self::pullback); `out` is then not to be used.
    pub fn pullback_into(
        &self,
        cotangent: &Cotangent<'_, T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        let buffers = || {
            self.pullback
                .0
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        let mut scratch = buffers().take().unwrap_or_default();
        let done = T::pull(self, cotangent, &mut scratch, out);
        *buffers() = (!is_large(self.points.len())).then_some(scratch);
        done
    }
}

impl<T: Real> Reconstruction<T> {
    /// The pullback of cotangents that were [checked](Cotangent::check). Numbers may overflow.
    pub(super) fn pull_plain(
        &self,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        scratch.start(cotangent, self.points.len(), self.mesh.vertices().len());
        let mut of_mesh = GridCotangent::default();
        out.guarded = 0;
        if let Some(bars) = cotangent.vertices {
            let PullbackScratch {
                vertices, distance, ..
            } = scratch;
            (of_mesh, out.guarded) = self.pull_mesh(bars, distance, vertices);
        }
        let ratio = self.surface_grid().spacing().f64() / self.sdf.grid().spacing().f64();
        self.pull_extensions(cotangent, scratch, out)?;
        if cotangent.reaches_indicator() {
            self.pull_distance(cotangent, scratch);
            // From the grid of φ to that of the surface, and back at the end.
            let of_sdf = scratch.samples.grid.lower;
            scratch.samples.grid.spacing /= ratio;
            scratch.samples.grid.add(&of_mesh);
            self.pull_thickened(scratch, |scratch| {
                self.pull_indicator(cotangent, scratch, out)
            })?;
            let of_surface = vector::sub(scratch.samples.grid.lower, of_sdf);
            scratch.samples.grid.spacing *= ratio;
            scratch.samples.grid.spacing += vector::dot(of_surface, self.surface_offset());
        }
        if is_large(self.points.len()) {
            scratch.free_indicator();
        }
        self.pull_samples(scratch, out);
        out.grid = GridCotangent {
            lower: vector::of_f64(scratch.samples.grid.lower),
            spacing: T::of(scratch.samples.grid.spacing),
        };
        Ok(())
    }

    /// From extended attributes to the attributes themselves, and to vertices, points, areas and grid.
    fn pull_extensions(
        &self,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        out.attributes.truncate(cotangent.extensions.len());
        out.attributes
            .resize_with(cotangent.extensions.len(), Vec::new);
        let PullbackScratch {
            extension: found,
            vertices,
            samples,
            radii,
            ..
        } = scratch;
        for (of, attribute) in cotangent.extensions.iter().zip(&mut out.attributes) {
            let inputs = extend::Inputs {
                samples: self.samples(),
                attribute: of.attribute,
                surface: self.surface(),
                residual: of.residual,
                extension: of.extension,
                vertices_bar: of.vertices,
                values_bar: of.values,
            };
            extend::pullback(&inputs, found)?;
            attribute.clone_from(&found.attribute);
            self.pull_distance_mesh(&found.vertices, vertices);
            add(&mut samples.points, &found.points, vector::add);
            add(&mut samples.areas, &found.areas, |a, b| a + b);
            samples.grid.add(&GridCotangent {
                lower: vector::to_f64(found.grid.lower),
                spacing: found.grid.spacing.f64(),
            });
            match self.extends_within_cells() {
                true => samples.grid.spacing += found.radius / self.sdf.grid().spacing().f64(),
                false => radii.add_common(found.radius),
            }
            out.guarded += found.guarded;
        }
        Ok(())
    }

    /// From φ to the vertices.
    fn pull_distance(&self, cotangent: &Cotangent<'_, T>, scratch: &mut PullbackScratch<T>) {
        let Some(sdf) = cotangent.sdf else { return };
        let PullbackScratch {
            vertices,
            samples,
            distance,
            ..
        } = scratch;
        samples.grid.add(&self.pull_sdf(sdf, distance, vertices));
    }

    /// From the vertices, the indicator and the iso-value to points, normals and areas.
    fn pull_indicator(
        &self,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        let (chi, residuals) = (self.chi(), &self.residuals);
        let mut bars = match &self.sparse {
            Some(sparse) => Bars::Blocks(sparse.zeros()),
            None => Bars::Dense(scratch.take_field(&self.indicator, cotangent.indicator)),
        };
        let PullbackScratch {
            vertices,
            samples,
            radii,
            ..
        } = scratch;
        let found = self.pull_vertices(vertices, bars.cells_mut());
        samples.grid.add(&found.grid);
        out.guarded += found.guarded;
        let given = self.splat_samples();
        let mut level_bar = cotangent.iso_value.f64() + found.level;
        let mut smoothing_bar = 0.0;
        scratch.level_bars.values.clear();
        let sorted = SortedSamples {
            samples: given,
            order: &residuals.splat,
        };
        if self.options.level != Level::Mean {
            local_level::pullback_on(
                chi,
                sorted,
                &residuals.local_level,
                bars.cells_mut(),
                &mut scratch.level,
                &mut scratch.level_bars,
                samples,
            );
            level_bar += scratch.level_bars.level;
            smoothing_bar = scratch.level_bars.smoothing;
        }
        isosurface::iso_value::pullback_on(
            sorted,
            &residuals.iso_value,
            T::of(level_bar),
            &scratch.level_bars.values,
            bars.cells_mut(),
            samples,
        );
        smoothing_bar += self.pull_screening(sorted, &mut bars, &mut scratch.screened, samples)?;
        let smoothing = residuals.smoothing;
        if self.options.smoothing_follows() {
            smoothing_bar += self.smoothing_bar(&bars, &scratch.level);
            self.pull_smoothing(smoothing_bar, samples, radii);
        }
        match (&mut bars, &self.sparse) {
            (Bars::Blocks(field), Some(sparse)) => {
                sparse.solve(&mut field.values, smoothing)?;
            }
            (Bars::Dense(field), _) => {
                let buffers = &mut scratch.poisson;
                self.poisson.solve(field.values_mut(), smoothing, buffers)?;
            }
            _ => {}
        }
        let buffers = &mut scratch.splat;
        splat::pullback_on(given, &residuals.splat, bars.cells(), buffers, samples);
        if let Bars::Dense(field) = bars {
            scratch.field = Some(field);
        }
        Ok(())
    }

    /// From the vertices to the indicator, its level and the grid of the surface.
    fn pull_vertices(
        &self,
        vertices: &[[T; 3]],
        chi_bar: CellsMut<'_, T>,
    ) -> isosurface::LevelCotangent {
        let mesh = &self.mesh;
        match (&self.refined, chi_bar) {
            (Some(BlockField { grid, .. }), CellsMut::Dense(_, chi_bar)) => {
                isosurface::refine::pullback(
                    &self.indicator,
                    self.iso_value,
                    grid,
                    mesh,
                    vertices,
                    chi_bar,
                )
            }
            (_, chi_bar) => {
                isosurface::pullback_on(self.chi(), self.iso_value, mesh, vertices, chi_bar)
            }
        }
    }

    /// From the screened solution to the plain one, and the part of the smoothing's cotangent that
    /// [`smoothing_bar`](Self::smoothing_bar) leaves out.
    fn pull_screening(
        &self,
        sorted: SortedSamples<'_, T>,
        bars: &mut Bars<T>,
        scratch: &mut screened::Scratch<T>,
        samples: &mut SampleCotangent<T>,
    ) -> Result<f64, PullbackError> {
        let (true, Bars::Dense(field)) = (self.options.screening > 0.0, bars) else {
            return Ok(0.0);
        };
        let (equation, residuals) = (self.screened_equation(sorted), &self.residuals);
        let level = residuals.screened.as_ref();
        let level = level.unwrap_or(&residuals.iso_value);
        screened::pullback(&equation, level, field.values_mut(), scratch, samples)?;
        if !self.options.smoothing_follows() {
            return Ok(0.0);
        }
        let (width, plain_bar) = (residuals.smoothing, field.values());
        let found = screened::smoothing_pullback(&equation, level, width, plain_bar, scratch)?;
        Ok(found)
    }

    /// The cotangent of the smoothing for that of the indicator before anything was taken off it.
    fn smoothing_bar(&self, bars: &Bars<T>, level: &local_level::PullbackScratch<T>) -> f64 {
        let is_local = self.options.level != Level::Mean;
        let bars = match (bars, &self.sparse) {
            (Bars::Blocks(bars), Some(sparse)) => {
                let mut chi = sparse.chi.clone();
                if is_local {
                    level.add_corrections(&mut chi);
                }
                let smoothing = self.residuals.smoothing;
                return poisson::smoothing::pullback_in_blocks(smoothing, &chi, bars);
            }
            (bars, _) => bars.cells().values(),
        };
        let (chi, smoothing) = (&self.indicator, self.residuals.smoothing);
        let plan = &self.poisson;
        let whole = poisson::smoothing::pullback(plan, smoothing, chi.values(), bars);
        if !is_local {
            return whole;
        }
        let taken = level.sum_of_corrections(chi.grid(), |start, part| {
            poisson::smoothing::laplacian_dot(plan, bars, start, part)
        });
        whole + smoothing * taken
    }

    /// From the smoothing, which goes with the distance between samples, to what that is measured by, and to the cell size.
    pub(super) fn pull_smoothing(
        &self,
        bar: f64,
        samples: &mut SampleCotangent<T>,
        radii: &mut RadiiCotangent,
    ) {
        let by_logarithm = bar * self.residuals.smoothing;
        if self.options.area {
            let (mean, count) = splat::area::mean(&self.areas);
            if !(mean > 0.0) {
                return;
            }
            let share = T::of(0.5 * by_logarithm / (mean * count as f64));
            parallel::for_each(&mut samples.areas, |_, area| *area += share);
        } else {
            radii.add_spacing(by_logarithm);
        }
        samples.grid.spacing -= by_logarithm / self.surface_grid().spacing().f64();
    }

    fn screened_equation<'a>(&'a self, samples: SortedSamples<'a, T>) -> screened::Equation<'a, T> {
        screened::Equation {
            plan: &self.poisson,
            grid: self.indicator.grid(),
            samples,
            area: self.options.area,
            screening: self.options.screening,
        }
    }

    /// From points, normals and areas to the points alone, or the given normals.
    fn pull_samples(&self, scratch: &mut PullbackScratch<T>, out: &mut CloudCotangent<T>) {
        let Residuals {
            neighborhoods,
            normals: axes,
            ..
        } = &self.residuals;
        let SampleCotangent {
            points,
            normals: normals_bar,
            areas,
            ..
        } = &mut scratch.samples;
        out.normals.clear();
        let radii_bar = &mut scratch.radii;
        match self.options.orient {
            Method::Given => {
                out.guarded += orient::given_pullback(&self.given, normals_bar);
                out.normals.extend_from_slice(normals_bar);
            }
            _ => {
                let outward = &mut scratch.outward;
                let refined = &self.orientation.normals;
                outward.clone_from(&axes.normals);
                orient::axes_pullback(refined, &axes.normals, outward);
                let of_refinement = &mut scratch.refine;
                refine::pullback(
                    neighborhoods,
                    outward,
                    normals_bar,
                    of_refinement,
                    points,
                    radii_bar,
                );
                if is_large(self.points.len()) {
                    *of_refinement = refine::PullbackScratch::default();
                }
                orient::axes_pullback(refined, &axes.normals, normals_bar);
                let scratch = &mut scratch.normals;
                out.guarded +=
                    normals::pullback(neighborhoods, axes, normals_bar, scratch, points, radii_bar);
            }
        }
        if self.options.area {
            splat::area::pullback(
                neighborhoods,
                &self.areas,
                areas,
                &mut scratch.areas,
                points,
                radii_bar,
            );
        }
        neighbors::pullback(neighborhoods, radii_bar, points);
        out.points.clear();
        out.points.extend_from_slice(points);
    }
}

/// Adds `more` to `sums`, entry by entry.
fn add<E: Copy>(sums: &mut [E], more: &[E], plus: impl Fn(E, E) -> E) {
    for (sum, &more) in sums.iter_mut().zip(more) {
        *sum = plus(*sum, more);
    }
}
