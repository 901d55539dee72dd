//! Reasons not to trust a result: code, severity, numbers, text and remedy of each.

use std::fmt;

use serde::Serialize;

use super::{TOLERATED_SHARE, Verdict};
use crate::isosurface::Level;
use crate::orient::doubt::{Doubt, Reason, Region};

/// Share of the samples with normals against the surface above which it is wrong in many places.
const MANY_TURNED: f64 = 0.05;

/// A reason is named where it stands for one in this many of the doubtful samples.
const SMALLEST_REASON: usize = 10;

/// A reason not to trust a result. A warning is not an error: all outputs are there.
///
/// `Display` gives the text without the [remedy](Self::remedy); serialized are the numbers alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Warning {
    /// Samples were left out: they are far from all others, or in mid-air.
    Outliers {
        /// Number of such samples.
        samples: usize,
    },
    /// Samples lie apart from the surface, and from one another, but not so far that they are left out.
    Stray {
        /// Number of such samples.
        samples: usize,
        /// Share of the area of the surface that they are taken to stand for, from 0 to 1.
        share: f64,
    },
    /// Samples are in the same place as others, in a result that has other warnings, too.
    Duplicates {
        /// Number of such samples, the first one in each place not counted; at least.
        samples: usize,
    },
    /// Normals point to the other side of the surface than it has where they are: they contradict their neighbors.
    Turned {
        /// Share of the samples with such a normal, from 0 to 1.
        share: f64,
    },
    /// Parts of the body are thinner than three cells.
    Thin {
        /// Share of the samples that lie on such parts, from 0 to 1.
        share: f64,
    },
    /// Samples are further apart than the cells of the surface are wide.
    Sparse {
        /// Typical distance between samples.
        sample_spacing: f64,
        /// Cell size of the surface.
        spacing: f64,
    },
    /// The samples end at a rim, or are missing in places: they do not enclose a volume.
    Open {
        /// Number of samples along rims.
        samples: usize,
        /// Share of the surface that is a guess, from 0 to 1: see [`Report::guessed`](super::Report::guessed).
        guessed: f64,
    },
    /// The surface reaches the wall of the grid.
    TouchesWall,
    /// A sheet is thinner than two cells of the surface: its shell may have holes.
    ThinSheet {
        /// Thickness, in cells.
        cells: f64,
    },
    /// The surface has small pieces, or pieces without samples.
    Fragments {
        /// Number of such pieces.
        fragments: usize,
        /// Number of pieces in all.
        pieces: usize,
    },
    /// The surface encloses a negative volume.
    InsideOut {
        /// The volume, in unit length³.
        volume: f64,
    },
    /// Samples lie off the surface.
    Missed {
        /// Share of the samples further than one cell of the surface from it, from 0 to 1.
        share: f64,
        /// Share of the samples further than two cells of φ from the surface, from 0 to 1.
        far: f64,
    },
    /// The sign of many normals is a guess.
    DoubtfulSigns {
        /// How many, and why.
        #[serde(rename = "doubtful")]
        doubt: Doubt,
        /// The largest region of them.
        largest: Option<Region>,
    },
    /// Normals are not defined by their neighbors.
    Guarded {
        /// Number of such samples.
        samples: usize,
    },
    /// Coordinates are so large that the number type rounds them visibly.
    Rounded {
        /// Distance between neighboring numbers of the type, in cells.
        cells: f64,
    },
}

impl Warning {
    /// Codes of all warnings.
    pub const CODES: [&str; 15] = [
        "stray",
        "duplicates",
        "turned",
        "missed",
        "open",
        "inside-out",
        "wall",
        "doubtful-signs",
        "fragments",
        "thin",
        "sparse",
        "outliers",
        "thin-sheet",
        "guarded",
        "rounded",
    ];

    /// A name that does not change between versions: see [`Self::CODES`].
    pub fn code(&self) -> &'static str {
        match self {
            Self::Outliers { .. } => "outliers",
            Self::Stray { .. } => "stray",
            Self::Duplicates { .. } => "duplicates",
            Self::Turned { .. } => "turned",
            Self::Thin { .. } => "thin",
            Self::Sparse { .. } => "sparse",
            Self::Open { .. } => "open",
            Self::TouchesWall => "wall",
            Self::ThinSheet { .. } => "thin-sheet",
            Self::Fragments { .. } => "fragments",
            Self::InsideOut { .. } => "inside-out",
            Self::Missed { .. } => "missed",
            Self::DoubtfulSigns { .. } => "doubtful-signs",
            Self::Guarded { .. } => "guarded",
            Self::Rounded { .. } => "rounded",
        }
    }

    /// The best verdict that a result with this warning can have: [`Verdict::Check`] or [`Verdict::Bad`].
    pub fn severity(&self) -> Verdict {
        let is_bad = match self {
            Self::TouchesWall | Self::InsideOut { .. } => true,
            Self::Open { guessed, .. } => *guessed > TOLERATED_SHARE,
            Self::Missed { far: share, .. } | Self::Stray { share, .. } => *share > TOLERATED_SHARE,
            Self::Turned { share } => *share > MANY_TURNED,
            _ => false,
        };
        if is_bad { Verdict::Bad } else { Verdict::Check }
    }

    /// Options to try with a surface at this level, named as in Python and, in parentheses, on the command line.
    pub fn remedy(&self, level: Level) -> &'static str {
        match self {
            Self::Outliers { .. } => {
                "outliers=\"keep\" (--outliers keep) if they are part of the shape"
            }
            Self::Stray { .. } => {
                "the cloud without them: clean(points, statistical=(16, 2)) (isograd clean --statistical 16,2)"
            }
            Self::Duplicates { .. } => {
                "the cloud without them: clean(points, duplicates=0) (isograd clean --duplicates 0)"
            }
            Self::Turned { .. } => {
                "orient=\"auto\" (--orient auto), or normals that are all outward"
            }
            Self::Thin { .. } if level != Level::Thin => {
                "level=\"thin\" (--level thin), which keeps them whole, or smaller cells of the surface (surface, --surface)"
            }
            Self::Thin { .. } => {
                "more samples, or smaller cells of the surface (surface, --surface), if these parts matter"
            }
            Self::Sparse { .. } => {
                "surface=\"auto\" (--surface auto), whose cells follow the samples, or more samples"
            }
            Self::Open { .. } => {
                "samples in the gaps; sheet=THICKNESS (--sheet) for a membrane or sail; trim=\"auto\" (--trim auto) for a mesh without what was guessed"
            }
            Self::TouchesWall => {
                "more room (padding, --padding, or larger bounds), or walls=\"closed\" (--walls closed)"
            }
            Self::ThinSheet { .. } => {
                "a larger thickness (sheet, --sheet) or smaller cells (surface, --surface)"
            }
            Self::Fragments { .. } if level != Level::Thin => {
                "level=\"thin\" (--level thin), more samples there, or smaller cells of the surface (surface, --surface)"
            }
            Self::Fragments { .. } => {
                "more samples there, or smaller cells of the surface (surface, --surface)"
            }
            Self::InsideOut { .. } => {
                "orient=\"auto\" (--orient auto), or normals that point outward"
            }
            Self::Missed { .. } if level != Level::Thin => {
                "level=\"thin\" (--level thin), smaller cells of the surface (surface, --surface), fewer outliers, or known normals (orient, --orient)"
            }
            Self::Missed { .. } => {
                "more samples, smaller cells of the surface (surface, --surface), fewer outliers, or known normals (orient, --orient)"
            }
            Self::DoubtfulSigns { doubt, .. } => doubtful_remedy(doubt.main_reason()),
            Self::Guarded { .. } => {
                "a larger radius (--radius), more samples, or known normals (orient=\"given\", --orient given)"
            }
            Self::Rounded { .. } => {
                "float64 points (--precision f64), or the cloud moved toward the origin"
            }
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outliers { samples } => write!(
                f,
                "{samples} samples were left out as outliers: they are far from all others, or in mid-air"
            ),
            Self::Stray { samples, share } => write!(
                f,
                "{samples} samples lie apart from the surface and from one another; they stand for {} of its area",
                percent(*share)
            ),
            Self::Duplicates { samples } => write!(
                f,
                "{samples} samples are in the same place as others: neighborhoods hold copies instead of neighbors"
            ),
            Self::Turned { share } => write!(
                f,
                "{} of the normals point to the other side of the surface than those around them",
                percent(*share)
            ),
            Self::Thin { share } => write!(
                f,
                "{} of the samples lie on parts thinner than 3 cells",
                percent(*share)
            ),
            Self::Sparse {
                sample_spacing,
                spacing,
            } => write!(
                f,
                "samples are {:.1} cells of the surface apart (spacing {sample_spacing:.3e}, cells {spacing:.3e})",
                sample_spacing / spacing
            ),
            Self::Open { samples, guessed } => write!(
                f,
                "the surface is open: {samples} samples lie along rims or holes; the gaps, {} of the surface, are closed by guess, and the sign near them can't be trusted",
                percent(*guessed)
            ),
            Self::TouchesWall => {
                f.write_str("the surface reaches the wall of the grid and is cut off there")
            }
            Self::ThinSheet { cells } => write!(
                f,
                "the sheet is {cells:.2} cells of the surface thick, and its shell may have holes; φ is exact"
            ),
            Self::Fragments { fragments, pieces } => write!(
                f,
                "the surface has {pieces} separate pieces, of which {fragments} are fragments: small, or without samples"
            ),
            Self::InsideOut { volume } => write!(
                f,
                "the surface is inside out: its volume is {volume:.3e}, and φ is negative outside"
            ),
            Self::Missed { share, far } => write!(
                f,
                "{} of the samples lie more than one cell of the surface from it, {} more than two cells of φ",
                percent(*share),
                percent(*far)
            ),
            Self::DoubtfulSigns { doubt, largest } => {
                f.write_str(&doubtful_signs(doubt, largest.as_ref()))
            }
            Self::Guarded { samples } => write!(
                f,
                "{samples} samples have no well-defined normal (a corner, a line or an isolated point)"
            ),
            Self::Rounded { cells } => write!(
                f,
                "coordinates are rounded to {cells:.1e} cells by the number type"
            ),
        }
    }
}

/// Number, reasons and place of doubtful signs.
fn doubtful_signs(doubt: &Doubt, largest: Option<&Region>) -> String {
    let mut text = format!(
        "the side of the surface is doubtful for {} of the samples",
        percent(doubt.share())
    );
    let mut named = doubt.by_frequency();
    named.retain(|&reason| doubt.of(reason) * SMALLEST_REASON >= doubt.doubtful());
    for (k, &reason) in named.iter().enumerate() {
        let lead = if k == 0 { ":" } else { "," };
        text += &format!(
            "{lead} {} {}",
            percent(doubt.share_of(reason)),
            cause(reason)
        );
    }
    if let Some(region) = largest {
        let [x, y, z] = region.center();
        text += &format!(
            "; the largest region has {} samples around ({x:.4}, {y:.4}, {z:.4})",
            region.samples
        );
    }
    text
}

/// Why samples are doubtful.
fn cause(reason: Reason) -> &'static str {
    match reason {
        Reason::Thin => "lie on sheets less than about 3 samples apart",
        Reason::Sparse => "are far from all others",
        Reason::Open => "lie at a rim or hole, or on an open surface",
        Reason::Noisy => "scatter about the surface",
        Reason::Unexplained => "for no plain reason",
    }
}

/// Remedy for doubtful signs.
fn doubtful_remedy(reason: Reason) -> &'static str {
    match reason {
        Reason::Thin => {
            "more samples there, or give sensor positions or normals (orient=\"sensors\" or \"signs\", --orient)"
        }
        Reason::Sparse => {
            "more samples there or fewer outliers, or give sensor positions or normals (orient=\"sensors\" or \"signs\", --orient)"
        }
        Reason::Open => {
            "close the gaps, or give sensor positions or normals (orient=\"sensors\" or \"signs\", --orient)"
        }
        Reason::Noisy => {
            "remove noise, or give sensor positions or normals (orient=\"sensors\" or \"signs\", --orient)"
        }
        Reason::Unexplained => {
            "give sensor positions or normals (orient=\"sensors\" or \"signs\", --orient), or look at the confidence in the output"
        }
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_warning_has_a_code_a_text_and_a_remedy_of_its_own() {
        let doubt = Doubt::count(10, &[(0, Reason::Thin)]);
        let all = [
            Warning::Stray {
                samples: 7,
                share: 0.1,
            },
            Warning::Duplicates { samples: 9 },
            Warning::Turned { share: 0.1 },
            Warning::Missed {
                share: 0.1,
                far: 0.0,
            },
            Warning::Open {
                samples: 30,
                guessed: 0.1,
            },
            Warning::InsideOut { volume: -1.0 },
            Warning::TouchesWall,
            Warning::DoubtfulSigns {
                doubt,
                largest: None,
            },
            Warning::Fragments {
                fragments: 1,
                pieces: 2,
            },
            Warning::Thin { share: 0.1 },
            Warning::Sparse {
                sample_spacing: 2.0,
                spacing: 1.0,
            },
            Warning::Outliers { samples: 1 },
            Warning::ThinSheet { cells: 1.0 },
            Warning::Guarded { samples: 5 },
            Warning::Rounded { cells: 0.1 },
        ];
        assert_eq!(all.each_ref().map(Warning::code), Warning::CODES);
        for warning in all {
            // The line of a verdict has 500 characters.
            for level in [Level::Thin, Level::Local] {
                let length = warning.remedy(level).len();
                assert!((10..160).contains(&length), "{warning}");
            }
            assert!(warning.severity() > Verdict::Good && warning.to_string().len() > 20);
        }
    }

    #[test]
    fn samples_off_the_surface_are_bad_where_they_are_far_from_it() {
        let severity = |far| Warning::Missed { share: 0.2, far }.severity();
        assert_eq!([0.01, 0.011].map(severity), [Verdict::Check, Verdict::Bad]);
    }
}
