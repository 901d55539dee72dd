//! The pullback against differences and closed forms, and its cost.

pub mod cost;
pub mod functional;
pub mod motion;
pub mod parameters;
pub mod ratios;
pub mod sphere;

use crate::output::{Json, Outcome};
use crate::sampling::{Body, Draw};
use cost::{Cost, Memory};
use parameters::Parameters;
use ratios::Ratio;
use sphere::Sphere;

/// Extent of the study.
#[derive(Clone, Debug)]
pub struct Study {
    /// The body with varied parameters.
    pub fish: Body,
    /// The other body.
    pub torus: Body,
    /// Cells and samples of the spheres, ascending.
    pub spheres: Vec<(usize, usize)>,
    /// Distributions of samples for ratios and spheres; the first also for costs and memory.
    pub draws: Vec<Draw>,
    /// Timed repetitions.
    pub repeats: usize,
}

/// Results of the study.
#[derive(Clone, Debug)]
pub struct Results {
    /// Gradient in the parameters of the fish.
    pub parameters: Parameters,
    /// Seconds.
    pub costs: Vec<Cost>,
    /// Bytes.
    pub memory: Vec<Memory>,
    /// Local derivatives and differences across a cell.
    pub ratios: Vec<Ratio>,
    /// Closed forms.
    pub spheres: Vec<Sphere>,
}

impl Study {
    /// The study shown in docs/gradients.md.
    pub fn full() -> Self {
        Self {
            fish: Body::FISH,
            torus: Body {
                name: "torus",
                shape: [128; 3],
                samples: 50_000,
            },
            spheres: vec![(32, 3_125), (64, 12_500), (128, 50_000)],
            draws: vec![Draw::Random, Draw::Even],
            repeats: 5,
        }
    }

    /// Measures everything, with progress on stderr.
    pub fn run(&self) -> Outcome<Results> {
        let mut spheres = Vec::new();
        for &draw in &self.draws {
            for &(cells, samples) in &self.spheres {
                spheres.push(sphere::measure(cells, samples, draw)?);
            }
        }
        let (mut costs, mut memory, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        for body in [&self.torus, &self.fish] {
            for (place, &draw) in self.draws.iter().enumerate() {
                let sampled = body.sample(draw)?;
                ratios.extend(ratios::measure(body, &sampled, draw)?);
                if place == 0 {
                    let (seconds, bytes) = cost::measure(body, &sampled, self.repeats)?;
                    costs.extend(seconds);
                    memory.extend(bytes);
                }
            }
        }
        Ok(Results {
            // Even samples are the sampler's default.
            parameters: parameters::measure(&self.fish, Draw::Even)?,
            costs,
            memory,
            ratios,
            spheres,
        })
    }
}

impl Results {
    /// The results as JSON.
    pub fn json(&self) -> Outcome<String> {
        let json = Json::default().with("parameters", &self.parameters.rows)?;
        let setting = std::slice::from_ref(&self.parameters.setting);
        let json = json.with("parameters_setting", setting)?;
        let json = json.with("costs", &self.costs)?;
        let json = json.with("memory", &self.memory)?;
        let json = json.with("ratios", &self.ratios)?;
        Ok(json.with("spheres", &self.spheres)?.text())
    }
}
