//! One fit: its options, its steps, its state.

use std::ops::ControlFlow;

use isograd::PointCloud;
use isograd_backend::View;
use isograd_shapes::Shape;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::loss::Region;
use crate::optimize::{self, Optimizer, Step};
use crate::problem::{Fingerprints, Parts, Problem};
use crate::target::Target;
use crate::variables::{Degrees, Variables};

/// Sets of samples before a fit that draws them anew may be done: by chance the loss of one is lower than that
/// of those after it, and parameters that hardly change the field take their time.
const FEWEST_SETS: usize = 10;

/// How a fit is done.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where the fields are compared.
    pub region: Region,
    /// The method of descent.
    pub optimizer: Optimizer,
    /// The most epochs, which are steps of the optimizer.
    pub epochs: usize,
    /// The fit is done when the mean `|Δφ|`, in cells, is below this.
    pub tolerance: f64,
    /// With L-BFGS the fit is done when the lowest loss has not fallen by a thousandth of itself for this many
    /// epochs, and ten sets of samples where they are drawn anew; 0 for never. Adam is not held to it: its
    /// rate has to fall first.
    pub patience: usize,
    /// Options of the reconstruction; its checks are left out. A shape knows its outside: with it the automatic
    /// orientation becomes [`orient::Method::Signs`](isograd::orient::Method::Signs). Sensors are not passed on; and
    /// with the signs of the call before the loss is no function of the variables alone.
    pub reconstruction: isograd::Options,
    /// Where reconstructions and pullbacks are computed, in `f64`. The shape, the loss and the descent stay on the CPU:
    /// φ and its cotangent are copied for every evaluation.
    pub backend: isograd::Backend,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            region: Region::default(),
            optimizer: Optimizer::default(),
            epochs: 500,
            tolerance: 1e-6,
            patience: 25,
            reconstruction: isograd::Options::default(),
            backend: isograd::Backend::Cpu,
        }
    }
}

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The mean difference fell below the tolerance.
    Met,
    /// No lower point was found, or none that is worth the way: a minimum, as far as rounding and kinks let
    /// one see.
    Minimum,
    /// All epochs are done.
    Epochs,
    /// The observer asked to stop.
    Stopped,
}

/// One line of the history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Its number; 0 is the start.
    pub epoch: usize,
    /// Reconstructions so far, and as many pullbacks.
    pub evaluations: usize,
    /// What is made small: the sum of the next three.
    pub loss: f64,
    /// Mean squared difference of φ, in cells².
    pub data_loss: f64,
    /// The smoothness term of raw points.
    pub smoothness_loss: f64,
    /// What parameters beyond their bounds cost.
    pub bounds_loss: f64,
    /// Norm of the gradient of the loss, in the descent's own variables.
    pub gradient_norm: f64,
    /// Mean absolute difference of φ, in cells.
    pub mean_error: f64,
    /// The fitted parameters of a shape; empty for raw points.
    pub parameters: Vec<f64>,
}

/// All that a run needs to go on as if it had never stopped.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    fingerprints: Fingerprints,
    state: optimize::State<Parts>,
    /// The samples in use: their number, and where the shape was when they were drawn.
    sampled: Option<(u64, Vec<f64>)>,
    history: Vec<Epoch>,
}

impl Checkpoint {
    /// The last epoch that was done.
    pub fn epoch(&self) -> usize {
        self.history.len().saturating_sub(1)
    }
}

/// A fit that is under way.
pub struct Fit {
    options: Options,
    problem: Problem,
    fingerprints: Fingerprints,
    state: optimize::State<Parts>,
    sampled: Option<(u64, Vec<f64>)>,
    history: Vec<Epoch>,
}

impl Fit {
    /// A fit of `variables` to `target`, at its start: epoch 0.
    ///
    /// # Errors
    /// Options that make no sense; a start whose loss can't be taken.
    pub fn new(target: &Target, variables: Variables, options: Options) -> Result<Self, Error> {
        let (mut problem, fingerprints) = prepare(target, variables, &options)?;
        let x = problem.degrees.start();
        let here = problem.evaluate(&x);
        let here = here.map_err(|error| Error::Start(Box::new(error)))?;
        let mut fit = Self {
            state: optimize::State::new(&options.optimizer, x, here),
            sampled: None,
            history: Vec::new(),
            options,
            problem,
            fingerprints,
        };
        fit.record(1);
        Ok(fit)
    }

    /// A fit that goes on from where another one of the same target, variables and options was: to the last
    /// bit as that one would have. The number of epochs and the tolerance may be others.
    ///
    /// # Errors
    /// A checkpoint of another fit.
    pub fn resume(
        target: &Target,
        variables: Variables,
        options: Options,
        checkpoint: Checkpoint,
    ) -> Result<Self, Error> {
        let (mut problem, fingerprints) = prepare(target, variables, &options)?;
        let variables = problem.degrees.start().len();
        let difference = fingerprints.difference(&checkpoint.fingerprints);
        let lengths = !checkpoint.state.fits(&options.optimizer, variables);
        let lengths = lengths || checkpoint.history.is_empty();
        if let Some(what) = difference.or(lengths.then_some("numbers of variables")) {
            return Err(Error::Resume { what });
        }
        if let Some((turn, x)) = &checkpoint.sampled {
            problem.sample(x, *turn)?;
        }
        Ok(Self {
            options,
            problem,
            fingerprints,
            state: checkpoint.state,
            sampled: checkpoint.sampled,
            history: checkpoint.history,
        })
    }

    /// The state, to [resume](Self::resume) from.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            fingerprints: self.fingerprints,
            state: self.state.clone(),
            sampled: self.sampled.clone(),
            history: self.history.clone(),
        }
    }

    /// One epoch, unless the fit is done.
    ///
    /// # Errors
    /// [`Error::Stuck`]; the state is then that of the epoch before.
    pub fn step(&mut self) -> Result<Option<Outcome>, Error> {
        if let Some(outcome) = self.done() {
            return Ok(Some(outcome));
        }
        let epoch = self.epoch() + 1;
        let stuck = |error| Error::Stuck {
            epoch,
            source: Box::new(error),
        };
        let mut evaluations = 0;
        let problem = &mut self.problem;
        let mut function = |x: &[f64]| {
            evaluations += 1;
            problem.evaluate(x)
        };
        let step = self.state.step(&self.options.optimizer, &mut function);
        if step.map_err(stuck)? == Step::Stalled {
            return Ok(Some(Outcome::Minimum));
        }
        if self
            .problem
            .resample()
            .is_some_and(|every| epoch.is_multiple_of(every))
        {
            self.resample(epoch as u64).map_err(stuck)?;
            evaluations += 1;
        }
        self.record(evaluations);
        Ok(self.done())
    }

    /// Epochs until the fit is done, or `observer`, which is called after each one, breaks.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn run(
        &mut self,
        observer: &mut dyn FnMut(&mut Self) -> ControlFlow<()>,
    ) -> Result<Outcome, Error> {
        loop {
            let before = self.epoch();
            if let Some(outcome) = self.step()? {
                if self.epoch() > before {
                    let _ = observer(self);
                }
                return Ok(outcome);
            }
            if observer(self).is_break() {
                return Ok(Outcome::Stopped);
            }
        }
    }

    fn done(&self) -> Option<Outcome> {
        if self.state.here.detail.mean_error < self.options.tolerance {
            Some(Outcome::Met)
        } else if self.is_flat() {
            Some(Outcome::Minimum)
        } else if self.epoch() >= self.options.epochs {
            Some(Outcome::Epochs)
        } else {
            None
        }
    }

    /// Whether the loss has not fallen for so long that it hardly will.
    fn is_flat(&self) -> bool {
        let sets = FEWEST_SETS * self.problem.resample().unwrap_or(0);
        let patience = self.options.patience.max(sets);
        let steady = matches!(self.options.optimizer, Optimizer::Lbfgs(_));
        let steady = steady && self.options.patience > 0;
        if !steady || self.history.len() <= patience {
            return false;
        }
        let lowest = |epochs: &[Epoch]| epochs.iter().fold(f64::INFINITY, |m, e| m.min(e.loss));
        let (before, since) = self.history.split_at(self.history.len() - patience);
        lowest(since) > 0.999 * lowest(before)
    }

    /// New samples where the shape is now. What the method remembers holds for these too, as far as both
    /// stand for the same shape.
    fn resample(&mut self, turn: u64) -> Result<(), Error> {
        let x = self.state.x.clone();
        self.problem.sample(&x, turn)?;
        self.state.here = self.problem.evaluate(&x)?;
        self.sampled = Some((turn, x));
        Ok(())
    }

    fn record(&mut self, evaluations: usize) {
        let optimize::State { x, here, .. } = &self.state;
        let before = self.history.last().map_or(0, |epoch| epoch.evaluations);
        self.history.push(Epoch {
            epoch: self.history.len(),
            evaluations: before + evaluations,
            loss: here.value,
            data_loss: here.detail.data,
            smoothness_loss: here.detail.smoothness,
            bounds_loss: here.detail.bounds,
            gradient_norm: optimize::norm(&here.gradient),
            mean_error: here.detail.mean_error,
            parameters: match &self.problem.degrees {
                Degrees::Shape(shape) => shape.values(x),
                Degrees::Points(_) => Vec::new(),
            },
        });
    }

    /// The last epoch that was done; 0 is the start.
    pub fn epoch(&self) -> usize {
        self.history.len().saturating_sub(1)
    }

    /// Every epoch so far, the start first.
    pub fn history(&self) -> &[Epoch] {
        &self.history
    }

    /// Names of the fitted parameters, in the order of [`Epoch::parameters`].
    pub fn parameter_names(&self) -> Vec<&'static str> {
        match &self.problem.degrees {
            Degrees::Shape(shape) => shape.names().collect(),
            Degrees::Points(_) => Vec::new(),
        }
    }

    /// The shape as it is now; `None` for raw points.
    pub fn shape(&self) -> Option<Shape> {
        match &self.problem.degrees {
            Degrees::Shape(shape) => shape.at(&self.state.x).ok(),
            Degrees::Points(_) => None,
        }
    }

    /// The points as they are now.
    ///
    /// # Errors
    /// None, once a step was taken there.
    pub fn cloud(&self) -> Result<PointCloud<f64>, Error> {
        self.problem.degrees.cloud(&self.state.x)
    }

    /// The field and the surface as they are now.
    ///
    /// # Errors
    /// Those of a device; on the CPU none, once a step was taken there.
    pub fn reconstruction(&mut self) -> Result<View<'_, f64>, Error> {
        self.problem.reconstruction(&self.state.x)
    }

    /// Who computes: `cpu`, or a backend and its device, such as `cuda: NVIDIA H100`.
    pub fn backend(&self) -> &str {
        self.problem.plan.name()
    }

    /// Why it is the CPU, where that was left to the program.
    pub fn backend_note(&self) -> Option<&str> {
        self.problem.plan.note()
    }
}

fn prepare(
    target: &Target,
    variables: Variables,
    options: &Options,
) -> Result<(Problem, Fingerprints), Error> {
    if options.tolerance.is_nan() {
        return Err(Error::Option {
            what: "the tolerance",
            value: options.tolerance,
            range: "a number of cells, 0 for none",
        });
    }
    let problem = Problem::new(target, variables, options)?;
    let mut others = format!("{:?} {:?}", options.region, options.optimizer);
    // Every device rounds in its own way.
    others += match problem.plan.name() {
        "cpu" => "",
        device => device,
    };
    let reconstruction = &options.reconstruction;
    let fingerprints = Fingerprints::new(target, &problem.degrees, reconstruction, &others);
    Ok((problem, fingerprints))
}
