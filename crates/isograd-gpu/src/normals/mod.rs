//! The axis of the surface at every sample: distance-weighted principal components (D-PCA). What it computes,
//! and why, is on the page of [`isograd::normals`]; radii are given, and [`widen()`] makes them wider where samples
//! scatter, as the CPU does.
//!
//! # Map
//! [`Neighborhoods`] → unit vectors `(N, 3)` along the surface normal, in input order, each with its component
//! of largest magnitude positive.
//!
//! # Residual
//! [`Residual`]: per point `n`, `v₂`, `m`, `W` and the eigenvalues `λ₁ ≤ λ₂ ≤ λ₃`, in units of the radius:
//! `m/R`, `W R`, `λ/R²`, so that nothing overflows or vanishes in single precision whatever the unit of the
//! cloud. `v₃ = n × v₂`. Of the pullback, `⟨B, C⟩ = 0`, and `B` is `n` and a vector `g` made of these.
//!
//! # Pullback
//! That of [`isograd::normals`]. One walk over the tree gathers the cotangents of a point both as a neighbor of others and
//! as a center, with the radius of each center. No atomics.
//!
//! # Not differentiable
//! The sign. By how much neighborhoods are widened is pulled back on the CPU, by
//! [`isograd::normals::radii_pullback`]. Where `λ₂ − λ₁` is at most `10⁻³ λ₃`, the pullback bounds
//! `1/(λ₁ − λ_k)`: [`Residual::guarded`].

mod forward;
mod pullback;
mod widen;

pub use forward::forward;
pub(crate) use forward::{MOMENTS, add_moments, epsilon, fit, steepness};
pub use pullback::pullback;
use pullback::rows;
pub use widen::widen;

use cubecl::prelude::*;

use crate::device::launch;
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::primitives::flags;
use crate::{Buffer, Device, Error, Scalar};

/// Numbers that the residual has of a point, each an array `(N,)` in sorted order, one after the other:
/// normal, tangent, centroid, eigenvalues, weight.
const PLANE: usize = 13;
const TANGENT: usize = 3;
pub(crate) const CENTROID: usize = 6;
pub(crate) const VALUES: usize = 9;
const WEIGHT: usize = 12;

/// Parts of 1000 of `λ₃` up to which the gap `λ₂ − λ₁` is too small for a normal to mean anything: as on the CPU.
const SMALLEST_GAP: f32 = 1.0;

/// Residual of [`forward`].
#[derive(Clone, Debug)]
pub struct Residual<T> {
    pub(crate) neighborhoods: Neighborhoods<T>,
    pub(crate) planes: Buffer<T>,
    /// `(N,)` number of samples within each radius, the point itself included, in input order.
    pub count: Buffer<u32>,
}

/// The local planes on the host, in input order and in the unit of the points; see [`isograd::normals::Plane`].
pub type Planes<T> = Vec<isograd::normals::Plane<T>>;

impl<T: Scalar> Residual<T> {
    /// Number of points whose normal is ill defined. Waits for the device.
    pub fn guarded<R: Runtime>(&self, device: &Device<R>) -> Result<usize, Error> {
        let n = self.neighborhoods.len();
        if n == 0 {
            return Ok(0);
        }
        let guarded: Buffer<u32> = device.empty(n)?;
        launch!(device, n, BLOCK => flag_guarded<T>(self.planes, guarded));
        let total = flags::count(device, &guarded)?;
        Ok(device.download(&total)?[0] as usize)
    }

    /// A copy of the planes on the host.
    pub fn planes<R: Runtime>(&self, device: &Device<R>) -> Result<Planes<T>, Error> {
        let n = self.neighborhoods.len();
        let places = device.download(&self.neighborhoods.places)?;
        let radii = device.download(&self.neighborhoods.radii)?;
        let numbers = device.download(&self.planes)?;
        let mut planes = vec![isograd::normals::Plane::default(); n];
        for (sorted, &place) in places.iter().enumerate() {
            let at = |k: usize| isograd::Real::f64(numbers[k * n + sorted]);
            let triple = |k: usize| [at(k), at(k + 1), at(k + 2)];
            let radius = isograd::Real::f64(radii[sorted]);
            let of = |v: [f64; 3], unit: f64| v.map(|x| <T as isograd::Real>::of(x * unit));
            let (normal, tangent) = (triple(0), triple(TANGENT));
            let [l1, l2, l3] = triple(VALUES);
            planes[place as usize] = isograd::normals::Plane {
                centroid: of(triple(CENTROID), radius),
                weight: <T as isograd::Real>::of(at(WEIGHT) / radius),
                eigenvalues: of([l1, l2, l3], radius * radius),
                tangents: [
                    of(tangent, 1.0),
                    of(isograd_element::vector::cross(normal, tangent), 1.0),
                ],
                guarded: !(1000.0 * (l2 - l1) > f64::from(SMALLEST_GAP) * l3),
            };
        }
        Ok(planes)
    }
}

#[cube(launch)]
fn flag_guarded<F: Float>(planes: &Array<F>, flags: &mut Array<u32>) {
    let n = flags.len();
    if ABSOLUTE_POS < n {
        let values = rows::<F>(planes, VALUES, n);
        let clear = F::new(1000.0) * (values.y - values.x) > F::new(SMALLEST_GAP) * values.z;
        flags[ABSOLUTE_POS] = select(clear, 0u32, 1u32);
    }
}
