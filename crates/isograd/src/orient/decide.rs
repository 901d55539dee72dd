//! From evidence to signs, for the whole cloud at once.
//!
//! Two sheets close to each other are the two sides of a thin body or of a narrow gap, and nothing near them says
//! which. So where it matters both are tried, and the winding number of the whole decides; where sensors know, they
//! do. What single samples say comes from [`Beliefs`]: on this processor, or on a device.

use super::graph::Graph;
use super::settle::Settle;
use crate::vector;

/// What a sample at which the winding number is wrong by 1 weighs, beside evidence of 1.
const WINDING: f64 = 4.0;

/// What beliefs are worth, the other way round, where they were overruled as a whole.
const OVERRULED: f32 = 0.5;

/// Evidence from here on decides by itself.
const CLEAR: f32 = 0.1;

/// How sheets close to each other are read: as the two sides of a thin body, or of a narrow gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// A thin body, unless there seems to be matter on the far side of the sheet.
    Careful,
    /// A thin body.
    Bold,
}

/// Where points are.
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

/// What the samples of a cloud say of their signs, and are as a surface.
pub trait Beliefs {
    /// Why they can't be heard.
    type Error;

    /// For each sample, from −1 to 1: its own evidence, and what it believes once it has heard its neighbors.
    ///
    /// # Errors
    /// They can't be heard.
    fn hear(
        &mut self,
        reading: Reading,
        evidence: &mut Vec<f32>,
        belief: &mut Vec<f32>,
    ) -> Result<(), Self::Error>;

    /// Whether the two readings differ.
    ///
    /// # Errors
    /// They can't be heard.
    fn differ(&mut self) -> Result<bool, Self::Error>;

    /// `(probes, domains)` the winding number that each domain gives at each of the `probes`, which are samples.
    ///
    /// # Errors
    /// It can't be found.
    fn winding(&mut self, domains: &Domains<'_>, probes: &[u32]) -> Result<Vec<f64>, Self::Error>;
}

/// The domains that winding numbers are asked of.
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
    /// The mark of a sample of no domain.
    pub const NONE: u32 = u32::MAX;

    /// The samples of each domain, in order.
    pub fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.count];
        for (p, &domain) in (0..).zip(self.domain) {
            if let Some(members) = members.get_mut(domain as usize) {
                members.push(p);
            }
        }
        members
    }
}

/// What decided the sign of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Evidence at the sample itself.
    Evidence,
    /// Its neighbors.
    Neighbors,
    /// A rule, for want of evidence or against what there was.
    Rule,
}

/// The outcome for one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Whether it points inward.
    pub flip: bool,
    /// From 0 to 1.
    pub confidence: f32,
    /// What decided.
    pub by: Decision,
}

/// The signs of a cloud, in the order of its [`Graph`]; its memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Signs {
    settle: Settle,
    evidence: Vec<f32>,
    belief: Vec<f32>,
    best: Solution,
}

/// One way of orienting the whole cloud.
#[derive(Clone, Debug, Default)]
struct Solution {
    sign: Vec<f32>,
    evidence: Vec<f32>,
    belief: Vec<f32>,
}

impl Signs {
    /// Finds the sign of each axis. Where samples were `seen` from sensors, these know better than the winding
    /// number.
    ///
    /// # Errors
    /// The samples can't be heard.
    pub fn find<B: Beliefs>(
        &mut self,
        graph: &Graph,
        samples: &mut B,
        seen: bool,
        place: &impl Place,
    ) -> Result<(), B::Error> {
        let winding = if seen { 0.0 } else { WINDING };
        self.solve(Reading::Careful, graph, samples, winding, place)?;
        if seen || !samples.differ()? {
            self.keep();
            return Ok(());
        }
        let careful = self.settle.misfit(samples)?;
        self.keep();
        self.solve(Reading::Bold, graph, samples, winding, place)?;
        if self.settle.misfit(samples)? < careful {
            self.keep();
        }
        Ok(())
    }

    fn solve<B: Beliefs>(
        &mut self,
        reading: Reading,
        graph: &Graph,
        samples: &mut B,
        winding: f64,
        place: &impl Place,
    ) -> Result<(), B::Error> {
        samples.hear(reading, &mut self.evidence, &mut self.belief)?;
        let said = (&*self.evidence, &*self.belief);
        self.settle.run(graph, said, samples, winding, place)
    }

    fn keep(&mut self) {
        self.best.sign.clone_from(&self.settle.sign);
        self.best.evidence.clone_from(&self.evidence);
        let overruled = self.settle.overruled.iter();
        let heard =
            |(&belief, &over): (&f32, &bool)| if over { -OVERRULED * belief } else { belief };
        self.best.belief.clear();
        self.best
            .belief
            .extend(self.belief.iter().zip(overruled).map(heard));
    }

    /// What was found for a sample.
    ///
    /// # Panics
    /// There is no such sample.
    pub fn verdict(&self, p: usize) -> Verdict {
        let sign = self.best.sign[p];
        let confidence = (sign * self.best.belief[p]).max(0.0);
        let seen = sign * self.best.evidence[p] >= CLEAR;
        let by = match (confidence > 0.0, seen) {
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
