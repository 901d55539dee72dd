//! Small complete fits that recover known parameters.

use std::ops::ControlFlow;

use isograd::{Grid, PointCloud, Resolution};
use isograd_fit::{
    Adam, Band, Checkpoint, Decay, Error, Fit, Optimizer, Options, Outcome, Points,
    ShapeParameters, Start, Target, Variables,
};
use isograd_shapes::{Sampling, Shape, by_name};

fn shape(name: &str, values: &[(&str, f64)]) -> Shape {
    let mut shape = by_name(name).expect("a shape");
    shape.set_all(values.iter().copied()).expect("good values");
    shape
}

fn cloud(shape: &Shape, n: usize, seed: u64) -> PointCloud<f64> {
    let samples = shape.sample::<f64>(n, &Sampling::default(), seed);
    PointCloud::new(samples.expect("samples").cloud.points().to_vec()).expect("finite")
}

/// The target that a shape's own samples make, `cells` long.
fn target(shape: &Shape, cells: usize) -> Target {
    let cloud = cloud(shape, 3000, 99);
    let grid = Grid::fit(&cloud, Resolution::Cells(cells), 0.25).expect("a grid");
    Target::from_cloud(&cloud, grid, &isograd::Options::default()).expect("a target")
}

fn parameters(shape: Shape) -> ShapeParameters {
    ShapeParameters {
        samples: 2500,
        ..ShapeParameters::new(shape)
    }
}

fn finish(fit: &mut Fit) -> Outcome {
    fit.run(&mut |_| ControlFlow::Continue(())).expect("a run")
}

/// Greatest relative difference of the fitted parameters from those of `truth`.
fn worst(fit: &Fit, truth: &Shape) -> f64 {
    let fitted = fit.shape().expect("a shape");
    let pairs = fitted.values().iter().zip(truth.values());
    pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn the_radius_of_a_sphere_is_found_with_both_methods_and_in_a_band() {
    let truth = shape("sphere", &[("radius", 0.5)]);
    let target = target(&truth, 28);
    let adam = Optimizer::Adam(Adam {
        rate: 0.03,
        decay: Decay::Exponential { half_life: 15.0 },
        ..Adam::default()
    });
    for (optimizer, band, epochs) in [
        (Optimizer::default(), Band::Full, 12),
        (
            Optimizer::default(),
            Band::Within(3.0 * target.grid().spacing()),
            12,
        ),
        (adam, Band::Full, 60),
    ] {
        let options = Options {
            optimizer,
            band,
            epochs,
            tolerance: 1e-3,
            ..Options::default()
        };
        let variables = Variables::Shape(parameters(shape("sphere", &[("radius", 0.4)])));
        let mut fit = Fit::new(&target, variables, options).expect("a fit");
        finish(&mut fit);
        // Samples of another seed at 19 cells across: a hundredth of a cell.
        assert!(
            worst(&fit, &truth) < 2e-3,
            "{optimizer:?} {:?}",
            fit.history()
        );
        let last = fit.history().last().expect("the end");
        assert!(last.mean_error < 0.02, "{last:?}");
        assert!(last.epoch <= epochs && last.evaluations >= last.epoch);
    }
}

#[test]
fn both_radii_of_a_torus_are_found_from_a_random_start_that_repeats() {
    let truth = shape("torus", &[]);
    let target = target(&truth, 36);
    let fitted = || {
        let variables = Variables::Shape(ShapeParameters {
            start: Start::Random {
                seed: 5,
                spread: 0.25,
            },
            ..parameters(truth.clone())
        });
        let options = Options {
            epochs: 25,
            tolerance: 5e-3,
            ..Options::default()
        };
        let mut fit = Fit::new(&target, variables, options).expect("a fit");
        assert!(worst(&fit, &truth) > 0.05, "far off at first");
        finish(&mut fit);
        fit
    };
    let fit = fitted();
    assert!(worst(&fit, &truth) < 5e-3, "{:?}", fit.history());
    assert_eq!(fit.history(), fitted().history());
}

#[test]
fn the_points_of_a_dented_sphere_become_a_sphere() {
    let sphere = shape("sphere", &[]);
    let target = target(&sphere, 28);
    let dented = cloud(&sphere, 1500, 3)
        .points()
        .iter()
        .map(|p| {
            let dent = 1.0 + 0.12 * (7.0 * p[0]).sin() * (5.0 * p[1] + 1.0).cos();
            p.map(|x| x * dent)
        })
        .collect();
    let dented = PointCloud::new(dented).expect("finite");
    for smoothness in [0.0, 0.01] {
        let variables = Variables::Points(Points {
            smoothness,
            ..Points::new(dented.clone())
        });
        let options = Options {
            epochs: 40,
            tolerance: 0.02,
            ..Options::default()
        };
        let mut fit = Fit::new(&target, variables, options).expect("a fit");
        finish(&mut fit);
        let (first, last) = (&fit.history()[0], fit.history().last().expect("the end"));
        assert!(
            first.mean_error > 0.2 && last.mean_error < 0.05,
            "{first:?} {last:?}"
        );
        assert!((last.smoothness_loss > 0.0) == (smoothness > 0.0));
        assert!(fit.shape().is_none() && fit.parameter_names().is_empty());
        let sum = last.data_loss + last.smoothness_loss + last.bounds_loss;
        assert_eq!(sum, last.loss);
    }
}

/// A torus with Adam or L-BFGS, new samples every 3 epochs.
fn torus(optimizer: Optimizer, epochs: usize) -> (Target, Variables, Options) {
    let variables = Variables::Shape(ShapeParameters {
        resample: Some(3),
        ..parameters(shape("torus", &[("major", 0.8), ("minor", 0.3)]))
    });
    let options = Options {
        optimizer,
        epochs,
        ..Options::default()
    };
    (target(&shape("torus", &[]), 28), variables, options)
}

#[test]
fn a_run_that_was_stopped_and_resumed_ends_in_the_same_bits_on_any_number_of_threads() {
    for optimizer in [Optimizer::default(), Optimizer::Adam(Adam::default())] {
        let (target, variables, options) = torus(optimizer, 8);
        let with_threads = |threads: usize, work: &(dyn Fn() -> Fit + Sync)| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(work)
        };
        let whole = with_threads(1, &|| {
            let mut fit = Fit::new(&target, variables.clone(), options.clone()).expect("a fit");
            finish(&mut fit);
            fit
        });
        let parts = with_threads(3, &|| {
            let mut fit = Fit::new(&target, variables.clone(), options.clone()).expect("a fit");
            for stop in [2, 5] {
                let outcome = fit.run(&mut |fit| match fit.epoch() >= stop {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                });
                assert_eq!(outcome.expect("a run"), Outcome::Stopped);
                let text = serde_json::to_string(&fit.checkpoint()).expect("JSON");
                let checkpoint: Checkpoint = serde_json::from_str(&text).expect("JSON");
                assert_eq!(checkpoint.epoch(), stop);
                fit = Fit::resume(&target, variables.clone(), options.clone(), checkpoint)
                    .expect("the same fit");
            }
            finish(&mut fit);
            fit
        });
        assert_eq!(whole.history(), parts.history());
        let points = |fit: &Fit| fit.cloud().expect("a cloud").points().to_vec();
        assert_eq!(points(&whole), points(&parts));
    }
}

#[test]
fn a_checkpoint_of_another_fit_is_refused_and_says_what_differs() {
    let (target, variables, options) = torus(Optimizer::default(), 1);
    let mut fit = Fit::new(&target, variables.clone(), options.clone()).expect("a fit");
    finish(&mut fit);
    let refused = |target: &Target, variables: &Variables, options: &Options| {
        Fit::resume(target, variables.clone(), options.clone(), fit.checkpoint())
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    };
    let other_target = self::target(&shape("torus", &[("minor", 0.2)]), 28);
    assert!(refused(&other_target, &variables, &options).contains("target"));
    let other = Variables::Shape(parameters(shape("torus", &[])));
    assert!(refused(&target, &other, &options).contains("variables"));
    let adam = Options {
        optimizer: Optimizer::Adam(Adam::default()),
        ..options.clone()
    };
    assert!(refused(&target, &variables, &adam).contains("optimizer"));
    // More epochs are no difference.
    let longer = Options {
        epochs: 2,
        ..options
    };
    assert_eq!(refused(&target, &variables, &longer), "");
}

#[test]
fn a_start_outside_the_grid_says_so_and_a_step_outside_is_shortened() {
    let truth = shape("sphere", &[("radius", 0.5)]);
    let target = target(&truth, 24);
    let start = |radius| Variables::Shape(parameters(shape("sphere", &[("radius", radius)])));
    let error = Fit::new(&target, start(2.0), Options::default()).err();
    assert!(matches!(error, Some(Error::Start(_))), "{error:?}");
    let text = error.map(|e| e.to_string()).unwrap_or_default();
    assert!(text.contains("larger grid"), "{text}");
    // Steps of Adam three times as long as the room that is left: the first one goes outward and is cut.
    let adam = Optimizer::Adam(Adam {
        rate: 2.0,
        decay: Decay::Exponential { half_life: 4.0 },
        ..Adam::default()
    });
    let options = Options {
        optimizer: adam,
        epochs: 40,
        ..Options::default()
    };
    let mut fit = Fit::new(&target, start(0.4), options).expect("a fit");
    finish(&mut fit);
    assert!(worst(&fit, &truth) < 0.02, "{:?}", fit.history());
    let last = fit.history().last().expect("the end");
    assert!(last.evaluations > last.epoch + 1, "{last:?}");
}
