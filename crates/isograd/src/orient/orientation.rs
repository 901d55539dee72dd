//! Result of the orientation.

#[cfg(doc)]
use super::Method;
use super::doubt;
use crate::Real;

/// Method that chose the signs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MethodUsed {
    /// See [`Method::Auto`].
    #[default]
    Auto,
    /// See [`Method::Parity`].
    Parity {
        /// `r_d`, in the unit of the points.
        detection_radius: f64,
    },
    /// See [`Method::Given`].
    Given,
    /// See [`Method::Signs`].
    Signs,
    /// See [`Method::Sensors`].
    Sensors,
    /// See [`Method::Previous`]; a call that had to orient automatically has [`Self::Auto`].
    Previous {
        /// Axes that have turned far since the call before.
        turned: usize,
    },
}

impl MethodUsed {
    /// `"auto"`, `"parity"`, `"given"`, `"signs"`, `"sensors"` or `"previous"`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Parity { .. } => "parity",
            Self::Given => "given",
            Self::Signs => "signs",
            Self::Sensors => "sensors",
            Self::Previous { .. } => "previous",
        }
    }
}

/// Number of signs by the kind of evidence that decided them. The counts add up to the number of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decided {
    /// By normals or sensors of the cloud, or by the previous call.
    pub given: usize,
    /// By parity.
    pub parity: usize,
    /// By clear evidence at the point itself.
    pub evidence: usize,
    /// By the evidence of the neighbors.
    pub neighbors: usize,
    /// By a rule, without evidence, against it or against the neighbors: confidence 0.
    pub rule: usize,
}

/// Outward normals.
#[derive(Clone, Debug, Default)]
pub struct Orientation<T> {
    /// `(N, 3)` outward unit normals, in input order.
    pub normals: Vec<[T; 3]>,
    /// `(N,)` in 0..1: how sure the sign of each point is. Of the signs of [`Method::Auto`] with at least 0.9, about one
    /// in 30,000 is wrong, of those below 0.1 one in eight (docs/orientation.md). It is small where the evidence is weak, as
    /// on an open surface, and where the signs of neighbors contradict each other. Given normals have 1; given sides the
    /// cosine between normal and axis; a clear view from a sensor 1; a sign that follows the call before what it had when
    /// it was searched for, but at most the cosine between the two normals; with parity it is 1 where the parities of the
    /// two directions differ, as they must on a closed surface, else 0.
    pub confidence: Vec<T>,
    /// Number of axes whose sign was changed.
    pub flipped: usize,
    /// The method, with the parameters that it determined.
    pub method: MethodUsed,
    /// Number of signs by kind of evidence.
    pub decided: Decided,
}

impl<T: Real> Orientation<T> {
    /// Share of points, in 0..1, whose confidence is below 0.1. On closed, densely sampled bodies it is under 0.01;
    /// more than about a tenth says that the surface is open, or the noise as large as the body is thick, and that signs
    /// may be wrong in whole regions.
    pub fn doubtful(&self) -> f64 {
        let doubtful = |c: &&T| doubt::is_doubtful(**c);
        let count = self.confidence.iter().filter(doubtful).count();
        count as f64 / self.confidence.len().max(1) as f64
    }

    /// Whether the sign of point `i` is one of those.
    ///
    /// # Panics
    /// There is no such point.
    pub fn is_doubtful(&self, i: usize) -> bool {
        doubt::is_doubtful(self.confidence[i])
    }

    pub(super) fn clear(&mut self) {
        self.normals.clear();
        self.confidence.clear();
        self.flipped = 0;
        self.decided = Decided::default();
    }

    pub(super) fn set_sign(&mut self, i: usize, flip: bool, confidence: f64) {
        if flip {
            self.normals[i] = self.normals[i].map(|x| -x);
            self.flipped += 1;
        }
        self.confidence[i] = T::of(confidence);
    }
}
