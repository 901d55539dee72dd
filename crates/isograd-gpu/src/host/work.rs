//! A pipeline on any runtime, behind one type.

use std::ops::ControlFlow;
use std::sync::Arc;

use cubecl::prelude::{CubeElement, Runtime};
use isograd::distance::extend::{Extension, Region, Residual};
use isograd::neighbors::Radius;
use isograd::orient::{self, Method};
use isograd::{
    Attribute, Backend, CloudCotangent, Cotangent, Grid, GridCotangent, PointCloud, Report, Stage,
};

use super::Error;
use super::extend::{self, Uploaded};
#[cfg(feature = "cuda")]
use crate::device::{DeviceArray, SharedMemory};
use crate::orient as on_device;
use crate::pipeline::{
    self, Options, RadiiAndSigns, Reconstruction, Reconstructor, SampleAxes, SearchResult, Start,
};
use crate::{Buffer, Device, Scalar};

/// A pipeline on a device, with its runtime erased.
pub trait Work<T: Scalar>: Send + Sync {
    /// The name that its driver gives the device.
    fn name(&self) -> &str;

    /// `(N, 3)` vectors, there.
    fn upload(&self, vectors: &[[T; 3]]) -> Result<Buffer<T>, Error>;

    /// The radii of a cloud, whose `points` are there, and the signs of its axes; `begin` is called before the signs are
    /// chosen. What the device has no method for is found on the CPU, as is all with `on_cpu`.
    ///
    /// # Errors
    /// Errors of the pipeline; [`Error::Interrupted`] where `begin` breaks.
    fn find(
        &self,
        cloud: &PointCloud<T>,
        points: &Buffer<T>,
        radius: Radius,
        method: Method,
        on_cpu: bool,
        begin: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<CallStart<T>, Error>;

    /// All stages, with given normals or without; `observer` is called before each, when those before it are done.
    fn reconstruct(
        &self,
        points: &Buffer<T>,
        given: Option<&[[T; 3]]>,
        begun: CallStart<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Reconstruction<T>, Error>;

    /// Cotangents in the host's memory to such cotangents, at fixed radii, and to the radii. That of φ may be on the device
    /// instead, as `sdf`.
    fn pullback(
        &self,
        result: &Reconstruction<T>,
        cotangent: &Cotangent<'_, T>,
        sdf: Option<Buffer<T>>,
    ) -> Result<(CloudCotangent<T>, RadiiCotangents<T>), Error>;

    /// An attribute on the surface and around it.
    fn extend(
        &self,
        result: &Reconstruction<T>,
        attribute: &Attribute<T>,
        region: Region,
    ) -> Result<(Extension<T>, Residual<T>), Error>;

    /// A copy of numbers.
    fn numbers(&self, buffer: &Buffer<T>) -> Result<Vec<T>, Error>;

    /// A copy of indices.
    fn indices(&self, buffer: &Buffer<u32>) -> Result<Vec<u32>, Error>;

    /// A copy of an array of another program on the same device.
    #[cfg(feature = "cuda")]
    fn import(&self, array: &DeviceArray<T>) -> Result<Buffer<T>, Error>;

    /// Copies numbers into such an array.
    #[cfg(feature = "cuda")]
    fn export_numbers(&self, buffer: &Buffer<T>, array: &DeviceArray<T>) -> Result<(), Error>;

    /// Copies indices into such an array.
    #[cfg(feature = "cuda")]
    fn export_indices(&self, buffer: &Buffer<u32>, array: &DeviceArray<u32>) -> Result<(), Error>;
}

/// Start of a reconstruction.
pub struct CallStart<T: Scalar> {
    /// Radii and sides.
    pub held: RadiiAndSigns<T>,
    /// The axes that the sides were looked for with, where they were.
    pub axes: Option<SampleAxes<T>>,
    /// Part of the report about the samples.
    pub report: Report,
    /// Whether some of them lie apart, as [strays](isograd::neighbors::Neighborhoods::strays) do.
    pub has_apart: bool,
}

/// Cotangents of radii, times these.
pub struct RadiiCotangents<T> {
    /// `(N,)` of those that areas are found with.
    pub areas: Vec<T>,
    /// `(N,)` of those that axes are found with, or none.
    pub axes: Vec<T>,
    /// Of the common one, by itself.
    pub common: f64,
    /// Of the distance between samples.
    pub spacing: f64,
}

/// `f32` and `f64`, compiled here.
pub trait Number: Scalar {
    /// A pipeline on a device.
    ///
    /// # Errors
    /// Errors of the device and the pipeline.
    #[doc(hidden)]
    fn open(
        backend: Backend,
        grid: Grid<Self>,
        options: Options,
    ) -> Result<Arc<dyn Work<Self>>, Error>;
}

macro_rules! number {
    ($($number:ty),*) => {$(
        impl Number for $number {
            fn open(
                backend: Backend,
                grid: Grid<Self>,
                options: Options,
            ) -> Result<Arc<dyn Work<Self>>, Error> {
                open(backend, grid, options)
            }
        }
    )*};
}

number!(f32, f64);

fn open<T: Scalar>(
    backend: Backend,
    grid: Grid<T>,
    options: Options,
) -> Result<Arc<dyn Work<T>>, Error> {
    match backend {
        Backend::Cpu | Backend::Auto => Err(Error::NoDevice(backend)),
        #[cfg(feature = "cuda")]
        Backend::Cuda(number) => on(Device::cuda(number)?, grid, options),
        #[cfg(feature = "wgpu")]
        Backend::Vulkan => on(Device::vulkan()?, grid, options),
        #[allow(unreachable_patterns)] // with both features
        backend => Err(Error::NotBuilt(backend)),
    }
}

/// Runtimes of plans.
#[cfg(not(feature = "cuda"))]
trait SharedMemory: Runtime {}
#[cfg(not(feature = "cuda"))]
impl<R: Runtime> SharedMemory for R {}

fn on<R: SharedMemory, T: Scalar>(
    device: Device<R>,
    grid: Grid<T>,
    options: Options,
) -> Result<Arc<dyn Work<T>>, Error> {
    device.check_number::<T>()?;
    Ok(Arc::new(Reconstructor::new(device, grid, options)?))
}

impl<R: SharedMemory, T: Scalar> Work<T> for Reconstructor<R, T> {
    fn name(&self) -> &str {
        self.device().name()
    }

    fn upload(&self, vectors: &[[T; 3]]) -> Result<Buffer<T>, Error> {
        Ok(self.device().upload(vectors.as_flattened())?)
    }

    fn find(
        &self,
        cloud: &PointCloud<T>,
        points: &Buffer<T>,
        radius: Radius,
        method: Method,
        on_cpu: bool,
        begin: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<CallStart<T>, Error> {
        let device = self.device();
        let none = || Error::Host(orient::Error::NoNormals.into());
        let normals = || cloud.normals().ok_or_else(none);
        let search = match method {
            Method::Given => {
                normals()?;
                if begin().is_break() {
                    return Err(Error::Interrupted(Stage::Orient));
                }
                RadiiAndSigns::search_radii(device, points, radius)?
            }
            Method::Parity(options) if !on_cpu => {
                let method = on_device::Method::Parity(options);
                RadiiAndSigns::search_on_device(device, points, radius, &method, begin)?
            }
            Method::Signs if !on_cpu => {
                let method = on_device::Method::Signs(self.upload(normals()?)?);
                RadiiAndSigns::search_on_device(device, points, radius, &method, begin)?
            }
            _ => RadiiAndSigns::search_on_cpu(device, cloud, radius, &method, begin)?,
        };
        let SearchResult {
            held,
            axes,
            method,
            guarded,
            flipped,
            has_apart,
        } = search;
        if guarded == cloud.len() {
            let points = cloud.len();
            return Err(isograd::Error::NoPlane { points }.into());
        }
        let report = Report {
            points: cloud.len(),
            orientation: method,
            flipped,
            radius: isograd::Real::f64(held.common_radius),
            sample_spacing: isograd::Real::f64(held.spacing),
            guarded,
            ..Report::default()
        };
        Ok(CallStart {
            held,
            axes,
            report,
            has_apart,
        })
    }

    fn reconstruct(
        &self,
        points: &Buffer<T>,
        given: Option<&[[T; 3]]>,
        begun: CallStart<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Reconstruction<T>, Error> {
        let device = self.device();
        let given = upload(device, given.map(<[_]>::as_flattened))?;
        let start = match (&given, begun.axes) {
            (Some(given), _) => Start::Given(given),
            (None, Some(axes)) => Start::Axes(axes),
            (None, None) => Start::Points,
        };
        let mut failed = None;
        let mut waiting = |stage| match device.wait() {
            Ok(()) => observer(stage),
            Err(error) => {
                failed = Some(error);
                ControlFlow::Break(())
            }
        };
        let result = self.reconstruct_from(points, start, &begun.held, &mut waiting);
        match failed {
            Some(error) => Err(error.into()),
            None => {
                device.wait()?;
                Ok(result?)
            }
        }
    }

    fn pullback(
        &self,
        result: &Reconstruction<T>,
        bars: &Cotangent<'_, T>,
        sdf: Option<Buffer<T>>,
    ) -> Result<(CloudCotangent<T>, RadiiCotangents<T>), Error> {
        let device = self.device();
        let vectors = |given: Option<&[[T; 3]]>| upload(device, given.map(<[_]>::as_flattened));
        let level = (bars.iso_value != T::of(0.0)).then_some([bars.iso_value]);
        let sdf = match sdf {
            None => upload(device, bars.sdf)?,
            sdf => sdf,
        };
        let (indicator, areas) = (upload(device, bars.indicator)?, upload(device, bars.areas)?);
        let level = upload(device, level.as_ref().map(|l| &l[..]))?;
        let (vertices, normals) = (vectors(bars.vertices)?, vectors(bars.normals)?);
        let shape = self.grid().shape();
        let extended: Vec<Uploaded<T>> = (bars.extensions.iter())
            .map(|of| Uploaded::new(device, shape, of))
            .collect::<Result<_, _>>()?;
        let extensions: Vec<_> = (extended.iter().zip(bars.extensions))
            .map(|(uploaded, of)| uploaded.cotangent(of))
            .collect();
        let cotangent = pipeline::Cotangent {
            sdf: sdf.as_ref(),
            indicator: indicator.as_ref(),
            iso_value: level.as_ref(),
            vertices: vertices.as_ref(),
            normals: normals.as_ref(),
            areas: areas.as_ref(),
            extensions: &extensions,
        };
        let found = Reconstructor::pullback(self, result, &cotangent)?;
        let mut grid = device.download(&found.grid)?;
        let mut common = 0.0;
        if let Some(radius) = &found.extension_radius {
            let bar = device.download(radius)?[0];
            match result.extends_within_cells() {
                true => grid[3] += bar / self.grid().spacing(),
                false => common = isograd::Real::f64(bar),
            }
        }
        let guarded = match &found.guarded {
            Some(count) => device.download(count)?[0] as usize,
            None => 0,
        };
        let numbers = |of: &Option<Buffer<T>>| match of {
            Some(of) => device.download(of),
            None => Ok(Vec::new()),
        };
        let attributes = found.attributes.iter().map(|of| device.download(of));
        let of_cloud = CloudCotangent {
            points: vectors_of(&device.download(&found.points)?),
            normals: vectors_of(&numbers(&found.normals)?),
            attributes: attributes.collect::<Result<_, _>>()?,
            grid: GridCotangent {
                lower: [grid[0], grid[1], grid[2]],
                spacing: grid[3],
            },
            guarded,
        };
        let radii = RadiiCotangents {
            areas: device.download(&found.radii)?,
            axes: numbers(&found.axis_radii)?,
            common,
            spacing: (numbers(&found.spacing)?.first()).map_or(0.0, |bar| bar.f64()),
        };
        Ok((of_cloud, radii))
    }

    fn extend(
        &self,
        result: &Reconstruction<T>,
        attribute: &Attribute<T>,
        region: Region,
    ) -> Result<(Extension<T>, Residual<T>), Error> {
        extend::forward(self, result, attribute, region)
    }

    fn numbers(&self, buffer: &Buffer<T>) -> Result<Vec<T>, Error> {
        Ok(self.device().download(buffer)?)
    }

    fn indices(&self, buffer: &Buffer<u32>) -> Result<Vec<u32>, Error> {
        Ok(self.device().download(buffer)?)
    }

    #[cfg(feature = "cuda")]
    fn import(&self, array: &DeviceArray<T>) -> Result<Buffer<T>, Error> {
        Ok(R::import(self.device(), array)?)
    }

    #[cfg(feature = "cuda")]
    fn export_numbers(&self, buffer: &Buffer<T>, array: &DeviceArray<T>) -> Result<(), Error> {
        Ok(R::export(self.device(), buffer, array)?)
    }

    #[cfg(feature = "cuda")]
    fn export_indices(&self, buffer: &Buffer<u32>, array: &DeviceArray<u32>) -> Result<(), Error> {
        Ok(R::export(self.device(), buffer, array)?)
    }
}

/// A copy on the device of what is there.
pub fn upload<R: Runtime, E: CubeElement>(
    device: &Device<R>,
    given: Option<&[E]>,
) -> Result<Option<Buffer<E>>, crate::Error> {
    given.map(|values| device.upload(values)).transpose()
}

/// `(N, 3)` from 3N numbers.
pub fn vectors_of<E: Copy>(numbers: &[E]) -> Vec<[E; 3]> {
    numbers.as_chunks().0.to_vec()
}
