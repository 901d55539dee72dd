//! The pullback of cotangents of any size. It is linear, so powers of two may be taken out of the cotangents and put back
//! into the gradients, which changes no bit unless a number leaves the range of its type.

use super::pullback::PullbackScratch;
use super::{CloudCotangent, Cotangent, ExtensionCotangent, PullbackError, Reconstruction};
use crate::Real;
use crate::parallel::{self, CHUNK};

/// Share of the exponents of the number type, on either side of 0, at which cotangents are pulled back as they are. Half of
/// the rest is for the factors of the stages, half for what is small beside the largest cotangent.
const COMFORTABLE: f64 = 0.25;

/// Shares of these exponents by which the cotangents are made smaller, one after the other, until no gradient overflows.
const SMALLER: [f64; 3] = [0.0, 0.4, 0.75];

/// Cotangents times a power of two.
#[derive(Default)]
struct Scaled<T> {
    sdf: Option<Vec<T>>,
    indicator: Option<Vec<T>>,
    iso_value: T,
    vertices: Option<Vec<[T; 3]>>,
    normals: Option<Vec<[T; 3]>>,
    areas: Option<Vec<T>>,
    /// At the vertices and at the cells of the band, for each extension.
    extensions: Vec<[Option<Vec<T>>; 2]>,
}

impl<T: Real> Scaled<T> {
    fn new(cotangent: &Cotangent<'_, T>, exponent: i32) -> Self {
        let of = |x: T| times_power(x.f64(), exponent).0;
        let numbers = |bar: Option<&[T]>| bar.map(|bar| bar.iter().map(|&x| of(x)).collect());
        let vectors =
            |bar: Option<&[[T; 3]]>| bar.map(|bar| bar.iter().map(|v| v.map(of)).collect());
        let extensions = cotangent.extensions.iter();
        Self {
            sdf: numbers(cotangent.sdf),
            indicator: numbers(cotangent.indicator),
            iso_value: of(cotangent.iso_value),
            vertices: vectors(cotangent.vertices),
            normals: vectors(cotangent.normals),
            areas: numbers(cotangent.areas),
            extensions: extensions
                .map(|of| [of.vertices, of.values].map(numbers))
                .collect(),
        }
    }
}

impl<T: Real> Reconstruction<T> {
    /// [`Self::pullback_into`], compiled where it is called: see [`concrete`](super::concrete). What cannot be represented
    /// is replaced by the nearest number that can, or 0, and counted.
    pub(super) fn pull(
        &self,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        if !self.options.residuals {
            return Err(PullbackError::NoResiduals);
        }
        if self.sparse.is_some() && cotangent.indicator.is_some() {
            return Err(PullbackError::SparseIndicator);
        }
        let cells = [&self.sdf, &self.indicator].map(|field| field.values().len());
        cotangent.check(
            cells,
            self.mesh().vertices().len(),
            self.selection.samples(),
        )?;
        if self.selection.is_all() {
            return self.pull_used(cotangent, scratch, out);
        }
        *out = self.selection.pull(cotangent, |cotangent| {
            let mut out = CloudCotangent::default();
            self.pull_used(cotangent, scratch, &mut out)?;
            Ok::<_, PullbackError>(out)
        })?;
        Ok(())
    }

    /// The pullback for the samples that are used.
    fn pull_used(
        &self,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        let all = T::max_value().f64().log2();
        let magnitude = self.magnitude(cotangent);
        let is_comfortable = magnitude.abs() <= COMFORTABLE * all;
        let mut exponent = 0;
        for share in SMALLER {
            if !(is_comfortable && share == 0.0) {
                exponent = (-magnitude - share * all) as i32;
            }
            self.pull_times(exponent, cotangent, scratch, out)?;
            if out.is_representable() {
                break;
            }
        }
        out.guarded += out.multiply(-exponent);
        Ok(())
    }

    /// Pulls the cotangents back, times a power of two.
    fn pull_times(
        &self,
        exponent: i32,
        cotangent: &Cotangent<'_, T>,
        scratch: &mut PullbackScratch<T>,
        out: &mut CloudCotangent<T>,
    ) -> Result<(), PullbackError> {
        if exponent == 0 {
            return self.pull_plain(cotangent, scratch, out);
        }
        let scaled = Scaled::new(cotangent, exponent);
        let pairs = cotangent.extensions.iter().zip(&scaled.extensions);
        let extensions: Vec<ExtensionCotangent<'_, T>> = pairs
            .map(|(of, [vertices, values])| ExtensionCotangent {
                vertices: vertices.as_deref(),
                values: values.as_deref(),
                ..*of
            })
            .collect();
        let cotangent = Cotangent {
            sdf: scaled.sdf.as_deref(),
            indicator: scaled.indicator.as_deref(),
            iso_value: scaled.iso_value,
            vertices: scaled.vertices.as_deref(),
            normals: scaled.normals.as_deref(),
            areas: scaled.areas.as_deref(),
            extensions: &extensions,
        };
        self.pull_plain(&cotangent, scratch, out)
    }

    /// Exponent of 2 of the largest cotangent, with cells as the unit of length; 0 where all are 0.
    fn magnitude(&self, cotangent: &Cotangent<'_, T>) -> f64 {
        let cell = self.sdf.grid().spacing().f64().log2();
        let vectors = |bar: Option<&[[T; 3]]>| exponent(bar.unwrap_or_default().as_flattened());
        let numbers = |bar: Option<&[T]>| exponent(bar.unwrap_or_default());
        let extensions = cotangent.extensions.iter().map(|of| {
            let bar = numbers(of.vertices).max(numbers(of.values));
            bar + exponent(&of.attribute.values).max(0.0)
        });
        let largest = [
            numbers(cotangent.sdf) + cell,
            vectors(cotangent.vertices) + cell,
            numbers(cotangent.areas) + 2.0 * cell,
            numbers(cotangent.indicator),
            vectors(cotangent.normals),
            exponent(&[cotangent.iso_value]),
        ];
        let largest = largest.into_iter().chain(extensions);
        match largest.fold(f64::NEG_INFINITY, f64::max) {
            f64::NEG_INFINITY => 0.0,
            largest => largest.round(),
        }
    }
}

impl<T: Real> CloudCotangent<T> {
    /// Whether every number is below the largest of its type, which stands for what is larger.
    fn is_representable(&self) -> bool {
        let is = |x: &T| x.abs() < T::max_value();
        let vectors = |v: &[[T; 3]]| parallel::first(v.len(), |i| !v[i].iter().all(is)).is_none();
        let grid = self.grid.lower.iter().chain([&self.grid.spacing]);
        vectors(&self.points)
            && vectors(&self.normals)
            && self.attributes.iter().flatten().all(is)
            && grid.into_iter().all(is)
    }

    /// Multiplies every number by a power of two. Returns how many had to be replaced.
    fn multiply(&mut self, exponent: i32) -> usize {
        let one = |x: &mut T| {
            let (product, replaced) = times_power(x.f64(), exponent);
            *x = product;
            usize::from(replaced)
        };
        let vectors = |v: &mut Vec<[T; 3]>| -> usize {
            let chunk =
                |_, v: &mut [[T; 3]]| v.as_flattened_mut().iter_mut().map(one).sum::<usize>();
            parallel::map_each(v.chunks_mut(CHUNK), chunk)
                .into_iter()
                .sum()
        };
        let [points, normals] = [&mut self.points, &mut self.normals].map(vectors);
        let attributes: usize = self.attributes.iter_mut().flatten().map(one).sum();
        let grid = self.grid.lower.iter_mut().chain([&mut self.grid.spacing]);
        points + normals + attributes + grid.map(one).sum::<usize>()
    }
}

/// Exponent of 2 of the largest of some numbers; minus infinity where all are 0.
fn exponent<T: Real>(numbers: &[T]) -> f64 {
    let larger = |a: T, b: T| if b > a { b } else { a };
    let magnitude = |i: usize| numbers[i].abs();
    parallel::reduce(numbers.len(), T::zero(), magnitude, larger)
        .f64()
        .log2()
}

/// `x · 2^exponent`, or the nearest number of the type, 0 for NaN; and whether it is not the product.
fn times_power<T: Real>(x: f64, exponent: i32) -> (T, bool) {
    // In two steps: the power may be out of range where the product is not.
    let half = exponent / 2;
    let product = x * 2f64.powi(half) * 2f64.powi(exponent - half);
    let most = T::max_value();
    match T::of(product) {
        y if y.is_finite() => (y, false),
        y if y.is_nan() => (T::zero(), true),
        y => (if y > T::zero() { most } else { -most }, true),
    }
}
