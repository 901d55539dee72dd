//! The chain: variables → points → φ → loss, and its gradient back.

use isograd::poisson::Walls;
use isograd::{CloudCotangent, Cotangent, SurfaceResolution};
use isograd_backend::{Plan, View};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::fingerprint::Fingerprint;
use crate::fit::Options;
use crate::loss::Matching;
use crate::optimize::Evaluation;
use crate::target::Target;
use crate::variables::{Degrees, Variables};

/// Terms of the loss at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LossTerms {
    /// Mean squared difference of φ, in cells².
    pub data: f64,
    /// The smoothness term of raw points.
    pub smoothness: f64,
    /// Penalty of parameters beyond their bounds.
    pub bounds: f64,
    /// Mean absolute difference of φ, in cells.
    pub mean_error: f64,
}

/// One plan for all evaluations of a fit.
pub(crate) struct Problem {
    pub degrees: Degrees,
    pub plan: Plan<f64>,
    matching: Matching,
    phi_bar: Vec<f64>,
    bar: CloudCotangent<f64>,
}

impl Problem {
    pub fn new(target: &Target, variables: Variables, options: &Options) -> Result<Self, Error> {
        let degrees = Degrees::new(variables, target.grid().spacing())?;
        let of_plan = &options.reconstruction;
        let of_plan = fixed(of_plan).orient(degrees.orientation(of_plan.orient));
        Ok(Self {
            degrees,
            plan: Plan::new(options.backend, *target.grid(), of_plan)?,
            matching: Matching::new(target.sdf(), options.band)?,
            phi_bar: vec![0.0; target.grid().cells()],
            bar: CloudCotangent::default(),
        })
    }

    /// Loss and gradient at `x`.
    pub fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation<LossTerms>, Error> {
        let cloud = self.degrees.cloud(x)?;
        let result = self.plan.reconstruct(&cloud)?;
        let mismatch = self
            .matching
            .evaluate(result.sdf()?.values(), &mut self.phi_bar);
        let cotangent = Cotangent {
            sdf: Some(&self.phi_bar),
            ..Cotangent::default()
        };
        result.pullback_into(&cotangent, &mut self.bar)?;
        let mut gradient = self.degrees.pullback(x, &self.bar.points)?;
        let regularization = self.degrees.regularization(x, &mut gradient);
        Ok(Evaluation {
            value: mismatch.loss + regularization.smoothness + regularization.bounds,
            gradient,
            detail: LossTerms {
                data: mismatch.loss,
                smoothness: regularization.smoothness,
                bounds: regularization.bounds,
                mean_error: mismatch.mean_error,
            },
        })
    }

    /// The reconstruction at `x`.
    pub fn reconstruction(&mut self, x: &[f64]) -> Result<View<'_, f64>, Error> {
        let cloud = self.degrees.cloud(x)?;
        Ok(self.plan.reconstruct(&cloud)?)
    }

    /// Draws new samples of a shape at `x`; `turn` counts the sets of samples.
    pub fn sample(&mut self, x: &[f64], turn: u64) -> Result<(), Error> {
        match &mut self.degrees {
            Degrees::Shape(shape) => shape.sample(x, turn),
            Degrees::Points(_) => Ok(()),
        }
    }

    /// Number of epochs between new samples.
    pub fn resample(&self) -> Option<usize> {
        match &self.degrees {
            Degrees::Shape(shape) => shape.resample,
            Degrees::Points(_) => None,
        }
    }
}

/// Hashes of the inputs of a fit, stored in its checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Fingerprints {
    pub target: u64,
    pub variables: u64,
    pub options: u64,
}

impl Fingerprints {
    pub fn new(
        target: &Target,
        degrees: &Degrees,
        options: &isograd::Options,
        others: &str,
    ) -> Self {
        let grid = target.grid();
        let mut target_hash = Fingerprint::default();
        target_hash.numbers(&grid.lower());
        target_hash.numbers(&[grid.spacing()]);
        for n in grid.shape() {
            target_hash.number(n as u64);
        }
        target_hash.numbers(target.sdf().values());
        let mut options_hash = Fingerprint::default();
        options_hash.text(&format!("{options:?} {others}"));
        Self {
            target: target_hash.finish(),
            variables: degrees.fingerprint(),
            options: options_hash.finish(),
        }
    }

    /// The first input that differs from that of `other`.
    pub fn difference(&self, other: &Self) -> Option<&'static str> {
        if self.target != other.target {
            Some("target or grid")
        } else if self.variables != other.variables {
            Some("variables, start or samples")
        } else if self.options != other.options {
            Some("options or optimizer")
        } else {
            None
        }
    }
}

/// The options of a fit: steps of an automatic resolution, or of automatic walls, would be steps of the loss.
pub fn fixed(options: &isograd::Options) -> isograd::Options {
    let surface = match options.surface {
        SurfaceResolution::Auto => SurfaceResolution::Factor(1.0),
        other => other,
    };
    let walls = match options.walls {
        Walls::Auto => Walls::Free,
        other => other,
    };
    // Nobody reads the report of a reconstruction among hundreds.
    options.clone().checks(false).surface(surface).walls(walls)
}
