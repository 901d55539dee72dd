//! Shapes: a kind of body with values of its parameters.

use std::sync::Arc;

use isograd_element::vector::{cross, normalized};

use crate::bodies;
use crate::jet::{Jet, U, V, slopes, values};
use crate::kind::{Kind, Parameter, ShapeError, names};
use crate::material::at;
use crate::measure;
use crate::surface::Surface;

/// Surface coordinate of a material point: it stays the same when parameters or time change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCoordinate {
    /// Index of the patch, from 0.
    pub patch: u32,
    /// First coordinate, in `(0, 1)`.
    pub u: f64,
    /// Second coordinate, in `(0, 1)`.
    pub v: f64,
}

/// A point of the surface and its first derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, in the shape's unit.
    pub position: [f64; 3],
    /// `∂x/∂u`.
    pub along_u: [f64; 3],
    /// `∂x/∂v`.
    pub along_v: [f64; 3],
}

impl SurfacePoint {
    /// `∂x/∂u × ∂x/∂v`: points outward; its length is the area element.
    pub fn area_vector(&self) -> [f64; 3] {
        cross(self.along_u, self.along_v)
    }

    /// Outward unit normal; `None` where the map from the square is degenerate.
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

/// All shapes with default parameters.
pub fn all() -> Vec<Shape> {
    let shapes = bodies::KINDS.iter().map(|&kind| Shape::new(kind));
    // No default is refused: a test compares the names.
    shapes.filter_map(Result::ok).collect()
}

/// The shape `name` with default parameters.
///
/// # Errors
/// [`ShapeError::UnknownShape`], which lists all names.
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

    /// Name of the kind.
    pub fn name(&self) -> &'static str {
        self.kind.name
    }

    /// Description in one line, with the quantities known in closed form.
    pub fn summary(&self) -> &'static str {
        self.kind.summary
    }

    /// Parameters and their values, in the order of [`Shape::values`].
    pub fn parameters(&self) -> impl Iterator<Item = (&'static Parameter, f64)> {
        self.kind.parameters.iter().zip(self.values.iter().copied())
    }

    /// Values of the parameters.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Value of one parameter.
    ///
    /// # Errors
    /// An unknown name.
    pub fn get(&self, name: &str) -> Result<f64, ShapeError> {
        Ok(self.values[self.kind.index(name)?])
    }

    /// Sets one parameter. On an error nothing changes.
    ///
    /// # Errors
    /// An unknown name, a value out of range, or one that forms no body with the other values.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ShapeError> {
        self.set_all([(name, value)])
    }

    /// Sets several parameters at once; only the final values have to form a body. On an error nothing
    /// changes.
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

    /// The surface with a derivative slot for each of the given parameters, in their order.
    pub(crate) fn with_slots(
        &self,
        parameters: impl IntoIterator<Item = usize>,
    ) -> Result<Box<dyn Surface>, ShapeError> {
        let mut jets: Vec<Jet> = self.values.iter().map(|&x| Jet::constant(x)).collect();
        for (slot, parameter) in parameters.into_iter().enumerate() {
            jets[parameter] = Jet::variable(self.values[parameter], slot);
        }
        (self.kind.build)(&jets)
    }

    /// Whether points are differentiable in the parameter at `index`; false if there is none.
    pub fn is_differentiable(&self, index: usize) -> bool {
        let parameter = self.kind.parameters.get(index);
        parameter.is_some_and(|parameter| !parameter.whole)
    }

    /// Name of the time parameter of a moving shape.
    pub fn time_parameter(&self) -> Option<&'static str> {
        self.kind.time.map(|index| self.kind.parameters[index].name)
    }

    /// Number of patches of the surface.
    pub fn patches(&self) -> usize {
        self.surface.patches()
    }

    /// The surface at a coordinate; `None` if the shape has no such patch.
    pub fn at(&self, coordinate: SurfaceCoordinate) -> Option<SurfacePoint> {
        let SurfaceCoordinate { patch, u, v } = coordinate;
        ((patch as usize) < self.patches()).then(|| evaluate(&*self.surface, patch as usize, u, v))
    }

    /// `(N, 3)` derivatives of the points at fixed surface coordinates with respect to one parameter,
    /// exact to rounding: the tangent map `∂x/∂p`. Zero on patches that the shape does not have.
    ///
    /// Not differentiable: which samples of a union are inside another part, and integer parameters (their
    /// derivative is zero).
    ///
    /// # Errors
    /// An unknown name.
    pub fn tangent(
        &self,
        parameter: &str,
        coordinates: &[SurfaceCoordinate],
    ) -> Result<Vec<[f64; 3]>, ShapeError> {
        let index = self.kind.index(parameter)?;
        let surface = self.with_slots(self.is_differentiable(index).then_some(index))?;
        let slope = |c: &SurfaceCoordinate| match (c.patch as usize) < surface.patches() {
            true => slopes(at(&*surface, c), 0),
            false => [0.0; 3],
        };
        Ok(coordinates.iter().map(slope).collect())
    }

    /// `(N, 3)` velocity of the material points at `coordinates`, in unit length per unit time;
    /// `None` for a static shape.
    pub fn velocity(&self, coordinates: &[SurfaceCoordinate]) -> Option<Vec<[f64; 3]>> {
        let time = self.kind.time?;
        self.tangent(self.kind.parameters[time].name, coordinates)
            .ok()
    }

    /// Exact signed distance of `point`, negative inside; `None` where it is unknown.
    pub fn distance(&self, point: [f64; 3]) -> Option<f64> {
        self.surface.distance(point)
    }

    /// Whether `point` is inside; `None` where that is unknown.
    pub fn contains(&self, point: [f64; 3]) -> Option<bool> {
        self.surface.contains(point)
    }

    /// Volume in unit length³: in closed form, or by quadrature over the surface with a relative error of
    /// about 1e-10, or 1e-5 for a union of overlapping parts.
    pub fn volume(&self) -> f64 {
        let closed = self.surface.volume();
        closed.unwrap_or_else(|| measure::measure(&*self.surface).volume)
    }

    /// Area in unit length², with the errors of [`Shape::volume`].
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
