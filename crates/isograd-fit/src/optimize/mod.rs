//! Descent: from a point with a value and a gradient to a lower one, a step at a time.
//!
//! Both optimizers store their memory in a serializable [`State`]: a run that was stopped and resumed takes the same
//! steps, to the last bit, as an uninterrupted one.
//!
//! # Why these are here
//!
//! [`argmin`](https://docs.rs/argmin) 0.11.0 was evaluated first. It has no Adam, and its L-BFGS does not suit a
//! function that is expensive and not defined everywhere:
//!
//! - A point without a value (parameters that make no body, a sample outside the grid) cannot be handled: its
//!   strong-Wolfe searches end with an error on a value that is not finite, and on any error the solver drops
//!   the problem and the parameters with it, so that the run ends where it should take a shorter step.
//! - It keeps every pair `(s, y)`, also those with `s·y ≤ 0`. After a search that ended early the direction may
//!   then point uphill, which it reports as an error
//!   ([#400](https://github.com/argmin-rs/argmin/issues/400)). Reconstruction is smooth only piecewise, so
//!   that this does happen.
//! - It evaluates value and gradient separately, and again at the end of each search. Here one evaluation gives
//!   both, at the cost of a reconstruction.
//! - Its state contains infinities, which JSON cannot represent.
//!
//! The recursion itself is thirty lines, and so is Adam.

mod adam;
mod lbfgs;
mod line_search;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use adam::{Adam, Decay};
pub use lbfgs::Lbfgs;

/// Number of times that a step is halved before a failing function ends the run.
pub const HALVINGS: usize = 12;

/// An optimizer and its options.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Optimizer {
    /// Limited-memory BFGS with a search for the strong Wolfe conditions: the default. Few steps, each one
    /// lower than the one before.
    Lbfgs(Lbfgs),
    /// Adam: steps of a given length, independent of the size of the gradient; the loss may increase.
    Adam(Adam),
}

impl Optimizer {
    /// L-BFGS whose first step has the length `rate`, by default that of [`Lbfgs::default`].
    pub fn lbfgs(rate: Option<f64>) -> Self {
        let default = Lbfgs::default();
        Self::Lbfgs(Lbfgs {
            first_step: rate.unwrap_or(default.first_step),
            ..default
        })
    }

    /// Adam with this rate, by default that of [`Adam::default`].
    pub fn adam(rate: Option<f64>, decay: Decay) -> Self {
        let default = Adam::default();
        Self::Adam(Adam {
            rate: rate.unwrap_or(default.rate),
            decay,
            ..default
        })
    }
}

impl Default for Optimizer {
    fn default() -> Self {
        Self::Lbfgs(Lbfgs::default())
    }
}

/// Value and gradient of the function at a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation<D> {
    /// Value.
    pub value: f64,
    /// Gradient.
    pub gradient: Vec<f64>,
    /// Additional results of the function.
    pub detail: D,
}

/// Current point, and memory of the optimizer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State<D> {
    /// The point.
    pub x: Vec<f64>,
    /// Value and gradient there.
    pub here: Evaluation<D>,
    memory: Memory,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Memory {
    Lbfgs(lbfgs::Memory),
    Adam(adam::Memory),
}

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The point moved.
    Moved,
    /// No lower point was found along the direction of steepest descent: a minimum, up to rounding and the kinks of
    /// the function.
    Stalled,
}

/// The function to be minimized: value and gradient at a point, or an error.
pub trait Function<D, E>: FnMut(&[f64]) -> Result<Evaluation<D>, E> {}
impl<D, E, F: FnMut(&[f64]) -> Result<Evaluation<D>, E>> Function<D, E> for F {}

impl<D: Clone> State<D> {
    /// The start at `x`, where the function has the value `here`.
    pub fn new(optimizer: &Optimizer, x: Vec<f64>, here: Evaluation<D>) -> Self {
        let memory = match optimizer {
            Optimizer::Lbfgs(_) => Memory::Lbfgs(lbfgs::Memory::default()),
            Optimizer::Adam(_) => Memory::Adam(adam::Memory::new(x.len())),
        };
        Self { x, here, memory }
    }

    /// Whether the state has the lengths that a state of `variables` for `optimizer` has.
    pub fn fits(&self, optimizer: &Optimizer, variables: usize) -> bool {
        let memory = match (optimizer, &self.memory) {
            (Optimizer::Lbfgs(_), Memory::Lbfgs(memory)) => memory.fits(variables),
            (Optimizer::Adam(_), Memory::Adam(memory)) => memory.fits(variables),
            _ => false,
        };
        memory && self.x.len() == variables && self.here.gradient.len() == variables
    }

    /// One step. Where the function has no value, or one that is not finite, the step is shortened.
    ///
    /// # Errors
    /// The error of the function where even the shortest step ends in a point without a value; the state is then
    /// unchanged.
    pub fn step<E>(
        &mut self,
        optimizer: &Optimizer,
        function: &mut impl Function<D, E>,
    ) -> Result<Step, E> {
        match (optimizer, &mut self.memory) {
            (Optimizer::Lbfgs(options), Memory::Lbfgs(memory)) => {
                memory.step(options, &mut self.x, &mut self.here, function)
            }
            (Optimizer::Adam(options), Memory::Adam(memory)) => {
                memory.step(options, &mut self.x, &mut self.here, function)
            }
            // The memory of one optimizer is of no use to the other.
            _ => {
                *self = Self::new(optimizer, self.x.clone(), self.here.clone());
                self.step(optimizer, function)
            }
        }
    }
}

/// `Σ a_i b_i`, in order.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `√(Σ a_i²)`.
pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// `max |a_i|`.
fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, x| x.abs().max(m))
}

/// `x + step·d`.
fn moved(x: &[f64], step: f64, d: &[f64]) -> Vec<f64> {
    x.iter().zip(d).map(|(x, d)| x + step * d).collect()
}

fn is_finite<D>(evaluation: &Evaluation<D>) -> bool {
    evaluation.value.is_finite() && evaluation.gradient.iter().all(|g| g.is_finite())
}
