//! Reasons of doubtful signs.
//!
//! # Map
//! Points `(N, 3)`, their [`Orientation`] and neighborhoods → a [`Reason`] for each point whose
//! [confidence](Orientation::confidence) is below 0.1. The first of these that holds:
//!
//! - *sparse*: its 24 nearest samples are twice as far apart as those of the cloud at the median;
//! - *open*: a sample along a rim or hole is among its neighbors;
//! - *thin*: its 24 nearest samples lie in two sheets, told apart by their height along its normal, or by the
//!   sides that they face. 24 samples of one sheet reach 2.8 spacings, so such sheets are closer than that;
//! - *noisy*: its 24 nearest samples scatter by 0.3 of their spacing about the quadric fitted to them, and so
//!   do most samples around it;
//! - *open* again: doubtful samples without a reason of their own lead from it to a rim or hole;
//! - else it is *unexplained*.
//!
//! A share of the points by reason says what to do about it, and [`regions`] where; no result depends on them.
//!
//! # Residual, Pullback, Not differentiable
//! None: a reason is a name.

mod patch;
mod region;
#[cfg(test)]
mod tests;

use serde::{Serialize, Serializer};

use super::rim::rims;
use super::{DOUBTFUL, Orientation};
use crate::neighbors::Neighborhoods;
use crate::{Real, parallel};
use patch::{Cloud, Patch};
pub use region::{Region, regions};

/// Nearest samples that are this many times as far apart as those of the cloud are sparse.
const SPARSE: f64 = 2.0;

/// Samples that scatter by this share of their spacing are noisy.
const NOISY: f64 = 0.3;

/// Doubtful points that are looked at in one task.
const TASK: usize = 64;

/// Of so many samples around a noisy one, more than half must be noisy too.
const ASKED: usize = 8;

/// Why the sign of a point is doubtful.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Reason {
    /// Two sheets of surface are closer to each other than about two and a half spacings.
    Thin,
    /// The samples are much further apart than elsewhere: a sparse part, or outliers.
    Sparse,
    /// A rim or a hole is near.
    Open,
    /// The samples scatter about their surface.
    Noisy,
    /// None of these.
    Unexplained,
}

impl Reason {
    /// Every reason, in the order of their numbers.
    pub const ALL: [Self; 5] = [
        Self::Thin,
        Self::Sparse,
        Self::Open,
        Self::Noisy,
        Self::Unexplained,
    ];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Thin => "thin",
            Self::Sparse => "sparse",
            Self::Open => "open",
            Self::Noisy => "noisy",
            Self::Unexplained => "unexplained",
        }
    }
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

/// How many signs are doubtful, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Doubt {
    points: usize,
    counts: [usize; Reason::ALL.len()],
}

impl Doubt {
    /// Counts the reasons of `points` points.
    pub fn count(points: usize, reasons: &[(u32, Reason)]) -> Self {
        let mut counts = [0; Reason::ALL.len()];
        reasons.iter().for_each(|r| counts[r.1 as usize] += 1);
        Self { points, counts }
    }

    /// Number of points in all.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Number of points that are doubtful for this reason.
    pub fn of(&self, reason: Reason) -> usize {
        self.counts[reason as usize]
    }

    /// Number of doubtful points.
    pub fn doubtful(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Share of all points, from 0 to 1, that are doubtful.
    pub fn share(&self) -> f64 {
        self.doubtful() as f64 / self.points.max(1) as f64
    }

    /// Share of all points, from 0 to 1, that are doubtful for this reason.
    pub fn share_of(&self, reason: Reason) -> f64 {
        self.of(reason) as f64 / self.points.max(1) as f64
    }

    /// The reasons that there are, the most frequent first.
    pub fn by_frequency(&self) -> Vec<Reason> {
        let mut found = Reason::ALL.to_vec();
        found.retain(|&reason| self.of(reason) > 0);
        found.sort_by_key(|&reason| std::cmp::Reverse(self.of(reason)));
        found
    }

    /// The most frequent reason; unexplained, if there is none.
    pub fn main_reason(&self) -> Reason {
        let reasons = self.by_frequency();
        reasons.first().copied().unwrap_or(Reason::Unexplained)
    }
}

/// The doubtful points by index, in order, each with its reason; see the [module](self).
///
/// `points` `(N, 3)`, `orientation` and `neighborhoods` belong together, and are in input order. The same
/// bits on any number of threads.
pub fn reasons<T: Real>(
    points: &[[T; 3]],
    orientation: &Orientation<T>,
    neighborhoods: &Neighborhoods<T>,
) -> Vec<(u32, Reason)> {
    if !orientation.confidence.iter().any(|c| is_doubtful(*c)) {
        return Vec::new();
    }
    let rims = rims(points, &orientation.normals, neighborhoods);
    reasons_beside(&rims, points, orientation, neighborhoods)
}

/// Like [`reasons`], with known rims.
pub(crate) fn reasons_beside<T: Real>(
    rims: &[bool],
    points: &[[T; 3]],
    orientation: &Orientation<T>,
    neighborhoods: &Neighborhoods<T>,
) -> Vec<(u32, Reason)> {
    let confidence = &orientation.confidence;
    let doubtful = (0..points.len()).filter(|&i| is_doubtful(confidence[i]));
    let doubtful: Vec<u32> = doubtful.map(|i| i as u32).collect();
    let look = Look {
        rims,
        cloud: Cloud {
            points,
            normals: &orientation.normals,
            index: &neighborhoods.index,
        },
        neighborhoods,
    };
    let chunks = doubtful.chunks(TASK);
    let found = parallel::map_each_with(Patch::default, chunks, |patch, _, chunk| {
        let looks = chunk.iter().map(|&i| (i, look.at(i as usize, patch)));
        looks.collect::<Vec<(u32, Reason)>>()
    });
    let mut found = found.concat();
    look.spread(&mut found);
    found
}

/// Whether a sign with this confidence is doubtful.
pub(super) fn is_doubtful<T: Real>(confidence: T) -> bool {
    !(confidence.f64() >= DOUBTFUL)
}

/// The cloud and its rims.
struct Look<'a, T: Real> {
    rims: &'a [bool],
    cloud: Cloud<'a, T>,
    neighborhoods: &'a Neighborhoods<T>,
}

impl<T: Real> Look<'_, T> {
    /// The reason that a point has by itself.
    fn at(&self, i: usize, patch: &mut Patch) -> Reason {
        patch.take(&self.cloud, i);
        if patch.spacing() > SPARSE * self.neighborhoods.spacing().f64() {
            Reason::Sparse
        } else if self.any_neighbor(i, |j| self.rims[j]) {
            Reason::Open
        } else if patch.has_two_sheets(&self.cloud) {
            Reason::Thin
        } else if self.is_noisy(patch) {
            Reason::Noisy
        } else {
            Reason::Unexplained
        }
    }

    /// Whether the samples scatter here and round about: at an edge, only those along it seem to.
    fn is_noisy(&self, patch: &Patch) -> bool {
        let mut other = Patch::default();
        let mut scatters = |j: usize| {
            other.take(&self.cloud, j);
            other.scatter() > NOISY
        };
        let asked = patch.farthest().take(ASKED);
        patch.scatter() > NOISY && 2 * asked.filter(|&j| scatters(j)).count() > ASKED
    }

    fn any_neighbor(&self, i: usize, mut is_so: impl FnMut(usize) -> bool) -> bool {
        let (index, radius) = (&self.neighborhoods.index, &self.neighborhoods.radius);
        let mut any = false;
        index.for_each_within(self.cloud.points[i], radius[i], |j, _| any |= is_so(j));
        any
    }

    /// Makes open what is unexplained and joined to an open point by such points. The set that is reached
    /// does not depend on the order.
    fn spread(&self, found: &mut [(u32, Reason)]) {
        let (index, radius) = (&self.neighborhoods.index, &self.neighborhoods.radius);
        let mut waiting: Vec<u32> = Vec::new();
        waiting.extend(found.iter().filter(|f| f.1 == Reason::Open).map(|f| f.0));
        while let Some(i) = waiting.pop() {
            let i = i as usize;
            index.for_each_within(self.cloud.points[i], radius[i], |j, _| {
                let place = found.binary_search_by_key(&(j as u32), |f| f.0);
                if let Ok(place) = place
                    && found[place].1 == Reason::Unexplained
                {
                    found[place].1 = Reason::Open;
                    waiting.push(j as u32);
                }
            });
        }
    }
}
