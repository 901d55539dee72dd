//! A word for a whole result.

use std::cmp::Reverse;
use std::fmt;

use serde::{Serialize, Serializer};

use super::{Report, Warning};

/// Share of the samples up to which thin parts, missed samples and doubtful signs are tolerated, from 0 to 1.
pub(crate) const TOLERATED_SHARE: f64 = 0.01;

/// Whether a result can be trusted, from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// Nothing exceeds its limit: there are no warnings.
    Good,
    /// Probably right, but look at it: see the warnings.
    Check,
    /// Wrong in places: see the warnings.
    Bad,
}

impl Verdict {
    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Check => "check",
            Self::Bad => "bad",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl Report {
    /// The verdict: the worst [severity](Warning::severity) of the warnings. `None` where there are no warnings because
    /// [nothing was checked](crate::Options::checks).
    pub fn verdict(&self) -> Option<Verdict> {
        let worst = self.warnings.iter().map(Warning::severity).max();
        worst.or(self.checked.then_some(Verdict::Good))
    }

    /// The warnings, the worst first; those of one severity in the order of [`Warning::CODES`], causes before effects.
    pub fn reasons(&self) -> Vec<&Warning> {
        let place = |warning: &Warning| Warning::CODES.iter().position(|c| *c == warning.code());
        let mut reasons: Vec<_> = self.warnings.iter().collect();
        reasons.sort_by_key(|warning| (Reverse(warning.severity()), place(warning)));
        reasons
    }

    /// The verdict, its reasons by code, and what to try against each, in one line.
    pub fn conclusion(&self) -> String {
        let verdict = self.verdict().map_or("not checked", Verdict::name);
        let reasons = self.reasons().into_iter();
        let reasons: Vec<String> = reasons
            .map(|warning| format!("{} (try: {})", warning.code(), warning.remedy(self.level)))
            .collect();
        match reasons.is_empty() {
            true => verdict.into(),
            false => format!("{verdict}: {}", reasons.join("; ")),
        }
    }
}
