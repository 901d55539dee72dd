//! Ratio of the local derivative to the difference across a cell, which an optimizer with finite steps sees.

use isograd::poisson::Smoothing;
use isograd::{
    Cotangent, Options, PointCloud, Reconstruction, Reconstructor, SurfaceResolution, distance,
    isosurface, orient, splat,
};
use isograd_element::vector::dot;
use serde::Serialize;

use super::functional::{Functional, LAYER};
use super::motion::{Frame, Motion};
use super::parameters::flipped;
use crate::output::Outcome;
use crate::sampling::{Body, Draw, Sampled, points_only};

/// A choice of options.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Choice {
    /// Whether the paper's weights are used instead of the B-spline.
    pub paper_weights: bool,
    /// Whether samples are weighted by their area.
    pub area: bool,
    /// Whether exact normals are given, which turn with the motion.
    pub exact_normals: bool,
}

impl Choice {
    /// Choices that are measured, the default first.
    pub const ALL: [Self; 5] = [
        Self::new(false, true, false),
        Self::new(false, true, true),
        Self::new(false, false, false),
        Self::new(true, true, false),
        Self::new(true, false, false),
    ];

    const fn new(paper_weights: bool, area: bool, exact_normals: bool) -> Self {
        Self {
            paper_weights,
            area,
            exact_normals,
        }
    }

    fn options(self, spacing: f64) -> Options {
        Options::default()
            .surface(SurfaceResolution::Grid)
            .orient(if self.exact_normals {
                orient::Method::Given
            } else {
                orient::Method::default()
            })
            .splat(if self.paper_weights {
                splat::Weights::Paper
            } else {
                splat::Weights::BSpline
            })
            .area(self.area)
            // The other settings of the paper as well.
            .level(if self.paper_weights {
                isosurface::Level::Mean
            } else {
                isosurface::Level::Local
            })
            .smoothing(if self.paper_weights {
                Smoothing::Cells(0.0)
            } else {
                Smoothing::Auto
            })
            // The functionals are constant beyond.
            .band(distance::Band::Within((LAYER + 1.0) * spacing))
            .checks(false)
    }

    /// Input of the pipeline: the cloud with its normals or without.
    fn given(self, cloud: PointCloud<f64>) -> Outcome<PointCloud<f64>> {
        if self.exact_normals {
            return Ok(cloud);
        }
        points_only(cloud.points())
    }
}

/// One derivative.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Ratio {
    /// Name of the body.
    pub body: &'static str,
    /// Distribution of the samples.
    pub draw: Draw,
    /// Options.
    #[serde(flatten)]
    pub choice: Choice,
    /// Motion of the samples.
    pub motion: Motion,
    /// Differentiated functional.
    pub functional: Functional,
    /// Derivative by the pullback, per unit length of the fastest point.
    pub pullback: f64,
    /// Difference quotient across half a cell to either side.
    pub differences: f64,
    /// Mean of the pullbacks along the step by Simpson's rule, for the default options.
    pub path: Option<f64>,
    /// Samples whose normal changes sign over the step.
    pub flipped: usize,
    /// Samples whose number of neighbors changes over the step.
    pub changed: usize,
}

impl Ratio {
    /// Pullback over differences.
    pub fn ratio(&self) -> f64 {
        self.pullback / self.differences
    }
}

/// Measures a body with every choice of options, motion and functional.
pub fn measure(body: &Body, sampled: &Sampled, draw: Draw) -> Outcome<Vec<Ratio>> {
    let frame = Frame::of(&sampled.cloud)?;
    let mut ratios = Vec::new();
    for choice in Choice::ALL {
        eprintln!("{}: {draw} samples, {choice:?}", body.name);
        let mut plan = Reconstructor::new(sampled.grid, choice.options(sampled.grid.spacing()))?;
        let cloud = choice.given(sampled.cloud.clone())?;
        let local = local(plan.reconstruct(&cloud)?, &sampled.cloud, &frame)?;
        for (place, motion) in Motion::ALL.into_iter().enumerate() {
            let pulled = local[place];
            let path = match choice == Choice::ALL[0] {
                true => Some(path(&mut plan, choice, sampled, &frame, place, pulled)?),
                false => None,
            };
            let across = across(&mut plan, choice, sampled, &frame, motion)?;
            for (k, functional) in Functional::ALL.into_iter().enumerate() {
                ratios.push(Ratio {
                    body: body.name,
                    draw,
                    choice,
                    motion,
                    functional,
                    pullback: pulled[k],
                    differences: across.slopes[k],
                    path: path.map(|path| path[k]),
                    flipped: across.flipped,
                    changed: across.changed,
                });
            }
        }
    }
    Ok(ratios)
}

/// A number for each functional.
type Slopes = [f64; Functional::ALL.len()];

/// Derivatives for all motions, by one pullback for each functional.
fn local(
    base: &Reconstruction<f64>,
    exact: &PointCloud<f64>,
    frame: &Frame,
) -> Outcome<[Slopes; Motion::ALL.len()]> {
    let pairs = exact.points().iter();
    let pairs = || pairs.clone().zip(exact.normals().unwrap_or_default());
    let mut slopes = [Slopes::default(); Motion::ALL.len()];
    for (k, functional) in Functional::ALL.into_iter().enumerate() {
        let bar = functional.cotangent(frame, base.sdf());
        let cotangent = Cotangent {
            sdf: Some(&bar),
            ..Cotangent::default()
        };
        let out = base.pullback(&cotangent)?;
        for (slopes, motion) in slopes.iter_mut().zip(Motion::ALL) {
            let of_points = pairs().zip(&out.points);
            slopes[k] = of_points
                .map(|((&x, &n), &bar)| dot(bar, motion.velocity(frame, x, n)))
                .sum();
            let of_normals = pairs().zip(&out.normals);
            slopes[k] += of_normals
                .map(|((&x, &n), &bar)| dot(bar, motion.turning(frame, x, n)))
                .sum::<f64>();
        }
    }
    Ok(slopes)
}

/// Mean of the local derivatives along a step from −½ to ½ cell, given the one at its center. All motions are straight, so
/// velocities are those at the center.
fn path(
    plan: &mut Reconstructor<f64>,
    choice: Choice,
    sampled: &Sampled,
    frame: &Frame,
    place: usize,
    center: Slopes,
) -> Outcome<Slopes> {
    const SIMPSON: [(f64, f64); 4] = [(-0.5, 1.0), (-0.25, 4.0), (0.25, 4.0), (0.5, 1.0)];
    let mut sum = center.map(|slope| 2.0 * slope);
    for (cells, weight) in SIMPSON {
        let step = cells * sampled.grid.spacing();
        let moved = choice.given(Motion::ALL[place].moved(frame, &sampled.cloud, step)?)?;
        let there = local(plan.reconstruct(&moved)?, &sampled.cloud, frame)?[place];
        sum = std::array::from_fn(|k| sum[k] + weight * there[k]);
    }
    Ok(sum.map(|slope| slope / 12.0))
}

/// Differences of two reconstructions, half a cell to either side.
struct Across {
    slopes: Slopes,
    flipped: usize,
    changed: usize,
}

/// Reconstructs at both ends of the step.
fn across(
    plan: &mut Reconstructor<f64>,
    choice: Choice,
    sampled: &Sampled,
    frame: &Frame,
    motion: Motion,
) -> Outcome<Across> {
    let h = sampled.grid.spacing();
    let mut side = |step: f64| -> Outcome<End> {
        let moved = choice.given(motion.moved(frame, &sampled.cloud, step)?)?;
        Ok(End::of(plan.reconstruct(&moved)?, frame))
    };
    let (plus, minus) = (side(0.5 * h)?, side(-0.5 * h)?);
    let counts = plus.counts.iter().zip(&minus.counts);
    Ok(Across {
        slopes: std::array::from_fn(|k| (plus.values[k] - minus.values[k]) / h),
        flipped: flipped(&plus.normals, &minus.normals),
        changed: counts.filter(|(a, b)| a != b).count(),
    })
}

/// One end of a step.
struct End {
    values: Slopes,
    normals: Vec<[f64; 3]>,
    counts: Vec<u32>,
}

impl End {
    fn of(result: &Reconstruction<f64>, frame: &Frame) -> Self {
        Self {
            values: Functional::ALL.map(|functional| functional.of(frame, result.sdf())),
            normals: result.normals().to_vec(),
            counts: result.neighbor_counts().to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradients::Study;

    #[test]
    fn the_derivative_predicts_the_difference_across_a_cell() {
        let motions = [Motion::Along, Motion::Scaling, Motion::Bending];
        let paper = Choice::new(true, false, false);
        let study = Study::full();
        for body in [study.torus.halved(), study.fish] {
            let sampled = body.sample(Draw::Random).expect("samples");
            let frame = Frame::of(&sampled.cloud).expect("points");
            let ratios = |choice: Choice, motions: &[Motion]| -> Vec<f64> {
                let mut plan =
                    Reconstructor::new(sampled.grid, choice.options(sampled.grid.spacing()))
                        .expect("options");
                let cloud = choice.given(sampled.cloud.clone()).expect("points");
                let base = plan.reconstruct(&cloud).expect("a body");
                let local = local(base, &sampled.cloud, &frame).expect("a pullback");
                let ratio = |&motion: &Motion| {
                    let place = Motion::ALL.iter().position(|m| *m == motion);
                    let across = across(&mut plan, choice, &sampled, &frame, motion);
                    local[place.expect("one of all")][0] / across.expect("moved").slopes[0]
                };
                motions.iter().map(ratio).collect()
            };
            let (ours, paper) = (
                ratios(Choice::ALL[0], &motions),
                ratios(paper, &[Motion::Along]),
            );
            println!(
                "{}: {ours:.4?}; the paper's weights: {paper:.4?}",
                body.name
            );
            assert!(ours.iter().all(|r| (r - 1.0).abs() < 0.02), "{ours:?}");
            // They jump at cell faces, which the derivative does not include.
            assert!(paper[0] < 0.5, "{paper:?}");
        }
    }
}
