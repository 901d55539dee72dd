//! A shape: a kind of body and the values of its parameters.

use std::sync::Arc;

use isograd_element::vector::{cross, normalized};

use crate::bodies;
use crate::jet::{Jet, PARAMETER, U, V, slopes, values};
use crate::kind::{Kind, Parameter, ShapeError, names};
use crate::measure;
use crate::surface::Surface;

/// A place on the surface that stays on the same material point when parameters or time change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCoordinate {
    /// Patch, from 0.
    pub patch: u32,
    /// First coordinate, in `(0, 1)`.
    pub u: f64,
    /// Second coordinate, in `(0, 1)`.
    pub v: f64,
}

/// A point of the surface and its first derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, in the shape's unit.
    pub position: [f64; 3],
    /// `∂x/∂u`.
    pub along_u: [f64; 3],
    /// `∂x/∂v`.
    pub along_v: [f64; 3],
}

impl SurfacePoint {
    /// `∂x/∂u × ∂x/∂v`: outward, of the length of the area element.
    pub fn area_vector(&self) -> [f64; 3] {
        cross(self.along_u, self.along_v)
    }

    /// Outward unit normal; `None` where the map degenerates.
    pub fn normal(&self) -> Option<[f64; 3]> {
        normalized(self.area_vector())
    }
}

/// A parametric body.
#[derive(Clone)]
pub struct Shape {
    kind: &'static Kind,
    values: Vec<f64>,
    pub(crate) surface: Arc<dyn Surface>,
}

impl std::fmt::Debug for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut out = f.debug_struct(self.kind.name);
        for (parameter, value) in self.parameters() {
            out.field(parameter.name, &value);
        }
        out.finish()
    }
}

/// Every shape, with its default parameters.
pub fn all() -> Vec<Shape> {
    let built = bodies::KINDS.iter().map(|&kind| Shape::new(kind));
    // A default that its own kind refuses is a mistake of this crate; `every_default_builds` tests it.
    built.filter_map(Result::ok).collect()
}

/// The shape called `name`, with its default parameters.
///
/// # Errors
/// [`ShapeError::UnknownShape`], which lists the names there are.
pub fn by_name(name: &str) -> Result<Shape, ShapeError> {
    match bodies::KINDS.iter().find(|kind| kind.name == name) {
        Some(kind) => Shape::new(kind),
        None => Err(ShapeError::UnknownShape {
            name: name.into(),
            known: names(bodies::KINDS.iter().map(|kind| kind.name)),
        }),
    }
}

impl Shape {
    fn new(kind: &'static Kind) -> Result<Self, ShapeError> {
        Self::with_values(kind, kind.parameters.iter().map(|p| p.default).collect())
    }

    fn with_values(kind: &'static Kind, values: Vec<f64>) -> Result<Self, ShapeError> {
        for (index, &value) in values.iter().enumerate() {
            kind.check(index, value)?;
        }
        let jets: Vec<Jet> = values.iter().map(|&x| Jet::constant(x)).collect();
        let surface = Arc::from((kind.build)(&jets)?);
        Ok(Self {
            kind,
            values,
            surface,
        })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.kind.name
    }

    /// What it is and what is known of it in closed form, in one line.
    pub fn summary(&self) -> &'static str {
        self.kind.summary
    }

    /// Its parameters and their values, in the order of [`Shape::values`].
    pub fn parameters(&self) -> impl Iterator<Item = (&'static Parameter, f64)> {
        self.kind.parameters.iter().zip(self.values.iter().copied())
    }

    /// The values of its parameters.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value of one parameter.
    ///
    /// # Errors
    /// An unknown name.
    pub fn get(&self, name: &str) -> Result<f64, ShapeError> {
        Ok(self.values[self.kind.index(name)?])
    }

    /// Sets one parameter. On an error nothing changes.
    ///
    /// # Errors
    /// An unknown name, a value out of range, or one that makes no body with the other values.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ShapeError> {
        self.set_all([(name, value)])
    }

    /// Sets several parameters at once: only the end result has to make a body. On an error nothing
    /// changes.
    ///
    /// # Errors
    /// As [`Shape::set`].
    pub fn set_all<'a>(
        &mut self,
        changes: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<(), ShapeError> {
        let mut values = self.values.clone();
        for (name, value) in changes {
            values[self.kind.index(name)?] = value;
        }
        *self = Self::with_values(self.kind, values)?;
        Ok(())
    }

    /// The surface made of other numbers than the values.
    pub(crate) fn build(&self, jets: &[Jet]) -> Result<Box<dyn Surface>, ShapeError> {
        (self.kind.build)(jets)
    }

    /// Whether points are differentiable in the parameter at `index`; no, where there is none.
    pub fn is_differentiable(&self, index: usize) -> bool {
        let parameter = self.kind.parameters.get(index);
        parameter.is_some_and(|parameter| !parameter.whole)
    }

    /// The name of the parameter that is time, for a shape that moves.
    pub fn time_parameter(&self) -> Option<&'static str> {
        self.kind.time.map(|index| self.kind.parameters[index].name)
    }

    /// Number of patches of its surface.
    pub fn patches(&self) -> usize {
        self.surface.patches()
    }

    /// The surface at a coordinate; `None` where there is no such patch.
    pub fn at(&self, coordinate: SurfaceCoordinate) -> Option<SurfacePoint> {
        let SurfaceCoordinate { patch, u, v } = coordinate;
        ((patch as usize) < self.patches()).then(|| evaluate(&*self.surface, patch as usize, u, v))
    }

    /// `(N, 3)` derivatives of the points at fixed surface coordinates with respect to one parameter,
    /// exact to rounding: the tangent map `∂x/∂p`. Zero at coordinates of patches that are not there.
    ///
    /// Not differentiable: which samples of a union are buried, and whole-number parameters (their
    /// derivative is given as zero).
    ///
    /// # Errors
    /// An unknown name.
    pub fn tangent(
        &self,
        parameter: &str,
        coordinates: &[SurfaceCoordinate],
    ) -> Result<Vec<[f64; 3]>, ShapeError> {
        let index = self.kind.index(parameter)?;
        let mut jets: Vec<Jet> = self.values.iter().map(|&x| Jet::constant(x)).collect();
        if !self.kind.parameters[index].whole {
            jets[index] = Jet::variable(self.values[index], PARAMETER);
        }
        let surface = (self.kind.build)(&jets)?;
        let slope = |c: &SurfaceCoordinate| {
            if c.patch as usize >= surface.patches() {
                return [0.0; 3];
            }
            let (u, v) = (Jet::constant(c.u), Jet::constant(c.v));
            slopes(surface.map(c.patch as usize, u, v), PARAMETER)
        };
        Ok(coordinates.iter().map(slope).collect())
    }

    /// `(N, 3)` velocity of the material points at `coordinates`, in unit length per unit time;
    /// `None` for a shape that does not move.
    pub fn velocity(&self, coordinates: &[SurfaceCoordinate]) -> Option<Vec<[f64; 3]>> {
        let time = self.kind.time?;
        self.tangent(self.kind.parameters[time].name, coordinates)
            .ok()
    }

    /// Exact signed distance from `point`, negative inside; `None` where it is not known.
    pub fn distance(&self, point: [f64; 3]) -> Option<f64> {
        self.surface.distance(point)
    }

    /// Whether `point` is inside; `None` where that is not known.
    pub fn contains(&self, point: [f64; 3]) -> Option<bool> {
        self.surface.contains(point)
    }

    /// Volume in unit length³: closed form where the body has one, else by quadrature over its
    /// surface, to about 1e-10 relative, or 1e-5 where the body is a union of overlapping parts.
    pub fn volume(&self) -> f64 {
        let closed = self.surface.volume();
        closed.unwrap_or_else(|| measure::measure(&*self.surface).volume)
    }

    /// Area in unit length²: as [`Shape::volume`].
    pub fn area(&self) -> f64 {
        let closed = self.surface.area();
        closed.unwrap_or_else(|| measure::measure(&*self.surface).area)
    }
}

/// The point of `patch` at `(u, v)` and its derivatives.
pub(crate) fn evaluate(surface: &dyn Surface, patch: usize, u: f64, v: f64) -> SurfacePoint {
    let x = surface.map(patch, Jet::variable(u, U), Jet::variable(v, V));
    SurfacePoint {
        position: values(x),
        along_u: slopes(x, U),
        along_v: slopes(x, V),
    }
}
