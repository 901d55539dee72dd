//! Signs of the whole cloud, from the evidence of its samples.
//!
//! Two sheets close to each other are the two sides of a thin body or of a narrow gap, which cannot be distinguished
//! locally. Where it matters both interpretations are solved, and the winding number of the whole selects one, unless
//! there are sensors.

use super::confidence;
use super::domains::{self, DomainSigns};
use super::field;
use super::graph::Graph;
use crate::{parallel, vector};

/// Weight of a sample at which the winding number is wrong by 1, relative to evidence of 1.
const WINDING: f64 = 4.0;

/// Weight of beliefs, with the opposite sign, in a domain whose beliefs were overruled.
const OVERRULED: f32 = 0.5;

/// Evidence from here on decides by itself.
const CLEAR: f32 = 0.1;

/// Interpretation of two sheets close to each other: the two sides of a thin body, or of a narrow gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpretation {
    /// A thin body, unless there seems to be matter, or is another sheet, on the far side of the sheet.
    Careful,
    /// A thin body.
    Bold,
}

/// Positions of points.
pub trait Place: Sync {
    /// Position of a point, in the unit of the user.
    fn user(&self, p: usize) -> [f64; 3];

    /// The sample spacing, in that unit.
    fn spacing(&self) -> f64;

    /// Position of a point relative to the first one, in sample spacings.
    fn in_spacings(&self, p: usize) -> [f32; 3] {
        let offset = vector::sub(self.user(p), self.user(0));
        offset.map(|x| (x / self.spacing()) as f32)
    }
}

/// Domains: sets of samples with fixed relative signs.
#[derive(Clone, Copy, Debug)]
pub struct Domains<'a> {
    /// `(N,)` the number of the domain of each sample; [`Self::NONE`] for a sample of none of them.
    pub domain: &'a [u32],
    /// `(N,)` `+1` or `−1`: the sign of each axis, relative to those of its domain.
    pub sign: &'a [f32],
    /// Number of domains.
    pub count: usize,
}

impl Domains<'_> {
    /// Marks a sample that belongs to no domain.
    pub const NONE: u32 = u32::MAX;

    /// The samples of each domain, in order.
    pub fn members(&self) -> Vec<Vec<u32>> {
        let mut counts = vec![0; self.count];
        for &domain in self.domain {
            if let Some(count) = counts.get_mut(domain as usize) {
                *count += 1;
            }
        }
        let mut members: Vec<_> = counts.into_iter().map(Vec::with_capacity).collect();
        for (p, &domain) in (0..).zip(self.domain) {
            if let Some(members) = members.get_mut(domain as usize) {
                members.push(p);
            }
        }
        members
    }
}

/// Kind of evidence that decided the sign of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Evidence at the sample itself.
    Evidence,
    /// Its neighbors.
    Neighbors,
    /// A rule, without evidence or against it.
    Rule,
}

/// Sign of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Whether it points inward.
    pub flip: bool,
    /// From 0 to 1.
    pub confidence: f32,
    /// Kind of evidence that decided.
    pub by: Decision,
}

/// The signs of a cloud, in the order of its [`Graph`]; its memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Signs {
    domains: DomainSigns,
    evidence: Vec<f32>,
    belief: Vec<f32>,
    best: Solution,
    confidence: Vec<f32>,
}

/// One way of orienting the whole cloud.
#[derive(Clone, Debug, Default)]
struct Solution {
    sign: Vec<f32>,
    evidence: Vec<f32>,
    belief: Vec<f32>,
}

impl Signs {
    /// Finds the sign of each axis, from the `evidence` and the `belief` of each sample, from −1 to 1, for each
    /// [`Interpretation`]. With `ambiguous` evidence both are solved. With `sensors`, whose evidence is more reliable than the
    /// winding number, that is not used.
    pub fn find(
        &mut self,
        graph: &Graph,
        place: &impl Place,
        sensors: bool,
        ambiguous: bool,
        (evidence, belief): (&[[f32; 2]], &[[f32; 2]]),
    ) {
        let winding = if sensors { 0.0 } else { WINDING };
        let solve = |signs: &mut Self, interpretation: Interpretation| {
            let of_one = |both: &[f32; 2]| both[interpretation as usize];
            let n = belief.len();
            parallel::fill(&mut signs.evidence, n, |p| of_one(&evidence[p]));
            parallel::fill(&mut signs.belief, n, |p| of_one(&belief[p]));
            let observed = (&*signs.evidence, &*signs.belief);
            signs.domains.run(graph, observed, winding, place);
        };
        solve(self, Interpretation::Careful);
        self.keep();
        if ambiguous && !sensors {
            solve(self, Interpretation::Bold);
            let signs = [&self.domains.sign, &self.best.sign];
            // Mostly they agree.
            if signs[0] != signs[1] {
                let [bold, careful] = signs.map(|signs| domains::misfit(graph, place, signs));
                if bold < careful {
                    self.keep();
                }
            }
        }
        let Solution {
            sign,
            evidence,
            belief,
        } = &mut self.best;
        confidence::measure(graph, sign, belief, &mut self.confidence);
        if !sensors {
            let turned = field::turn_patches(graph, place, evidence, &self.confidence, sign);
            for &p in &turned {
                let p = p as usize;
                if sign[p] * belief[p] < 0.0 {
                    belief[p] *= -OVERRULED;
                }
            }
            if !turned.is_empty() {
                confidence::measure(graph, sign, belief, &mut self.confidence);
            }
        }
    }

    fn keep(&mut self) {
        std::mem::swap(&mut self.best.sign, &mut self.domains.sign);
        std::mem::swap(&mut self.best.evidence, &mut self.evidence);
        let (belief, overruled) = (&self.belief, &self.domains.overruled);
        parallel::fill(&mut self.best.belief, belief.len(), |p| {
            let factor = if overruled[p] { -OVERRULED } else { 1.0 };
            factor * belief[p]
        });
    }

    /// The sign of a sample.
    ///
    /// # Panics
    /// There is no such sample.
    pub fn verdict(&self, p: usize) -> Verdict {
        let sign = self.best.sign[p];
        let confidence = self.confidence[p];
        let is_clear = sign * self.best.evidence[p] >= CLEAR;
        let by = match (confidence > 0.0, is_clear) {
            (true, true) => Decision::Evidence,
            (true, false) => Decision::Neighbors,
            (false, _) => Decision::Rule,
        };
        Verdict {
            flip: sign < 0.0,
            confidence,
            by,
        }
    }
}
