//! The stages in reverse: cotangents of any of the results to those of points and grid.

use cubecl::prelude::*;
use isograd::poisson::Smoothing;

use super::{Error, Reconstruction, Reconstructor, Source, held};
use crate::device::{check_length, launch};
use crate::distance::extend;
use crate::isosurface::{self, iso_value, local_level as local};
use crate::poisson::screened;
use crate::primitives::fill::{add, zeros};
use crate::primitives::flags;
use crate::splat::{self, SampleCotangent, area};
use crate::{Buffer, Device, Scalar, distance, normals, orient, poisson, refine};

/// Cotangents of the results of a reconstruction: by how much a scalar (a loss) changes, a unit of each
/// result. What is left out counts as zero.
#[derive(Clone, Copy, Debug)]
pub struct Cotangent<'a, T> {
    /// `(nx, ny, nz)` of φ, in memory order.
    pub sdf: Option<&'a Buffer<T>>,
    /// `(nx, ny, nz)` of the indicator χ.
    pub indicator: Option<&'a Buffer<T>>,
    /// `(1,)` of the iso-value.
    pub iso_value: Option<&'a Buffer<T>>,
    /// `(V, 3)` of the vertices of the surface.
    pub vertices: Option<&'a Buffer<T>>,
    /// `(N, 3)` of the outward normals of the samples.
    pub normals: Option<&'a Buffer<T>>,
    /// `(N,)` of the areas of the samples.
    pub areas: Option<&'a Buffer<T>>,
    /// Of attributes extended from the samples.
    pub extensions: &'a [ExtensionCotangent<'a, T>],
}

/// Cotangents of one attribute that was [extended](Reconstructor::extend).
#[derive(Clone, Copy, Debug)]
pub struct ExtensionCotangent<'a, T> {
    /// The attribute, as it was given.
    pub attribute: extend::Attribute<'a, T>,
    /// The extended attribute.
    pub extension: &'a extend::Extension<T>,
    /// Its residual.
    pub residual: &'a extend::Residual<T>,
    /// `(V, components)` of the values at the vertices.
    pub vertices: Option<&'a Buffer<T>>,
    /// `(B, components)` of the values at the cells of the band.
    pub values: Option<&'a Buffer<T>>,
}

impl<T> Default for Cotangent<'_, T> {
    fn default() -> Self {
        Self {
            sdf: None,
            indicator: None,
            iso_value: None,
            vertices: None,
            normals: None,
            areas: None,
            extensions: &[],
        }
    }
}

impl<T> Cotangent<'_, T> {
    /// Whether anything beyond the normals and areas of the samples has a cotangent.
    fn reaches_indicator(&self) -> bool {
        let fields = [self.sdf, self.indicator, self.iso_value, self.vertices];
        fields.iter().any(Option::is_some) || !self.extensions.is_empty()
    }
}

/// Cotangents of what a reconstruction was made from.
#[derive(Clone, Debug)]
pub struct CloudCotangent<T> {
    /// `(N, 3)` of the points, at fixed radii.
    pub points: Buffer<T>,
    /// `(N,)` of the radii, times these, for [`isograd::neighbors::pullback`]: those that areas are found with.
    pub radii: Buffer<T>,
    /// `(N,)` of the radii, times these, that axes are found with; none where normals were given.
    pub axis_radii: Option<Buffer<T>>,
    /// `(1,)` of the radius of extensions, times it: of the common radius or, where it is larger, of the cell size, whose
    /// part of [`grid`](Self::grid) this is not in. None where nothing was extended.
    pub extension_radius: Option<Buffer<T>>,
    /// `(1,)` of the distance between samples, times it: where the smoothing goes with that, and not with areas.
    pub spacing: Option<Buffer<T>>,
    /// `(N, 3)` of the given normals; none where the normals were found.
    pub normals: Option<Buffer<T>>,
    /// Of each extended attribute, `(N, components)`, in the order of [`Cotangent::extensions`].
    pub attributes: Vec<Buffer<T>>,
    /// `(4,)` of the low corner of the grid and of its cell size, at fixed points.
    pub grid: Buffer<T>,
    /// `(1,)` vertices, and cells of extensions, whose derivative has no bound or does not exist, and a bounded one was
    /// taken; none where none was asked for.
    pub guarded: Option<Buffer<u32>>,
}

/// Cotangents of the extensions.
struct Extended<T> {
    attributes: Vec<Buffer<T>>,
    /// None where nothing was extended.
    vertices: Option<Buffer<T>>,
    radius: Option<Buffer<T>>,
    guarded: Vec<Buffer<u32>>,
}

impl<R: Runtime, T: Scalar> Reconstructor<R, T> {
    /// Pulls cotangents of any of the results of this plan back to the points, the extended attributes and the grid.
    ///
    /// # Errors
    /// A cotangent of another length than its result, what [`Self::extend`] refuses, or [`crate::Error::TooLarge`].
    pub fn pullback(
        &self,
        result: &Reconstruction<T>,
        cotangent: &Cotangent<'_, T>,
    ) -> Result<CloudCotangent<T>, Error> {
        let (device, residuals) = (&self.device, &result.residuals);
        let bars = SampleCotangent::zeros(device, result.areas.len())?;
        for (given, sum) in [
            (cotangent.normals, &bars.normals),
            (cotangent.areas, &bars.areas),
        ] {
            if let Some(given) = given {
                add(device, given, sum)?;
            }
        }
        let mut extended = self.pull_extensions(result, cotangent, &bars)?;
        let mut spacing = None;
        if cotangent.reaches_indicator() {
            let vertices_bar = self.pull_distance(result, cotangent, &extended, &bars)?;
            let guarded;
            (guarded, spacing) = self.pull_indicator(result, cotangent, &vertices_bar, &bars)?;
            extended.guarded.push(guarded);
        }
        let guarded = match &extended.guarded[..] {
            [] => None,
            [one] => Some(one.clone()),
            all => Some(flags::sum_of_all(device, &all.iter().collect::<Vec<_>>())?),
        };
        let radii = zeros(device, result.areas.len())?;
        let (given, axis_radii) = match &residuals.normals {
            Source::Axes {
                axes,
                outward,
                refined,
                residual,
            } => {
                let mut normals_bar = bars.normals;
                if let Some(refined) = refined {
                    let [points, before, of_radii] =
                        refine::pullback(device, refined, &normals_bar)?;
                    add(device, &points, &bars.points)?;
                    add(device, &of_radii, &radii)?;
                    normals_bar = before;
                }
                let axes_bar = held::turn(device, &normals_bar, axes, outward)?;
                let (by_axes, of_radii) = normals::pullback(device, residual, &axes_bar)?;
                add(device, &by_axes, &bars.points)?;
                (None, Some(of_radii))
            }
            Source::Given(given) => {
                let given = orient::given::pullback(device, given, &bars.normals)?;
                (Some(given), None)
            }
        };
        if let Some(areas) = &residuals.areas {
            let (by_areas, of_radii) = area::pullback(device, areas, &bars.areas)?;
            add(device, &by_areas, &bars.points)?;
            add(device, &of_radii, &radii)?;
        }
        Ok(CloudCotangent {
            points: bars.points,
            radii,
            axis_radii,
            extension_radius: extended.radius,
            spacing,
            normals: given,
            attributes: extended.attributes,
            grid: bars.grid,
            guarded,
        })
    }

    /// From extended attributes to the attributes themselves, and to vertices, points, areas and grid.
    fn pull_extensions(
        &self,
        result: &Reconstruction<T>,
        cotangent: &Cotangent<'_, T>,
        bars: &SampleCotangent<T>,
    ) -> Result<Extended<T>, Error> {
        let device = &self.device;
        let mut out = Extended {
            attributes: Vec::new(),
            vertices: None,
            radius: None,
            guarded: Vec::new(),
        };
        for of in cotangent.extensions {
            let found = extend::pullback(
                device,
                result.extended_samples(),
                of.attribute,
                result.extended_surface(),
                of.residual,
                of.extension,
                of.vertices,
                of.values,
            )?;
            add(device, &found.points, &bars.points)?;
            add(device, &found.areas, &bars.areas)?;
            add(device, &found.grid, &bars.grid)?;
            add_or_set(device, &mut out.vertices, found.vertices)?;
            add_or_set(device, &mut out.radius, found.radius)?;
            out.attributes.push(found.attribute);
            out.guarded.push(found.guarded);
        }
        Ok(out)
    }

    /// From the vertices, the indicator and the iso-value to samples and grid: how many vertices were guarded, and
    /// [`CloudCotangent::spacing`].
    fn pull_indicator(
        &self,
        result: &Reconstruction<T>,
        cotangent: &Cotangent<'_, T>,
        vertices_bar: &Buffer<T>,
        bars: &SampleCotangent<T>,
    ) -> Result<(Buffer<u32>, Option<Buffer<T>>), Error> {
        let (device, residuals) = (&self.device, &result.residuals);
        let samples = result.samples();
        let isosurface::Cotangent {
            chi,
            level,
            grid,
            guarded,
        } = isosurface::pullback(device, &residuals.surface, vertices_bar)?;
        add(device, &grid, &bars.grid)?;
        for (given, sum) in [(cotangent.indicator, &chi), (cotangent.iso_value, &level)] {
            if let Some(given) = given {
                add(device, given, sum)?;
            }
        }
        let local = match &residuals.local_level {
            Some(residual) => {
                let (splat, after) = (&residuals.splat, &result.indicator);
                let found = local::pullback(device, residual, splat, samples, after, &chi, bars)?;
                add(device, &found.level, &level)?;
                Some(found)
            }
            None => None,
        };
        iso_value::pullback(
            device,
            &residuals.iso_value,
            &residuals.splat,
            samples,
            &level,
            local.as_ref().map(|found| &found.values),
            &chi,
            bars,
        )?;
        if self.options.screening > 0.0 {
            let equation = self.screened_equation(samples, &residuals.splat);
            screened::pullback(device, &equation, &residuals.iso_value, &chi, bars)?;
        }
        let spacing = self.pull_smoothing(result, local, &chi, bars)?;
        let b_bar = self.solver.solve(device, &chi, residuals.smoothing.cells)?;
        drop(chi);
        splat::pullback(device, &residuals.splat, samples, &b_bar, bars)?;
        Ok((guarded, spacing))
    }

    /// The cotangent of the vertices, and to the grid what φ has for it.
    fn pull_distance(
        &self,
        result: &Reconstruction<T>,
        cotangent: &Cotangent<'_, T>,
        extended: &Extended<T>,
        bars: &SampleCotangent<T>,
    ) -> Result<Buffer<T>, Error> {
        let (device, count) = (&self.device, result.surface.vertices.len());
        if let Some(given) = cotangent.vertices {
            check_length("the cotangent of the vertices", given, count)?;
        }
        let sum = match cotangent.sdf {
            Some(sdf) => {
                let found = distance::lattice::pullback(device, &result.residuals.distance, sdf)?;
                add(device, &found.grid, &bars.grid)?;
                found.vertices
            }
            None => zeros(device, count)?,
        };
        let parts = [cotangent.vertices, extended.vertices.as_ref()];
        for part in parts.into_iter().flatten() {
            add(device, part, &sum)?;
        }
        Ok(sum)
    }

    /// From the smoothing, which goes with the distance between samples, to areas or [`CloudCotangent::spacing`], and to the
    /// cell size.
    fn pull_smoothing(
        &self,
        result: &Reconstruction<T>,
        local: Option<local::Cotangents<T>>,
        chi_bar: &Buffer<T>,
        bars: &SampleCotangent<T>,
    ) -> Result<Option<Buffer<T>>, Error> {
        let residuals = &result.residuals;
        let (mean, count) = residuals.smoothing.areas;
        if self.options.smoothing != Smoothing::Auto || !(mean > 0.0) {
            return Ok(None);
        }
        let (device, cells) = (&self.device, residuals.smoothing.cells);
        // χ before the local level, and the level's own derivative by the smoothing.
        let (chi, by_level) = match &local {
            Some(found) => (&found.chi, found.smoothing),
            None => (&result.indicator, 0.0),
        };
        let bar = poisson::smoothing::pullback(device, cells, self.grid.shape(), chi, chi_bar)?;
        if self.options.screening > 0.0 {
            let equation = self.screened_equation(result.samples(), &residuals.splat);
            let level = &residuals.iso_value;
            let part = screened::smoothing_pullback(device, &equation, level, cells, chi_bar)?;
            add(device, &part, &bar)?;
        }
        let spacing = match self.options.area_weights {
            true => None,
            false => Some(zeros(device, 1)?),
        };
        let (out, share) = match &spacing {
            None => (&bars.areas, 0.5 * cells / (mean * count as f64)),
            Some(spacing) => (spacing, cells),
        };
        launch!(device, out.len() => share_smoothing<T>(
            bar, out, bars.grid, T::of(by_level), T::of(share),
            T::of(cells / self.grid.spacing().f64()),
        ));
        Ok(spacing)
    }
}

fn add_or_set<R: Runtime, T: Scalar>(
    device: &Device<R>,
    sum: &mut Option<Buffer<T>>,
    part: Buffer<T>,
) -> Result<(), crate::Error> {
    match sum {
        Some(sum) => add(device, &part, sum),
        None => {
            *sum = Some(part);
            Ok(())
        }
    }
}

/// Adds to each of `out`, the areas or the distance between samples, and subtracts from the cell size, its share of the
/// cotangent of the smoothing.
#[cube(launch)]
fn share_smoothing<F: Float + CubeElement>(
    bar: &Array<F>,
    out: &mut Array<F>,
    grid_bar: &mut Array<F>,
    by_level: F,
    share: F,
    of_spacing: F,
) {
    if ABSOLUTE_POS < out.len() {
        out[ABSOLUTE_POS] += (bar[0] + by_level) * share;
    }
    if ABSOLUTE_POS == 0 {
        grid_bar[3] -= (bar[0] + by_level) * of_spacing;
    }
}
