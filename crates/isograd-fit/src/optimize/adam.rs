//! Adam (D. P. Kingma and J. Ba, "Adam: a method for stochastic optimization", 2015).

use serde::{Deserialize, Serialize};

use super::{Evaluation, Function, HALVINGS, Step, is_finite, moved};

/// Options of Adam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Adam {
    /// Step length in each variable, before the schedule.
    pub rate: f64,
    /// Schedule of the rate.
    pub decay: Decay,
    /// Decay of the mean gradient, `β₁`.
    pub beta1: f64,
    /// Decay of the mean square, `β₂`.
    pub beta2: f64,
    /// Constant `ε` added to the root of the mean square.
    pub epsilon: f64,
}

impl Default for Adam {
    fn default() -> Self {
        Self {
            rate: 0.02,
            decay: Decay::default(),
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-12,
        }
    }
}

/// Decrease of the rate from step to step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Decay {
    /// Constant rate.
    #[default]
    Constant,
    /// Half a cosine from 1 toward 0 over `steps`, with a lower bound of 0.01.
    Cosine {
        /// Number of steps.
        steps: usize,
    },
    /// Halved every `half_life` steps.
    Exponential {
        /// Number of steps.
        half_life: f64,
    },
}

impl Decay {
    /// Factor of the rate at step `t`, from 0.
    fn factor(self, t: u64) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Cosine { steps } => {
                let share = (t as f64 / steps.max(1) as f64).min(1.0);
                (0.5 + 0.5 * (std::f64::consts::PI * share).cos()).max(0.01)
            }
            Self::Exponential { half_life } => (-(t as f64) / half_life).exp2(),
        }
    }
}

/// Means of the gradient and of its square.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    steps: u64,
    mean: Vec<f64>,
    square: Vec<f64>,
}

impl Memory {
    pub fn new(variables: usize) -> Self {
        Self {
            steps: 0,
            mean: vec![0.0; variables],
            square: vec![0.0; variables],
        }
    }

    pub fn fits(&self, variables: usize) -> bool {
        self.mean.len() == variables && self.square.len() == variables
    }

    pub fn step<D, E>(
        &mut self,
        options: &Adam,
        x: &mut Vec<f64>,
        here: &mut Evaluation<D>,
        function: &mut impl Function<D, E>,
    ) -> Result<Step, E> {
        let mut next = self.clone();
        let d = next.direction(options, &here.gradient);
        let mut length = 1.0;
        for halving in 0.. {
            let trial = moved(x, length, &d);
            match function(&trial) {
                Ok(there) if is_finite(&there) => {
                    (*x, *here, *self) = (trial, there, next);
                    return Ok(Step::Moved);
                }
                Err(error) if halving == HALVINGS => return Err(error),
                Ok(_) if halving == HALVINGS => return Ok(Step::Stalled),
                _ => length *= 0.5,
            }
        }
        Ok(Step::Stalled)
    }

    /// The step and the updated means.
    fn direction(&mut self, options: &Adam, gradient: &[f64]) -> Vec<f64> {
        let Adam { beta1, beta2, .. } = *options;
        let rate = options.rate * options.decay.factor(self.steps);
        self.steps += 1;
        // The means begin at 0 and lag behind: that is corrected.
        let t = self.steps.min(i32::MAX as u64) as i32;
        let (lag1, lag2) = (1.0 - beta1.powi(t), 1.0 - beta2.powi(t));
        let means = self.mean.iter_mut().zip(&mut self.square);
        means
            .zip(gradient)
            .map(|((mean, square), g)| {
                *mean = beta1 * *mean + (1.0 - beta1) * g;
                *square = beta2 * *square + (1.0 - beta2) * g * g;
                -rate * (*mean / lag1) / ((*square / lag2).sqrt() + options.epsilon)
            })
            .collect()
    }
}
