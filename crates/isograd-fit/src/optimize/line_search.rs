//! Line search for the strong Wolfe conditions (Nocedal and Wright 2006, algorithms 3.5 and 3.6), for functions that
//! may fail at some points.

use super::{Evaluation, Function, HALVINGS, dot, is_finite, moved};

/// Sufficient decrease `c₁`: the value must fall by this fraction of the decrease that the slope predicts.
const FALL: f64 = 1e-4;
/// Curvature condition `c₂`: the slope must fall to this fraction of the initial one.
const FLATTEN: f64 = 0.9;
/// Growth of the step while the slope is still steep.
const GROWTH: f64 = 2.5;
/// Maximum number of evaluations, failed ones not counted.
const TRIALS: usize = 12;

/// Result of a line search.
pub(super) enum SearchResult<D, E> {
    /// A lower point and its evaluation.
    Lower(Vec<f64>, Evaluation<D>),
    /// No point with sufficient decrease.
    NoDecrease,
    /// The function failed even at the shortest step.
    Failed(E),
}

/// A point of the line.
#[derive(Clone, Copy)]
struct Place {
    at: f64,
    value: f64,
    slope: f64,
}

/// Interval that contains a point with the conditions: its end of lower value, and its other end with the value there,
/// if there is one.
struct Bracket {
    low: Place,
    high: Option<(f64, Option<f64>)>,
}

impl Bracket {
    /// Narrows the bracket by a point; returns whether it is the lowest so far with sufficient decrease from `start`.
    fn take(&mut self, place: Place, start: &Place) -> bool {
        // Strictly lower also where the promised fall is lost in rounding.
        let falls = place.value <= start.value + FALL * place.at * start.slope;
        let falls = falls && place.value < start.value;
        if !falls || place.value >= self.low.value {
            self.high = Some((place.at, Some(place.value)));
            return false;
        }
        let toward = self.high.map_or(1.0, |(high, _)| high - self.low.at);
        if place.slope * toward >= 0.0 {
            self.high = Some((self.low.at, Some(self.low.value)));
        }
        self.low = place;
        true
    }

    /// Next trial step, at most `reach`.
    fn next(&self, reach: f64) -> f64 {
        let low = self.low;
        match self.high {
            None => (low.at * GROWTH).min(reach),
            // A point without a value tells nothing but that it is too far.
            Some((high, None)) => 0.5 * (low.at + high),
            Some((high, Some(value))) => {
                // The parabola through both values with the slope of the low end.
                let width = high - low.at;
                let curvature = value - low.value - low.slope * width;
                let share = -0.5 * low.slope * width / curvature;
                let share = if share.is_finite() { share } else { 0.5 };
                low.at + share.clamp(0.1, 0.9) * width
            }
        }
    }
}

/// Searches from `x`, with the evaluation `here`, along `d`, with steps from 1 to at most `reach`.
pub(super) fn search<D, E>(
    x: &[f64],
    here: &Evaluation<D>,
    d: &[f64],
    reach: f64,
    function: &mut impl Function<D, E>,
) -> SearchResult<D, E> {
    let slope = dot(&here.gradient, d);
    if !(slope < 0.0) {
        return SearchResult::NoDecrease;
    }
    let start = Place {
        at: 0.0,
        value: here.value,
        slope,
    };
    let mut bracket = Bracket {
        low: start,
        high: None,
    };
    let mut lowest = None;
    let (mut at, mut trials, mut failure, mut failures) = (reach.min(1.0), 0, None, 0);
    while trials < TRIALS && failures <= HALVINGS {
        let point = moved(x, at, d);
        match function(&point) {
            Ok(evaluation) if is_finite(&evaluation) => {
                trials += 1;
                let place = Place {
                    at,
                    value: evaluation.value,
                    slope: dot(&evaluation.gradient, d),
                };
                if bracket.take(place, &start) {
                    lowest = Some((point, evaluation));
                    if place.slope.abs() <= -FLATTEN * slope || at >= reach {
                        break;
                    }
                }
            }
            failed => {
                failures += 1;
                failure = failed.err();
                bracket.high = Some((at, None));
            }
        }
        let next = bracket.next(reach);
        if next == at {
            break;
        }
        at = next;
    }
    match (lowest, failure) {
        (Some((point, evaluation)), _) => SearchResult::Lower(point, evaluation),
        (None, Some(error)) if trials == 0 => SearchResult::Failed(error),
        _ => SearchResult::NoDecrease,
    }
}
