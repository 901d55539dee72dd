//! What is measured, and the measuring of it.

use crate::Outcome;
use crate::body::{Body, Draw};
use crate::cost::{self, Cost};
use crate::memory::{self, Memory};
use crate::parameters::{self, Parameters};
use crate::ratios::{self, Ratio};
use crate::sphere::{self, Sphere};

/// How much is measured.
#[derive(Clone, Debug)]
pub struct Study {
    /// The body whose parameters are varied.
    pub fish: Body,
    /// The other one.
    pub torus: Body,
    /// Cells of the sphere's grids, growing, with the samples on each.
    pub spheres: Vec<(usize, usize)>,
    /// How samples are drawn for ratios and spheres; the first also for costs and memory.
    pub draws: Vec<Draw>,
    /// Timed repetitions.
    pub repeats: usize,
}

/// All results.
#[derive(Clone, Debug)]
pub struct Results {
    /// The fish's parameters.
    pub parameters: Parameters,
    /// Seconds.
    pub costs: Vec<Cost>,
    /// Bytes.
    pub memory: Vec<Memory>,
    /// Local derivatives over those across a cell.
    pub ratios: Vec<Ratio>,
    /// Closed forms.
    pub spheres: Vec<Sphere>,
}

impl Study {
    /// What the page is made of.
    pub fn full() -> Self {
        Self {
            fish: Body {
                name: "fish",
                shape: [338, 120, 151],
                samples: 50_000,
            },
            torus: Body {
                name: "torus",
                shape: [128; 3],
                samples: 50_000,
            },
            spheres: vec![(32, 3_125), (64, 12_500), (128, 50_000)],
            draws: Draw::ALL.to_vec(),
            repeats: 5,
        }
    }

    /// Measures everything; says on stderr where it is.
    ///
    /// # Errors
    /// The first case that fails.
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
                    costs.extend(cost::measure(body, &sampled, self.repeats)?);
                    memory.extend(memory::measure(body, &sampled)?);
                }
            }
        }
        Ok(Results {
            // Even samples are what the sampler draws unless told otherwise.
            parameters: parameters::measure(&self.fish, Draw::Even)?,
            costs,
            memory,
            ratios,
            spheres,
        })
    }
}
