//! Results on a device, each copied when it is first asked for.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use isograd::distance::extend::{self, Extension, Region};
use isograd::isosurface::measure;
use isograd::neighbors::{Neighborhoods, Radii, RadiiCotangent, Radius};
use isograd::orient::Orientation;
use isograd::{
    Attribute, CloudCotangent, Cotangent, Field, Grid, Mesh, Options, PointCloud, Report,
    Selection, Stage, Warning,
};

use super::work::{RadiiCotangents, Work, vectors_of};
use super::{Error, Number};
#[cfg(feature = "cuda")]
use crate::DeviceArray;
use crate::pipeline::RadiiAndSigns;
use crate::{Buffer, pipeline};

/// [`isograd::Reconstruction`] on a device. Each result is copied at its first request.
pub struct Reconstruction<T: Number> {
    device: Arc<dyn Work<T>>,
    result: pipeline::Reconstruction<T>,
    grid: Grid<T>,
    checks: bool,
    radius: Radius,
    selection: Selection,
    /// The report, without what needs copies of results.
    begun: Report,
    /// Radii and signs.
    held: RadiiAndSigns<T>,
    copies: Copies<T>,
}

/// Copies of the results, each made at its first request; and a method for each.
macro_rules! results {
    ($($(#[$doc:meta])+ $name:ident: $kind:ty => $view:ty, |$of:ident| $copy:expr;)*) => {
        struct Copies<T> {
            $($name: OnceLock<$kind>,)*
            neighborhoods: OnceLock<Neighborhoods<T>>,
            report: OnceLock<Report>,
        }

        impl<T> Default for Copies<T> {
            fn default() -> Self {
                Self {
                    $($name: OnceLock::new(),)*
                    neighborhoods: OnceLock::new(),
                    report: OnceLock::new(),
                }
            }
        }

        impl<T: Number> Reconstruction<T> {
            $(
                $(#[$doc])+
                pub fn $name(&self) -> Result<&$view, Error> {
                    let $of = self;
                    let copy = once(&self.copies.$name, || $copy)?;
                    Ok(copy)
                }
            )*
        }
    };
}

results! {
    /// The signed distance φ at every cell center, in the cloud's unit, negative inside.
    sdf: Field<T> => Field<T>, |of| of.field(&of.result.sdf);
    /// The indicator χ at every cell center: below the iso-value inside, above it outside.
    indicator: Field<T> => Field<T>, |of| of.field(&of.result.indicator);
    /// The surface, in the cloud's coordinates; its vertices do not name their lattice edges.
    mesh: Mesh<T> => Mesh<T>, |of| of.copy_mesh();
    /// For each cell, in C order, the face of the surface closest to its center;
    /// [`NO_TRIANGLE`](crate::distance::NO_TRIANGLE) outside the band.
    closest: Vec<u32> => [u32], |of| of.device.indices(of.result.closest());
    /// `(N, 3)` outward unit normals of the samples, in their order.
    normals: Vec<[T; 3]> => [[T; 3]], |of| Ok(of.scatter(of.vectors(&of.result.normals)?, [T::zero(); 3]));
    /// `(N,)` area of surface that each sample stands for, in unit length²; 1 without area weights.
    areas: Vec<T> => [T], |of| Ok(of.scatter(of.device.numbers(&of.result.areas)?, T::zero()));
    /// `(N,)` confidence in the sign of each normal, from 0 to 1.
    confidence: Vec<T> => [T], |of| Ok(of.scatter(of.device.numbers(&of.result.confidence)?, T::zero()));
    /// `(N,)` number of samples in the neighborhood of each, itself included.
    neighbor_counts: Vec<u32> => [u32], |of| Ok(of.scatter(of.neighborhoods()?.count.clone(), 0));
    /// `(1,)` the level of the surface.
    level: Vec<T> => [T], |of| of.device.numbers(&of.result.iso_value);
}

impl<T: Number> Reconstruction<T> {
    pub(super) fn new(
        device: Arc<dyn Work<T>>,
        result: pipeline::Reconstruction<T>,
        options: &Options,
        grid: Grid<T>,
        held: RadiiAndSigns<T>,
        begun: Report,
    ) -> Self {
        Self {
            device,
            result,
            grid,
            checks: options.checks,
            radius: options.radius,
            selection: Selection::default(),
            begun,
            held,
            copies: Copies::default(),
        }
    }

    /// The grid of all fields.
    pub fn grid(&self) -> &Grid<T> {
        &self.grid
    }

    /// Sets the samples that were used.
    pub(super) fn set_selection(&mut self, selection: Selection) {
        self.selection = selection;
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.selection.samples()
    }

    /// Indices of the [outliers](isograd::Outliers) that were left out, ascending.
    pub fn outliers(&self) -> &[u32] {
        self.selection.left_out()
    }

    /// Entries of all samples from those of the ones that are used.
    fn scatter<E: Copy>(&self, used: Vec<E>, fill: E) -> Vec<E> {
        match self.selection.is_all() {
            true => used,
            false => self.selection.scatter(&used, 1, fill),
        }
    }

    /// The level `c` of the surface `χ = c`.
    pub fn iso_value(&self) -> Result<T, Error> {
        Ok(self.level()?[0])
    }

    fn copy_mesh(&self) -> Result<Mesh<T>, Error> {
        let surface = &self.result.surface;
        let vertices = self.vectors(&surface.vertices)?;
        let faces = vectors_of(&self.device.indices(&surface.faces)?);
        Mesh::new(vertices, faces).map_err(|e| self.none(&e))
    }

    /// The report without what needs copies of results.
    pub(super) fn begun(&self) -> &Report {
        &self.begun
    }

    /// Radii and signs for the next step of a moving body.
    pub(super) fn hold_after(&self, held: RadiiAndSigns<T>) -> Result<RadiiAndSigns<T>, Error> {
        Ok(held.after(&self.result)?)
    }

    /// Number of axes that have turned by more than 60° since the call before, and followed their neighbors.
    pub(super) fn turned(&self) -> Result<usize, Error> {
        Ok(self.device.indices(&self.result.turned)?[0] as usize)
    }

    /// The neighborhoods, on the CPU: those of these points, or with radii of an earlier step.
    fn neighborhoods(&self) -> Result<&Neighborhoods<T>, Error> {
        once(&self.copies.neighborhoods, || {
            let points = self.vectors(&self.result.points)?;
            let mut found = Neighborhoods::default();
            if !self.held.has_moved {
                let lines = self.held.lines;
                isograd::neighbors::with_lines(&points, self.radius, lines, &mut found)
                    .map_err(isograd::Error::from)?;
                return Ok(found);
            }
            let radii = Radii {
                each: &self.device.numbers(&self.held.area_radii)?,
                common: self.held.common_radius,
                spacing: self.held.spacing,
            };
            isograd::neighbors::with_radii(&points, radii, &mut found)
                .map_err(isograd::Error::from)?;
            Ok(found)
        })
    }

    /// Numbers, times and warnings. With [`Options::checks`] points, φ, the surface and the normals are copied for them.
    pub fn report(&self) -> Result<&Report, Error> {
        once(&self.copies.report, || self.make_report())
    }

    fn make_report(&self) -> Result<Report, Error> {
        let start = Instant::now();
        let mut report = self.begun.clone();
        report.points = self.points();
        report.outliers = self.outliers().to_vec();
        report.warnings.extend(self.selection.warning());
        report.surface_spacing = isograd::Real::f64(self.grid.spacing());
        report.surface_cells = self.grid.cells();
        report.smoothing = self.result.smoothing();
        report.walls = "free";
        report.iso_value = isograd::Real::f64(self.iso_value()?);
        if self.result.surface.report.touches_wall {
            report.warnings.push(Warning::TouchesWall);
        }
        if self.checks {
            let scratch = &mut measure::Scratch::default();
            let points = self.vectors(&self.result.points)?;
            let orientation = Orientation {
                normals: self.vectors(&self.result.normals)?,
                confidence: self.device.numbers(&self.result.confidence)?,
                ..Orientation::default()
            };
            let (samples, neighborhoods) =
                ([&points[..], &orientation.normals], self.neighborhoods()?);
            let (sdf, mesh) = (self.sdf()?, self.mesh()?);
            report.check_field(samples, neighborhoods, sdf, mesh, scratch, None);
            report.check_samples(&points, neighborhoods, &orientation, false);
        }
        let before = report.seconds.of(Stage::Checks);
        let seconds = before + start.elapsed().as_secs_f64();
        report.seconds.set(Stage::Checks, seconds);
        Ok(report)
    }

    /// The attribute `name` of the cloud at the vertices of the surface, and at the closest surface point of every
    /// cell of a region: [`isograd::Reconstruction::extend`], on the device.
    ///
    /// # Errors
    /// Errors of that, and of the device.
    pub fn extend(
        &self,
        cloud: &PointCloud<T>,
        name: &str,
        region: impl Into<Region>,
    ) -> Result<Extension<T>, Error> {
        let attribute = extend::attribute(cloud, name)?;
        Ok(self.extend_with_residual(attribute, region)?.0)
    }

    /// [`Self::extend`] for any attribute of the samples, with the residual of its pullback.
    pub fn extend_with_residual(
        &self,
        attribute: &Attribute<T>,
        region: impl Into<Region>,
    ) -> Result<(Extension<T>, extend::Residual<T>), Error> {
        let used = self.selection.attribute(attribute);
        self.device.extend(&self.result, &used, region.into())
    }

    /// Pulls cotangents of any of the results, and of what was extended, back to the points, the attributes and the
    /// grid, on the device, as [`isograd::Reconstruction::pullback`] does. Of the samples whose axis is guarded all are
    /// counted, those without a cotangent too. Radii that are those of an earlier step are constant.
    ///
    /// # Errors
    /// Errors of the device; a cotangent of another length, or that is not finite; an extension of another result.
    pub fn pullback(&self, cotangent: &Cotangent<'_, T>) -> Result<CloudCotangent<T>, Error> {
        self.pull(cotangent, None)
    }

    /// [`Self::pullback`] of a cotangent of φ in an array of another program on the device, which is not checked.
    ///
    /// # Errors
    /// Errors of the device; an array on another one, or of another length.
    #[cfg(feature = "cuda")]
    pub fn pullback_on_device(&self, sdf: &DeviceArray<T>) -> Result<CloudCotangent<T>, Error> {
        self.pull(&Cotangent::default(), Some(self.device.import(sdf)?))
    }

    /// Copies φ into an array of another program on the device.
    ///
    /// # Errors
    /// As [`Self::pullback_on_device`].
    #[cfg(feature = "cuda")]
    pub fn sdf_into(&self, array: &DeviceArray<T>) -> Result<(), Error> {
        self.device.export_numbers(&self.result.sdf, array)
    }

    /// Copies the closest faces into an array of another program on the device.
    ///
    /// # Errors
    /// As [`Self::pullback_on_device`].
    #[cfg(feature = "cuda")]
    pub fn closest_into(&self, array: &DeviceArray<u32>) -> Result<(), Error> {
        self.device.export_indices(self.result.closest(), array)
    }

    /// To all samples.
    fn pull(
        &self,
        cotangent: &Cotangent<'_, T>,
        sdf: Option<Buffer<T>>,
    ) -> Result<CloudCotangent<T>, Error> {
        let vertices = self.result.surface.vertices.len() / 3;
        cotangent.check([self.grid.cells(); 2], vertices, self.points())?;
        let pull = |cotangent: &Cotangent<'_, T>| self.pull_used(cotangent, sdf);
        let mut found = match self.selection.is_all() {
            true => pull(cotangent)?,
            false => self.selection.pull(cotangent, pull)?,
        };
        found.guarded += self.begun.guarded;
        Ok(found)
    }

    /// To the samples that are used.
    fn pull_used(
        &self,
        cotangent: &Cotangent<'_, T>,
        sdf: Option<Buffer<T>>,
    ) -> Result<CloudCotangent<T>, Error> {
        let (mut found, bars) = self.device.pullback(&self.result, cotangent, sdf)?;
        if !self.held.has_moved {
            self.pull_radii(bars, &mut found.points)?;
        }
        Ok(found)
    }

    fn pull_radii(&self, bars: RadiiCotangents<T>, points_bar: &mut [[T; 3]]) -> Result<(), Error> {
        let near = self.neighborhoods()?;
        let mut radii = RadiiCotangent::of(near, &bars.areas);
        radii.add_common(bars.common);
        radii.add_spacing(bars.spacing);
        if !bars.axes.is_empty() {
            let [found, own] =
                [&self.held.radii, &self.held.area_radii].map(|of| self.device.numbers(of));
            let widened = [&found?[..], &own?[..]];
            isograd::normals::radii_pullback(near, widened, &bars.axes, points_bar, &mut radii);
        }
        isograd::neighbors::pullback(near, &radii, points_bar);
        Ok(())
    }

    fn field(&self, buffer: &Buffer<T>) -> Result<Field<T>, Error> {
        let values = self.device.numbers(buffer)?;
        Field::new(self.grid, values).map_err(|e| self.none(&e))
    }

    fn vectors(&self, buffer: &Buffer<T>) -> Result<Vec<[T; 3]>, Error> {
        Ok(vectors_of(&self.device.numbers(buffer)?))
    }

    fn none(&self, reason: &dyn std::fmt::Display) -> Error {
        Error::Result {
            device: self.device.name().into(),
            reason: reason.to_string(),
        }
    }
}

/// The value in `place`, made at the first request.
fn once<V>(place: &OnceLock<V>, make: impl FnOnce() -> Result<V, Error>) -> Result<&V, Error> {
    if let Some(value) = place.get() {
        return Ok(value);
    }
    let made = make()?;
    Ok(place.get_or_init(|| made))
}
