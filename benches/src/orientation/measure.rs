//! Errors of one orientation method on one cloud.

use isograd::neighbors::{CellIndex, Radius};
use isograd::orient::doubt::{Doubt, Reason, reasons};
use isograd::orient::{Method, Orientation, ParityOptions};
use isograd::{Orienter, PointCloud, Stage};
use isograd_element::vector;
use serde::Serialize;

use super::body::{Body, Clean};

/// Smallest absolute cosine between an axis and the true normal for its sign to be evaluated: 60 degrees.
const EVALUATED: f64 = 0.5;

/// Lower bounds of classes of confidence.
pub const CLASSES: [f64; 6] = [0.0, 0.1, 0.25, 0.5, 0.75, 0.9];

/// Errors of one method on one cloud, in percent and degrees.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Errors {
    /// Wrong signs, in percent of those evaluated.
    pub wrong: f64,
    /// Lower bound of `wrong` for a noisy cloud, given the clean surface.
    pub lower_bound: Option<f64>,
    /// Samples whose axis is within 60 degrees of the true normal, in percent; only their signs are evaluated.
    pub evaluated: f64,
    /// Median angle between axis and true normal.
    pub axis_median: f64,
    /// Mean angle between axis and true normal.
    pub axis_mean: f64,
    /// Mean angle with the common radius for all neighborhoods.
    pub axis_mean_narrow: f64,
    /// Doubtful samples, in percent.
    pub doubtful: f64,
    /// Doubtful samples by reason, in percent.
    pub reasons: Vec<(&'static str, f64)>,
    /// Doubtful ones among the wrong signs, in percent; absent if no sign is wrong.
    pub caught: Option<f64>,
    /// Number of the evaluated signs, and of the wrong ones among them, for each of [`CLASSES`].
    pub by_confidence: Vec<[usize; 2]>,
}

/// Result of one method on one cloud.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Number of points.
    pub points: usize,
    /// Errors of signs and axes.
    pub errors: Errors,
    /// Seconds for neighborhoods and axes, and for the signs.
    pub seconds: [f64; 2],
    /// Normals and confidence.
    pub orientation: Orientation<f32>,
}

/// A cloud in single precision.
///
/// # Panics
/// On a degenerate cloud; the suite has none.
pub fn cloud(points: &[[f64; 3]]) -> PointCloud<f32> {
    PointCloud::new(points.iter().map(|&p| vector::of_f64(p)).collect()).expect("a cloud")
}

/// A plan for normals with this radius, without checks.
pub fn plan(radius: Radius, method: Method) -> Orienter<f32> {
    Orienter::new(radius, method).with_checks(false)
}

/// Evaluates a method on a cloud. The fastest of `runs` counts.
///
/// # Panics
/// On a method that fails; those of the suite do not.
pub fn measure(body: &Body, method: &Method, runs: usize) -> Measured {
    let cloud = cloud(&body.points);
    let mut plan = plan(Radius::Auto, *method);
    let mut seconds = [f64::INFINITY; 2];
    for _ in 0..runs {
        plan.orient(&cloud).expect("signs");
        for (least, stage) in seconds.iter_mut().zip([Stage::Normals, Stage::Orient]) {
            *least = least.min(plan.report().seconds.of(stage));
        }
    }
    Measured {
        points: body.points.len(),
        errors: evaluate(body, &cloud, &plan),
        seconds,
        orientation: plan.into_parts().0,
    }
}

/// Signs of the samples whose true normal is known.
pub struct Signs {
    /// Number of known normals.
    known: usize,
    /// Indices of the samples whose sign is evaluated.
    evaluated: Vec<usize>,
    /// Indices of those whose sign is wrong.
    wrong: Vec<usize>,
}

impl Signs {
    /// Compares normals with the true ones.
    pub fn new(body: &Body, out: &Orientation<f32>) -> Self {
        let truth = body.normals.iter().enumerate();
        let known = truth.filter(|(_, truth)| vector::norm(**truth) > 0.0);
        let cosine = |(i, &truth): (usize, &[f64; 3])| {
            (i, vector::dot(vector::to_f64(out.normals[i]), truth))
        };
        let mut cosines: Vec<(usize, f64)> = known.map(cosine).collect();
        if body.open && cosines.iter().map(|c| c.1.signum()).sum::<f64>() < 0.0 {
            cosines.iter_mut().for_each(|c| c.1 = -c.1);
        }
        let indices = |keep: &dyn Fn(f64) -> bool| -> Vec<usize> {
            cosines.iter().filter(|c| keep(c.1)).map(|c| c.0).collect()
        };
        Self {
            known: cosines.len(),
            evaluated: indices(&|cosine| cosine.abs() > EVALUATED),
            wrong: indices(&|cosine| cosine < -EVALUATED),
        }
    }

    /// Numbers of evaluated and of wrong signs in each class of confidence.
    fn by_confidence(&self, confidence: &[f32]) -> Vec<[usize; 2]> {
        let mut counts = vec![[0; 2]; CLASSES.len()];
        for (column, indices) in [&self.evaluated, &self.wrong].into_iter().enumerate() {
            for &i in indices {
                let class = CLASSES.partition_point(|&low| low <= f64::from(confidence[i]));
                counts[class.max(1) - 1][column] += 1;
            }
        }
        counts
    }

    /// Wrong signs, in percent of those evaluated.
    pub fn percent(&self) -> f64 {
        percent(self.wrong.len(), self.evaluated.len())
    }
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// Errors of the last result of a plan, on this cloud.
fn evaluate(body: &Body, cloud: &PointCloud<f32>, plan: &Orienter<f32>) -> Errors {
    let (out, neighborhoods) = (plan.orientation(), plan.neighborhoods());
    let signs = Signs::new(body, out);
    let wrong = &signs.wrong;
    let angles_of_narrow = angles(body, &narrow_axes(cloud, neighborhoods.common_radius));
    let mut angles = angles(body, &out.normals);
    angles.sort_by(f64::total_cmp);
    let why = reasons(cloud.points(), out, neighborhoods);
    let is_doubtful = |i: &&usize| why.binary_search_by_key(*i, |f| f.0 as usize).is_ok();
    let caught = wrong.iter().filter(is_doubtful).count();
    let doubt = Doubt::count(body.points.len(), &why);
    Errors {
        wrong: signs.percent(),
        lower_bound: (body.clean.as_ref())
            .map(|clean| 100.0 * least_wrong(body, clean, &signs.evaluated)),
        evaluated: percent(signs.evaluated.len(), signs.known),
        axis_median: angles.get(angles.len() / 2).copied().unwrap_or(0.0),
        axis_mean: mean(&angles),
        axis_mean_narrow: mean(&angles_of_narrow),
        doubtful: 100.0 * doubt.share(),
        reasons: Reason::ALL
            .map(|reason| (reason.name(), 100.0 * doubt.share_of(reason)))
            .to_vec(),
        caught: (!wrong.is_empty()).then(|| percent(caught, wrong.len())),
        by_confidence: signs.by_confidence(&out.confidence),
    }
}

/// Axes with this radius for all neighborhoods.
fn narrow_axes(cloud: &PointCloud<f32>, radius: f32) -> Vec<[f32; 3]> {
    // The method does not change axes; this one is the fastest.
    let method = Method::Parity(ParityOptions::default());
    let mut plan = plan(Radius::Fixed(f64::from(radius)), method);
    plan.orient(cloud).expect("signs");
    plan.axes().normals.clone()
}

/// Fraction of these samples whose true normal disagrees with the expected one, given the clean surface: the mean of the
/// normals of the 64 nearest clean samples, weighted by the likelihood of the displacement.
fn least_wrong(body: &Body, clean: &Clean, evaluated: &[usize]) -> f64 {
    let surface = CellIndex::new(&clean.body.points);
    let (mut nearest, mut wrong) = (Vec::new(), 0);
    for &i in evaluated {
        surface.nearest(body.points[i], 64, &mut nearest);
        let expected = nearest.iter().fold([0.0; 3], |sum, &(j, d2)| {
            let probable = (-0.5 * d2 / (clean.deviation * clean.deviation)).exp();
            vector::add(sum, vector::scale(clean.body.normals[j as usize], probable))
        });
        wrong += usize::from(vector::dot(expected, body.normals[i]) < 0.0);
    }
    wrong as f64 / evaluated.len().max(1) as f64
}

/// Angles in degrees between axes and true normals.
fn angles(body: &Body, axes: &[[f32; 3]]) -> Vec<f64> {
    let pairs = axes.iter().zip(&body.normals);
    let known = pairs.filter(|(_, truth)| vector::norm(**truth) > 0.0);
    let cosine = |(&axis, &truth): (&[f32; 3], &[f64; 3])| {
        vector::dot(vector::to_f64(axis), truth).abs().min(1.0)
    };
    known.map(|pair| cosine(pair).acos().to_degrees()).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_signs_are_counted_among_evaluated_ones() {
        // A tenth of the true normals points inward, and half of all are not evaluated.
        let body = Body::sphere(1.0, 2_000, 3);
        let mut shown = body.clone();
        for (i, n) in shown.normals.iter_mut().enumerate() {
            match i % 10 {
                0 => *n = n.map(|x| -x),
                5.. => *n = [0.0; 3],
                _ => {}
            }
        }
        let measured = measure(&shown, &Method::Auto, 1);
        let Errors {
            wrong,
            evaluated,
            caught,
            by_confidence,
            ..
        } = measured.errors;
        assert!(
            (wrong - 20.0).abs() < 1e-9 && evaluated > 99.9,
            "{wrong} {evaluated}"
        );
        assert_eq!(caught, Some(0.0));
        // Half of the signs are known, and a fifth of those wrong; all are sure.
        let [sure, rest] = [by_confidence[5], by_confidence[0]];
        assert!(
            sure[0] > 900 && sure[1] * 5 > sure[0] * 9 / 10 && rest == [0, 0],
            "{by_confidence:?}"
        );
        assert!(measured.errors.axis_median < 3.0);
    }
}
