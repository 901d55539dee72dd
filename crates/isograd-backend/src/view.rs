//! Results, wherever they were made.

#[cfg(feature = "gpu")]
use isograd::distance::Query;
use isograd::distance::{Hit, extend};
use isograd::{Attribute, CloudCotangent, Cotangent, Field, Grid, Mesh, Reconstruction, Report};
#[cfg(feature = "gpu")]
use isograd_gpu::host;

use crate::{Error, Number};

/// A result, to look at: [`Reconstruction`] on the CPU or on a device. What is asked for of a device is copied, once.
#[derive(Clone, Copy)]
pub struct View<'a, T: Number>(pub(crate) Of<'a, T>);

/// A result, to keep.
pub struct Made<T: Number>(pub(crate) Kept<T>);

#[derive(Clone, Copy)]
pub(crate) enum Of<'a, T: Number> {
    Cpu(&'a Reconstruction<T>),
    /// And who computed.
    #[cfg(feature = "gpu")]
    Device(&'a host::Reconstruction<T>, &'a str),
}

pub(crate) enum Kept<T: Number> {
    Cpu(Box<Reconstruction<T>>),
    /// And who computed.
    #[cfg(feature = "gpu")]
    Device(Box<host::Reconstruction<T>>, String),
}

impl<T: Number> Made<T> {
    /// To look at.
    pub fn view(&self) -> View<'_, T> {
        View(match &self.0 {
            Kept::Cpu(of) => Of::Cpu(of),
            #[cfg(feature = "gpu")]
            Kept::Device(of, name) => Of::Device(of, name),
        })
    }
}

/// Methods that give one of the results.
macro_rules! results {
    ($($(#[$doc:meta])+ $name:ident: $kind:ty;)*) => {$(
        $(#[$doc])+
        pub fn $name(self) -> Result<$kind, Error> {
            match self.0 {
                Of::Cpu(of) => Ok(of.$name()),
                #[cfg(feature = "gpu")]
                Of::Device(of, _) => Ok(of.$name()?),
            }
        }
    )*};
}

impl<'a, T: Number> View<'a, T> {
    results! {
        /// The signed distance φ at every cell center, in the cloud's unit, negative inside.
        sdf: &'a Field<T>;
        /// The indicator χ at every cell center of [the surface's grid](Self::surface_grid); after a sparse solve that of a
        /// coarse grid.
        indicator: &'a Field<T>;
        /// The level of the surface.
        iso_value: T;
        /// The surface, in the cloud's coordinates.
        mesh: &'a Mesh<T>;
        /// For each cell the closest face.
        closest: &'a [u32];
        /// `(N, 3)` outward unit normals.
        normals: &'a [[T; 3]];
        /// `(N,)` from 0 to 1, how sure their sides are.
        confidence: &'a [T];
        /// `(N,)` area of surface that each sample stands for, in unit length².
        areas: &'a [T];
        /// `(N,)` samples in each neighborhood, the sample itself included.
        neighbor_counts: &'a [u32];
    }

    /// The mesh whose faces [`closest`](Self::closest) names: see [`Reconstruction::closest_mesh`].
    pub fn closest_mesh(self) -> Result<&'a Mesh<T>, Error> {
        match self.0 {
            Of::Cpu(of) => Ok(of.closest_mesh()),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => Ok(of.mesh()?),
        }
    }

    /// Indices of the [outliers](isograd::Outliers) that were left out, ascending.
    pub fn outliers(self) -> &'a [u32] {
        match self.0 {
            Of::Cpu(of) => of.outliers(),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => of.outliers(),
        }
    }

    /// Grid of the surface and of the indicator.
    pub fn surface_grid(self) -> &'a Grid<T> {
        match self.0 {
            Of::Cpu(of) => of.surface_grid(),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => of.grid(),
        }
    }

    /// Grid of φ.
    pub fn grid(self) -> &'a Grid<T> {
        match self.0 {
            Of::Cpu(of) => of.sdf().grid(),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => of.grid(),
        }
    }

    /// Who computed: `cpu`, or a backend and its device.
    pub fn backend(self) -> &'a str {
        match self.0 {
            Of::Cpu(_) => "cpu",
            #[cfg(feature = "gpu")]
            Of::Device(_, name) => name,
        }
    }

    /// Numbers, times and warnings.
    pub fn report(self) -> Result<&'a Report, Error> {
        match self.0 {
            Of::Cpu(of) => Ok(of.report()),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => Ok(of.report()?),
        }
    }

    /// An attribute on the surface and around it, and the residual for its pullback: see [`Reconstruction::extend_with_residual`].
    ///
    /// # Errors
    /// Errors of the stage or the device.
    pub fn extend(
        self,
        attribute: &Attribute<T>,
        region: impl Into<extend::Region>,
    ) -> Result<(extend::Extension<T>, extend::Residual<T>), Error> {
        match self.0 {
            Of::Cpu(of) => Ok(of.extend_with_residual(attribute, region)?),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => Ok(of.extend_with_residual(attribute, region)?),
        }
    }

    /// An attribute at the vertices of [`mesh`](Self::mesh), row by row: see [`Reconstruction::vertex_values`].
    ///
    /// # Errors
    /// Errors of the stage or the device.
    pub fn vertex_values(self, attribute: &Attribute<T>) -> Result<Vec<T>, Error> {
        match self.0 {
            Of::Cpu(of) => Ok(of.vertex_values(attribute)?),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => {
                // Devices make no other mesh than that of φ; the narrowest band has the fewest cells.
                let band = isograd::Real::f64(self.grid().spacing());
                let (extension, _) = of.extend_with_residual(attribute, band)?;
                Ok(extension.vertices)
            }
        }
    }

    /// Distance, gradient and closest point of the surface at any points: see [`Reconstruction::query`]. A device searches
    /// everywhere, and has the signs of φ where these agree.
    ///
    /// # Errors
    /// Errors of the stage or the device.
    pub fn query(self, points: &[[T; 3]], within: f64) -> Result<Vec<Hit<T>>, Error> {
        match self.0 {
            Of::Cpu(of) => Ok(of.query(points, within).map_err(isograd::Error::from)?),
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => {
                let query = Query::new(of.mesh()?.clone()).map_err(isograd::Error::from)?;
                let mut hits = query.query(points, Some(of.sdf()?));
                for (hit, &point) in hits.iter_mut().zip(points) {
                    if isograd::Real::f64(hit.distance) > within {
                        *hit = Hit::beyond(point, within);
                    }
                }
                Ok(hits)
            }
        }
    }

    /// Copies φ into an array of another program on the same device.
    ///
    /// # Errors
    /// A result of the CPU, an array on another device or of another length, errors of the device.
    #[cfg(feature = "cuda")]
    pub fn sdf_into(self, array: &crate::DeviceArray<T>) -> Result<(), Error> {
        Ok(self.on_device()?.sdf_into(array)?)
    }

    /// Copies the closest faces into such an array.
    ///
    /// # Errors
    /// As [`Self::sdf_into`].
    #[cfg(feature = "cuda")]
    pub fn closest_into(self, array: &crate::DeviceArray<u32>) -> Result<(), Error> {
        Ok(self.on_device()?.closest_into(array)?)
    }

    /// Cotangents of the inputs, from that of φ in such an array; it is not checked.
    ///
    /// # Errors
    /// As [`Self::sdf_into`].
    #[cfg(feature = "cuda")]
    pub fn pullback_on_device(
        self,
        sdf: &crate::DeviceArray<T>,
    ) -> Result<CloudCotangent<T>, Error> {
        Ok(self.on_device()?.pullback_on_device(sdf)?)
    }

    #[cfg(feature = "cuda")]
    fn on_device(self) -> Result<&'a host::Reconstruction<T>, Error> {
        match self.0 {
            Of::Cpu(_) => Err(Error::OnDevice),
            Of::Device(of, _) => Ok(of),
        }
    }

    /// Cotangents of the inputs: see [`Reconstruction::pullback`].
    ///
    /// # Errors
    /// Cotangents that are not those of this result; what the device says.
    pub fn pullback(self, cotangent: &Cotangent<'_, T>) -> Result<CloudCotangent<T>, Error> {
        let mut out = CloudCotangent::default();
        self.pullback_into(cotangent, &mut out)?;
        Ok(out)
    }

    /// Like [`Self::pullback`], writing into `out`; on the CPU the scratch buffers are those of the plan.
    pub fn pullback_into(
        self,
        cotangent: &Cotangent<'_, T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), Error> {
        match self.0 {
            Of::Cpu(of) => of.pullback_into(cotangent, out)?,
            #[cfg(feature = "gpu")]
            Of::Device(of, _) => *out = of.pullback(cotangent)?,
        }
        Ok(())
    }
}
