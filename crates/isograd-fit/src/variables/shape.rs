//! Parameters of a shape, through material points of its surface.
//!
//! Each variable is a parameter in units of its size at the start. Bounds of parameters are enforced by clamping them
//! before the points are evaluated, and by a penalty of the squared distance of a variable beyond a bound: there is
//! always a shape to evaluate, and no decrease of the loss beyond a bound.

use isograd::PointCloud;
use isograd_shapes::{Parameter, Sampling, Shape, ShapeError, SurfaceCoordinate};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::error::Error;
use crate::fingerprint::Fingerprint;

/// Maximum number of random starts.
const TRIES: usize = 100;

/// Parameters of a shape as variables.
#[derive(Clone, Debug)]
pub struct ShapeParameters {
    /// The shape; the parameters that are not fitted keep its values.
    pub shape: Shape,
    /// Names of the fitted parameters; `None` for all but integers and time.
    pub only: Option<Vec<String>>,
    /// Surface coordinates of the points; `None` to sample the shape at its start. With the coordinates of the target
    /// cloud's samples the fit has no sampling error.
    pub coordinates: Option<Vec<SurfaceCoordinate>>,
    /// Number of samples, if they are drawn.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// Number of epochs between new samples; `None` for never. Large changes of parameters make the old samples uneven
    /// and expose parts of a union without samples.
    pub resample: Option<usize>,
    /// Start values.
    pub start: Start,
}

impl ShapeParameters {
    /// All parameters of `shape` but integers and time, from its own values, with 20,000 samples.
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            only: None,
            coordinates: None,
            samples: 20_000,
            seed: 1,
            resample: None,
            start: Start::Given,
        }
    }

    /// The shape at the start.
    ///
    /// # Errors
    /// A parameter that is unknown or cannot be fitted; no random start that is a valid shape.
    pub fn started(&self) -> Result<Shape, Error> {
        started(&self.shape, &chosen(self)?, self.start)
    }
}

/// Start values of fitted parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Start {
    /// Values of the shape.
    #[default]
    Given,
    /// Values of the shape, each times a random number between `1/(1+spread)` and `1+spread`, uniform in the
    /// logarithm; drawn again if they form no valid shape.
    Random {
        /// Seed of the random numbers.
        seed: u64,
        /// At least 0.
        spread: f64,
    },
}

/// A fitted parameter.
#[derive(Clone, Copy, Debug)]
struct Degree {
    /// Index in the values of the shape.
    index: usize,
    parameter: Parameter,
    /// Change of the parameter per unit of the variable.
    scale: f64,
}

impl Degree {
    /// The value of the parameter, within its bounds.
    fn value(&self, x: f64) -> f64 {
        (self.scale * x).clamp(self.parameter.min, self.parameter.max)
    }

    /// Signed distance of the variable beyond a bound, 0 within.
    fn overshoot(&self, x: f64) -> f64 {
        (self.scale * x - self.value(x)) / self.scale
    }
}

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Degrees {
    /// At the start.
    shape: Shape,
    degrees: Vec<Degree>,
    samples: usize,
    seed: u64,
    pub resample: Option<usize>,
    coordinates: Vec<SurfaceCoordinate>,
}

impl Degrees {
    pub fn new(options: ShapeParameters) -> Result<Self, Error> {
        let chosen = chosen(&options)?;
        let shape = started(&options.shape, &chosen, options.start)?;
        let degree = |&index: &usize| {
            let (parameter, value) = shape.parameters().nth(index)?;
            Some(Degree {
                index,
                parameter: *parameter,
                scale: scale(parameter, value),
            })
        };
        let mut degrees = Self {
            degrees: chosen.iter().filter_map(degree).collect(),
            samples: options.samples,
            seed: options.seed,
            resample: options.resample.filter(|&epochs| epochs > 0),
            coordinates: options.coordinates.unwrap_or_default(),
            shape,
        };
        if degrees.coordinates.is_empty() {
            degrees.sample(&degrees.start(), 0)?;
        }
        Ok(degrees)
    }

    pub fn start(&self) -> Vec<f64> {
        let value = |d: &Degree| self.shape.values()[d.index] / d.scale;
        self.degrees.iter().map(value).collect()
    }

    /// Draws samples of the shape at `x`; `turn` counts the sets of samples.
    pub fn sample(&mut self, x: &[f64], turn: u64) -> Result<(), Error> {
        let shape = self.at(x)?;
        let seed = self.seed.wrapping_add(turn);
        let samples = shape.sample::<f64>(self.samples, &Sampling::default(), seed)?;
        self.coordinates = samples.coordinates;
        Ok(())
    }

    /// The shape at `x`.
    pub fn at(&self, x: &[f64]) -> Result<Shape, ShapeError> {
        let mut shape = self.shape.clone();
        let values = self.degrees.iter().zip(x);
        shape.set_all(values.map(|(d, &x)| (d.parameter.name, d.value(x))))?;
        Ok(shape)
    }

    /// Names of the parameters, in the order of `x`.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.degrees.iter().map(|d| d.parameter.name)
    }

    /// The parameters at `x`.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        let values = self.degrees.iter().zip(x);
        values.map(|(d, &x)| d.value(x)).collect()
    }

    /// The samples at `x`, with the normals of the shape.
    pub fn cloud(&self, x: &[f64]) -> Result<PointCloud<f64>, Error> {
        let shape = self.at(x)?;
        let cloud = PointCloud::new(shape.points_at(&self.coordinates)?)?;
        Ok(cloud.with_normals(shape.normals_at(&self.coordinates)?)?)
    }

    pub fn pullback(&self, x: &[f64], points_bar: &[[f64; 3]]) -> Result<Vec<f64>, Error> {
        let places: Vec<usize> = self.degrees.iter().map(|d| d.index).collect();
        let shape = self.at(x)?;
        let mut bar = shape.pullback_of(&places, &self.coordinates, points_bar)?;
        for ((bar, degree), &x) in bar.iter_mut().zip(&self.degrees).zip(x) {
            // Beyond a bound the points do not move.
            let moves = degree.overshoot(x) == 0.0;
            *bar = if moves { *bar * degree.scale } else { 0.0 };
        }
        Ok(bar)
    }

    /// Sum of the squared distances beyond bounds.
    pub fn overshoot(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        let mut total = 0.0;
        for ((degree, &x), gradient) in self.degrees.iter().zip(x).zip(gradient) {
            let beyond = degree.overshoot(x);
            total += beyond * beyond;
            *gradient += 2.0 * beyond;
        }
        total
    }

    pub fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::default();
        hash.text(self.shape.name());
        hash.numbers(self.shape.values());
        for degree in &self.degrees {
            hash.text(degree.parameter.name);
        }
        for c in &self.coordinates {
            hash.number(c.patch.into());
            hash.numbers(&[c.u, c.v]);
        }
        hash.number(self.samples as u64);
        hash.number(self.seed);
        hash.number(self.resample.map_or(0, |epochs| epochs as u64));
        hash.finish()
    }
}

/// Indices of the fitted parameters, each once.
fn chosen(options: &ShapeParameters) -> Result<Vec<usize>, Error> {
    let shape = &options.shape;
    let place = |name: &str| shape.parameters().position(|(p, _)| p.name == name);
    let mut chosen = Vec::new();
    match &options.only {
        Some(names) => {
            for name in names {
                // For its error, which lists the names.
                shape.get(name)?;
                let index = place(name).filter(|&index| shape.is_differentiable(index));
                let index = index.ok_or_else(|| Error::Whole { name: name.clone() })?;
                chosen.push(index);
            }
        }
        None => {
            let time = shape.time_parameter().and_then(place);
            let free = |index: &usize| shape.is_differentiable(*index) && Some(*index) != time;
            chosen.extend((0..shape.values().len()).filter(free));
        }
    }
    chosen.sort_unstable();
    chosen.dedup();
    match chosen.is_empty() {
        true => Err(Error::NoParameters),
        false => Ok(chosen),
    }
}

/// The shape at the start.
fn started(shape: &Shape, chosen: &[usize], start: Start) -> Result<Shape, Error> {
    let Start::Random { seed, spread } = start else {
        return Ok(shape.clone());
    };
    if !(spread >= 0.0) || !spread.is_finite() {
        return Err(Error::Option {
            what: "the spread of the random start",
            value: spread,
            range: "0 or more, and finite",
        });
    }
    let mut random = Pcg64::seed_from_u64(seed);
    let mut tries = 0;
    loop {
        tries += 1;
        let mut started = shape.clone();
        let all: Vec<_> = shape.parameters().collect();
        let values = chosen.iter().map(|&index| {
            let (parameter, value) = all[index];
            // From −1 to 1.
            let lot = (random.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
            let value = value * (lot * spread.ln_1p()).exp();
            (parameter.name, value.clamp(parameter.min, parameter.max))
        });
        match started.set_all(values.collect::<Vec<_>>()) {
            Ok(()) => return Ok(started),
            Err(source) if tries == TRIES => return Err(Error::NoStart { tries, source }),
            Err(_) => {}
        }
    }
}

/// Size of a parameter: its value, or its default if that is 0, or a tenth of its range (of 10 at most).
fn scale(parameter: &Parameter, value: f64) -> f64 {
    let tenth = 0.1 * (parameter.max - parameter.min).min(10.0);
    let sizes = [value.abs(), parameter.default.abs(), tenth];
    sizes.into_iter().find(|&size| size > 0.0).unwrap_or(1.0)
}
