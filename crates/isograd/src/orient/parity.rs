//! Orientation by parity along the normal, as the paper prints it (its §2.2).

use super::Error;
use crate::neighbors::Neighborhoods;
use crate::{Real, parallel, vector};

/// Most probes across the box of the cloud. Only clouds whose points come in all but equal pairs, so
/// that `r_d` is nothing beside the spacing, would need more.
const MOST_PROBES: f64 = 1e6;

/// The hyperparameters of the paper's parity method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParityOptions {
    /// `γ_r`: `r_d = γ_r · ½ · max_i min_{j≠i} |x_i − x_j|`. At least 1; 2.5 in the paper.
    pub gamma: f64,
    /// `N_tol`: with more nonzero entries than this at the beginning of its detection array a normal is
    /// ambiguous (iteration 1). 2 in the paper.
    pub tolerance: usize,
    /// Distance `Δs` between probes over `r_d`. The paper doesn't print it. 1: then an undisturbed
    /// array begins with two nonzero entries, which is what a tolerance of 2 expects, and a surface
    /// crossed at right angles can't fall between two probes.
    pub step: f64,
}

impl Default for ParityOptions {
    fn default() -> Self {
        Self {
            gamma: 2.5,
            tolerance: 2,
            step: 1.0,
        }
    }
}

impl ParityOptions {
    /// Whether they are in range.
    ///
    /// # Errors
    /// [`Error::Option`].
    pub fn check(&self) -> Result<(), Error> {
        for (name, value, least) in [("gamma", self.gamma, 1.0), ("step", self.step, 0.01)] {
            if !(value >= least && value.is_finite()) {
                return Err(Error::Option { name, value, least });
            }
        }
        Ok(())
    }

    /// `r_d`, where `lonely` is how far the most lonely point is from its nearest other.
    pub fn detection_radius(&self, lonely: f64) -> f64 {
        (self.gamma * 0.5 * lonely).min(f64::MAX)
    }

    /// Number of probes that no ray along a unit vector exceeds, for a cloud whose box has this diagonal: at most 1e6,
    /// and 4 for each `Δs` in `r_d`.
    pub fn probes(&self, radius: f64, step: f64, diagonal: f64) -> usize {
        (diagonal / step + 4.0 * (radius / step)) as usize + 2
    }

    /// `Δs` of the detection radius, for a cloud whose box has this diagonal.
    ///
    /// # Errors
    /// [`Error::DetectionRadius`].
    pub fn probe_step(&self, radius: f64, diagonal: f64) -> Result<f64, Error> {
        let step = (self.step * radius).min(f64::MAX);
        if diagonal <= MOST_PROBES * step {
            Ok(step)
        } else {
            Err(Error::DetectionRadius { radius })
        }
    }
}

/// Counts of a detection array: `N_i` and `N_{i,one}`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pattern {
    /// Crossings after the first block.
    pub crossings: usize,
    /// Consecutive nonzero entries at the beginning.
    pub leading: usize,
}

/// `r_d`, in the unit of the points.
pub(super) fn detection_radius<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    options: &ParityOptions,
) -> f64 {
    let index = &neighborhoods.index;
    let squares = parallel::map_with(Vec::new, index.len(), |nearest, position| {
        index.nearest(index.point(position), 2, nearest);
        // The point itself or an equal one is first, so the second is the nearest other.
        nearest.get(1).map_or(T::zero(), |&(_, d2)| d2).f64()
    });
    options.detection_radius(squares.into_iter().fold(0.0, f64::max).sqrt())
}

/// The outcome for one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verdict {
    pub flip: bool,
    /// Whether one direction has an even and the other an odd number of crossings.
    pub closed: bool,
}

/// The outcome for each axis (given in input order), in sorted order; returns `r_d`.
///
/// Iterations 0, 1 and 2 in sequence. They look along the normal as it stands, so both directions of an
/// axis are looked along once, and the rules then choose among the two patterns.
pub(super) fn forward<T: Real>(
    axes: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
    options: &ParityOptions,
    verdicts: &mut Vec<Verdict>,
) -> Result<f64, Error> {
    options.check()?;
    let index = &neighborhoods.index;
    let radius = detection_radius(neighborhoods, options);
    let (low, high) = index.bounds();
    let (low, high) = (vector::to_f64(low), vector::to_f64(high));
    let diagonal = vector::norm(vector::sub(high, low));
    let step = options.probe_step(radius, diagonal)?;
    let ray = Ray {
        radius,
        step,
        probes: options.probes(radius, step, diagonal),
        low,
        high,
    };
    *verdicts = parallel::map_with(Vec::new, axes.len(), |nearest, position| {
        let point = vector::to_f64(index.point(position));
        let axis = vector::to_f64(axes[index.order()[position] as usize]);
        let along = ray.look(point, axis, neighborhoods, nearest);
        let against = ray.look(point, axis.map(|a| -a), neighborhoods, nearest);
        Verdict {
            flip: flip(along, against, options.tolerance),
            closed: along.crossings % 2 != against.crossings % 2,
        }
    });
    Ok(radius)
}

/// The three iterations of the paper: whether the normal ends opposite to where it began.
pub(super) fn flip(along: Pattern, against: Pattern, tolerance: usize) -> bool {
    let (mut own, mut other, mut flipped) = (along, against, false);
    let mut turn_if = |condition: fn(Pattern, Pattern, usize) -> bool| {
        if condition(own, other, tolerance) {
            std::mem::swap(&mut own, &mut other);
            flipped = !flipped;
        }
    };
    turn_if(|own, _, _| own.crossings % 2 == 1);
    turn_if(|own, _, tolerance| own.crossings != 0 || own.leading > tolerance);
    turn_if(|own, other, _| own.crossings > other.crossings);
    flipped
}

/// How rays are probed; lengths in user units.
#[derive(Clone, Copy, Debug)]
struct Ray {
    radius: f64,
    step: f64,
    /// No ray in a direction of unit length has more probes.
    probes: usize,
    low: [f64; 3],
    high: [f64; 3],
}

impl Ray {
    /// The pattern along `direction`, up to the first probe from which no sample can be in reach any more.
    ///
    /// Probes whose answer follows from the distance to the nearest sample are not asked: from a distance
    /// `D`, all probes nearer than `|D − r_d|` have the same answer.
    fn look<T: Real>(
        &self,
        start: [f64; 3],
        direction: [f64; 3],
        neighborhoods: &Neighborhoods<T>,
        nearest: &mut Vec<(u32, T)>,
    ) -> Pattern {
        // The point itself is in reach while m Δs ≤ r_d, whatever rounding makes of its distance.
        let own = (self.radius / self.step) as usize;
        let mut pattern = Pattern {
            crossings: 0,
            leading: 0,
        };
        let (mut m, mut inside, mut blocks) = (0usize, true, 0usize);
        while m <= self.probes {
            let at = vector::add(start, vector::scale(direction, m as f64 * self.step));
            if !self.in_reach_of_box(at) {
                break;
            }
            neighborhoods.index.nearest(vector::of_f64(at), 1, nearest);
            let distance = nearest
                .first()
                .map_or(f64::INFINITY, |&(_, d2)| d2.f64().sqrt());
            let detected = m <= own || distance <= self.radius;
            if blocks == 0 && inside && !detected {
                pattern.leading = m;
            }
            blocks += usize::from(inside && !detected);
            inside = detected;
            // A distance beyond the number type counts as infinite.
            m = m.saturating_add(self.same_ahead(distance));
        }
        if inside {
            pattern.leading = if blocks == 0 { m } else { pattern.leading };
            blocks += 1;
        }
        pattern.crossings = blocks - 1;
        pattern
    }

    /// Steps to the next probe that has to be asked.
    fn same_ahead(&self, distance: f64) -> usize {
        // A little less than the bound, so that rounding never skips a probe that differs.
        let safe = 0.999 * (distance - self.radius).abs() / self.step;
        (safe as usize).max(1)
    }

    fn in_reach_of_box(&self, at: [f64; 3]) -> bool {
        (0..3).all(|a| at[a] >= self.low[a] - self.radius && at[a] <= self.high[a] + self.radius)
    }
}
