//! Limited-memory BFGS (J. Nocedal and S. J. Wright, "Numerical Optimization", 2006, algorithm 7.4).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::line_search::{SearchResult, search};
use super::{Evaluation, Function, Step, dot, largest, norm};

/// Options of L-BFGS. The length of a step is its largest change of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lbfgs {
    /// Number of stored steps.
    pub memory: usize,
    /// Length of the first trial step, without stored steps.
    pub first_step: f64,
    /// Maximum length of a step.
    pub longest_step: f64,
}

impl Default for Lbfgs {
    fn default() -> Self {
        Self {
            memory: 20,
            first_step: 0.05,
            longest_step: 0.5,
        }
    }
}

/// A pair `(s, y)` is stored only if `s·y` exceeds this fraction of `|s| |y|` (positive curvature along the step);
/// otherwise the next direction might not be one of descent.
const MIN_CURVATURE: f64 = 1e-8;

/// A step and the change of the gradient along it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
}

/// The stored steps, latest last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    pairs: VecDeque<Pair>,
}

impl Memory {
    pub fn fits(&self, variables: usize) -> bool {
        let fits = |pair: &Pair| pair.step.len() == variables && pair.change.len() == variables;
        self.pairs.iter().all(fits)
    }

    pub fn step<D, E>(
        &mut self,
        options: &Lbfgs,
        x: &mut Vec<f64>,
        here: &mut Evaluation<D>,
        function: &mut impl Function<D, E>,
    ) -> Result<Step, E> {
        if largest(&here.gradient) == 0.0 {
            return Ok(Step::Stalled);
        }
        loop {
            let d = self.direction(options, &here.gradient);
            let reach = options.longest_step / largest(&d);
            match search(x, here, &d, reach, function) {
                SearchResult::Lower(there, evaluation) => {
                    self.remember(options, x, &there, &here.gradient, &evaluation.gradient);
                    (*x, *here) = (there, evaluation);
                    return Ok(Step::Moved);
                }
                // The stored pairs may be inconsistent: retry along the negative gradient.
                _ if !self.pairs.is_empty() => self.pairs.clear(),
                SearchResult::NoDecrease => return Ok(Step::Stalled),
                SearchResult::Failed(error) => return Err(error),
            }
        }
    }

    /// `−H g` by the two-loop recursion, limited to the maximum length.
    fn direction(&self, options: &Lbfgs, gradient: &[f64]) -> Vec<f64> {
        let steepest = |length: f64| {
            let size = length / largest(gradient);
            gradient.iter().map(|g| -size * g).collect()
        };
        let Some(last) = self.pairs.back() else {
            return steepest(options.first_step);
        };
        let mut d: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut weights = Vec::with_capacity(self.pairs.len());
        for Pair { step, change } in self.pairs.iter().rev() {
            let weight = dot(step, &d) / dot(step, change);
            add_scaled(&mut d, -weight, change);
            weights.push(weight);
        }
        let size = dot(&last.step, &last.change) / dot(&last.change, &last.change);
        d.iter_mut().for_each(|d| *d *= size);
        for (Pair { step, change }, weight) in self.pairs.iter().zip(weights.iter().rev()) {
            let back = dot(change, &d) / dot(step, change);
            add_scaled(&mut d, weight - back, step);
        }
        let length = largest(&d);
        if !length.is_finite() || !(dot(&d, gradient) < 0.0) {
            return steepest(options.first_step);
        }
        let shorter = (options.longest_step / length).min(1.0);
        d.iter_mut().for_each(|d| *d *= shorter);
        d
    }

    fn remember(&mut self, options: &Lbfgs, from: &[f64], to: &[f64], g0: &[f64], g1: &[f64]) {
        let difference = |a: &[f64], b: &[f64]| b.iter().zip(a).map(|(b, a)| b - a).collect();
        let (step, change): (Vec<f64>, Vec<f64>) = (difference(from, to), difference(g0, g1));
        if dot(&step, &change) > MIN_CURVATURE * norm(&step) * norm(&change) {
            self.pairs.push_back(Pair { step, change });
        }
        while self.pairs.len() > options.memory {
            self.pairs.pop_front();
        }
    }
}

/// `a += s b`.
fn add_scaled(a: &mut [f64], s: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += s * b;
    }
}
