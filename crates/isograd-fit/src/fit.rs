//! One fit: its options, its steps, its state.

use std::ops::ControlFlow;

use isograd::PointCloud;
use isograd_backend::View;
use isograd_shapes::Shape;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::loss::Band;
use crate::optimize::{self, Optimizer, Step};
use crate::problem::{Fingerprints, LossTerms, Problem};
use crate::target::Target;
use crate::variables::{Degrees, Variables};

/// Minimum number of sets of samples where they are redrawn: by chance the loss of one set is lower than that of the
/// next ones, and parameters that hardly change the field converge slowly.
const FEWEST_SETS: usize = 10;

/// Options of a fit.
#[derive(Clone, Debug)]
pub struct Options {
    /// Cells on which the fields are compared.
    pub band: Band,
    /// Optimizer.
    pub optimizer: Optimizer,
    /// Maximum number of epochs: steps of the optimizer.
    pub epochs: usize,
    /// The fit ends when the mean `|Δφ|`, in cells, is below this.
    pub tolerance: f64,
    /// With L-BFGS the fit ends when the lowest loss has not fallen by a thousandth for this many epochs, and for ten
    /// sets of samples where they are redrawn; 0 for never. It does not apply to Adam, whose rate has to fall first.
    pub patience: usize,
    /// Options of the reconstruction; its checks are left out, and an automatic resolution of the surface is that of the
    /// grid, since its steps would be steps of the loss. A shape knows its outside: with it the automatic
    /// orientation becomes [`orient::Method::Signs`](isograd::orient::Method::Signs). Sensors are not passed on; and
    /// with the signs of the call before the loss is no function of the variables alone.
    pub reconstruction: isograd::Options,
    /// Backend of reconstructions and pullbacks, in `f64`. The shape, the loss and the optimizer stay on the CPU: φ and
    /// its cotangent are copied for every evaluation.
    pub backend: isograd::Backend,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            band: Band::default(),
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
    /// No lower point was found, or the loss has stopped falling: a minimum, up to rounding and kinks.
    Minimum,
    /// The maximum number of epochs was reached.
    Epochs,
    /// The observer stopped the run.
    Stopped,
}

/// Entry of the history: one epoch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Its number; 0 is the start.
    pub epoch: usize,
    /// Reconstructions so far, and as many pullbacks.
    pub evaluations: usize,
    /// Loss: the sum of the next three.
    pub loss: f64,
    /// Mean squared difference of φ, in cells².
    pub data_loss: f64,
    /// The smoothness term of raw points.
    pub smoothness_loss: f64,
    /// Penalty of parameters beyond their bounds.
    pub bounds_loss: f64,
    /// Norm of the gradient of the loss in the optimizer's variables.
    pub gradient_norm: f64,
    /// Mean absolute difference of φ, in cells.
    pub mean_error: f64,
    /// The fitted parameters of a shape; empty for raw points.
    pub parameters: Vec<f64>,
}

/// State of a fit, from which it can be resumed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    fingerprints: Fingerprints,
    state: optimize::State<LossTerms>,
    /// The samples in use: their number, and the variables when they were drawn.
    sampled: Option<(u64, Vec<f64>)>,
    history: Vec<Epoch>,
}

impl Checkpoint {
    /// The last completed epoch.
    pub fn epoch(&self) -> usize {
        self.history.len().saturating_sub(1)
    }
}

/// A fit in progress.
pub struct Fit {
    options: Options,
    problem: Problem,
    fingerprints: Fingerprints,
    state: optimize::State<LossTerms>,
    sampled: Option<(u64, Vec<f64>)>,
    history: Vec<Epoch>,
}

impl Fit {
    /// A fit of `variables` to `target`, at its start: epoch 0.
    ///
    /// # Errors
    /// Invalid options; a start whose loss can't be computed.
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

    /// Resumes a fit of the same target, variables and options from a checkpoint, with the bits of an uninterrupted
    /// run. The number of epochs and the tolerance may differ.
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

    /// Runs one epoch, unless the fit is finished.
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

    /// Runs epochs until the fit is finished or `observer`, called after each one, breaks.
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

    /// Whether the loss has stopped falling.
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

    /// Draws new samples of the current shape. The memory of the optimizer stays valid as far as both sets of samples
    /// represent the same shape.
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

    /// The last completed epoch; 0 is the start.
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

    /// The current shape; `None` for raw points.
    pub fn shape(&self) -> Option<Shape> {
        match &self.problem.degrees {
            Degrees::Shape(shape) => shape.at(&self.state.x).ok(),
            Degrees::Points(_) => None,
        }
    }

    /// The current points.
    ///
    /// # Errors
    /// None, once a step was taken there.
    pub fn cloud(&self) -> Result<PointCloud<f64>, Error> {
        self.problem.degrees.cloud(&self.state.x)
    }

    /// The current field and surface.
    ///
    /// # Errors
    /// Errors of a device; on the CPU none, once a step was taken there.
    pub fn reconstruction(&mut self) -> Result<View<'_, f64>, Error> {
        self.problem.reconstruction(&self.state.x)
    }

    /// Name of the backend: `cpu`, or a backend and its device, such as `cuda: NVIDIA H100`.
    pub fn backend(&self) -> &str {
        self.problem.plan.name()
    }

    /// Why `auto` selected the CPU.
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
    let mut others = format!("{:?} {:?}", options.band, options.optimizer);
    // Every device rounds in its own way.
    others += match problem.plan.name() {
        "cpu" => "",
        device => device,
    };
    let reconstruction = &options.reconstruction;
    let fingerprints = Fingerprints::new(target, &problem.degrees, reconstruction, &others);
    Ok((problem, fingerprints))
}
