//! The methods on functions whose minimum is known.

use super::*;

/// Why a function has no value.
#[derive(Debug, PartialEq)]
struct Undefined;

fn evaluation(value: f64, gradient: Vec<f64>) -> Evaluation<()> {
    Evaluation {
        value,
        gradient,
        detail: (),
    }
}

/// `Σ 100 (x_{i+1} − x_i²)² + (1 − x_i)²`.
fn rosenbrock(x: &[f64]) -> Evaluation<()> {
    let (mut value, mut gradient) = (0.0, vec![0.0; x.len()]);
    for i in 0..x.len() - 1 {
        let (a, b) = (x[i + 1] - x[i] * x[i], 1.0 - x[i]);
        value += 100.0 * a * a + b * b;
        gradient[i] += -400.0 * a * x[i] - 2.0 * b;
        gradient[i + 1] += 200.0 * a;
    }
    evaluation(value, gradient)
}

/// `Σ 10^(6i/n) (x_i − i)²`: condition number 10⁶.
fn stretched(x: &[f64]) -> Evaluation<()> {
    let weight = |i: usize| 10f64.powf(6.0 * i as f64 / (x.len() - 1) as f64);
    let off = |i: usize| x[i] - i as f64;
    let value = (0..x.len()).map(|i| weight(i) * off(i) * off(i)).sum();
    evaluation(
        value,
        (0..x.len()).map(|i| 2.0 * weight(i) * off(i)).collect(),
    )
}

fn start(optimizer: &Optimizer, x: &[f64], f: fn(&[f64]) -> Evaluation<()>) -> State<()> {
    State::new(optimizer, x.to_vec(), f(x))
}

/// Steps until the method stalls or `steps` are taken; the number of evaluations.
fn descend(
    state: &mut State<()>,
    optimizer: &Optimizer,
    steps: usize,
    f: impl Fn(&[f64]) -> Result<Evaluation<()>, Undefined>,
) -> usize {
    let mut evaluations = 0;
    let mut counted = |x: &[f64]| {
        evaluations += 1;
        f(x)
    };
    for _ in 0..steps {
        let before = state.here.value;
        if state.step(optimizer, &mut counted).expect("a step") == Step::Stalled {
            break;
        }
        if matches!(optimizer, Optimizer::Lbfgs(_)) {
            assert!(state.here.value < before, "never uphill");
        }
    }
    evaluations
}

fn lbfgs() -> Optimizer {
    Optimizer::Lbfgs(Lbfgs {
        longest_step: 10.0,
        ..Lbfgs::default()
    })
}

#[test]
fn lbfgs_finds_the_end_of_rosenbrocks_valley() {
    for n in [2, 10, 40] {
        let x: Vec<f64> = (0..n)
            .map(|i| if i % 2 == 0 { -1.2 } else { 1.0 })
            .collect();
        let mut state = start(&lbfgs(), &x, rosenbrock);
        let evaluations = descend(&mut state, &lbfgs(), 500, |x| Ok(rosenbrock(x)));
        let at_ones = state.x.iter().all(|x| (x - 1.0).abs() < 1e-6);
        // In many dimensions there is a second, local, minimum near (−1, 1, …, 1) of value 4.
        assert!(
            at_ones || state.here.value < 4.0,
            "{n}: {:?} {}",
            state.x,
            state.here.value
        );
        assert!(evaluations < 600, "{n}: {evaluations}");
        if n == 2 {
            assert!(at_ones && evaluations < 80, "{evaluations}");
        }
    }
}

#[test]
fn lbfgs_that_remembers_every_direction_is_not_slowed_by_a_bad_scale() {
    let optimizer = Optimizer::Lbfgs(Lbfgs {
        memory: 24,
        longest_step: 10.0,
        ..Lbfgs::default()
    });
    let mut state = start(&optimizer, &[0.0; 12], stretched);
    let evaluations = descend(&mut state, &optimizer, 300, |x| Ok(stretched(x)));
    for (i, x) in state.x.iter().enumerate() {
        assert!((x - i as f64).abs() < 1e-6, "{i}: {x} {evaluations}");
    }
    // Steepest descent takes some millions.
    assert!(evaluations < 300, "{evaluations}");
}

#[test]
fn steps_are_no_longer_than_the_longest() {
    let optimizer = Optimizer::default();
    let mut state = start(&optimizer, &[-1.2, 1.0, -1.2, 1.0], rosenbrock);
    for _ in 0..60 {
        let before = state.x.clone();
        let mut f = |x: &[f64]| Ok::<_, Undefined>(rosenbrock(x));
        state.step(&optimizer, &mut f).expect("a step");
        let change: Vec<f64> = state.x.iter().zip(&before).map(|(a, b)| a - b).collect();
        assert!(largest(&change) <= 0.5 * (1.0 + 1e-12), "{change:?}");
    }
}

#[test]
fn adam_finds_both_minima_with_a_falling_rate() {
    let optimizer = Optimizer::Adam(Adam {
        rate: 0.05,
        decay: Decay::Cosine { steps: 3000 },
        ..Adam::default()
    });
    let mut state = start(&optimizer, &[-1.2, 1.0], rosenbrock);
    descend(&mut state, &optimizer, 3000, |x| Ok(rosenbrock(x)));
    assert!(state.here.value < 1e-4, "{state:?}");
    let optimizer = Optimizer::Adam(Adam {
        rate: 0.5,
        decay: Decay::Exponential { half_life: 100.0 },
        ..Adam::default()
    });
    let mut state = start(&optimizer, &[0.0; 5], stretched);
    descend(&mut state, &optimizer, 1500, |x| Ok(stretched(x)));
    for (i, x) in state.x.iter().enumerate() {
        assert!((x - i as f64).abs() < 1e-3, "{i}: {x}");
    }
}

/// A function that is defined for `x₀ < limit` alone, or NaN beyond.
fn walled(limit: f64, nan: bool) -> impl Fn(&[f64]) -> Result<Evaluation<()>, Undefined> {
    move |x| match (x[0] < limit, nan) {
        (true, _) => Ok(rosenbrock(x)),
        (false, true) => Ok(evaluation(f64::NAN, vec![f64::NAN; 2])),
        (false, false) => Err(Undefined),
    }
}

#[test]
fn a_wall_is_not_crossed_and_does_not_end_the_run() {
    let adam = Optimizer::Adam(Adam::default());
    for (optimizer, nan) in [
        (lbfgs(), false),
        (lbfgs(), true),
        (adam, false),
        (adam, true),
    ] {
        // The way along the valley, from (−1.2, 1) to (1, 1), ends at the wall.
        let mut state = start(&optimizer, &[-1.2, 1.0], rosenbrock);
        let wall = walled(0.3, nan);
        let mut f = |x: &[f64]| wall(x);
        let mut last = Ok(Step::Moved);
        for _ in 0..3000 {
            last = state.step(&optimizer, &mut f);
            if last != Ok(Step::Moved) {
                break;
            }
        }
        assert!(state.x[0] < 0.3 && state.here.value.is_finite());
        // The least value up to the wall is 0.49, at (0.3, 0.09).
        assert!(state.here.value < 0.6, "{optimizer:?} {last:?} {state:?}");
    }
}

#[test]
fn a_function_without_values_round_the_start_says_so() {
    for optimizer in [lbfgs(), Optimizer::Adam(Adam::default())] {
        let mut state = start(&optimizer, &[-1.2, 1.0], rosenbrock);
        let before = state.clone();
        let mut f = |_: &[f64]| Err::<Evaluation<()>, _>(Undefined);
        assert_eq!(state.step(&optimizer, &mut f), Err(Undefined));
        assert_eq!(state, before);
    }
}

#[test]
fn at_the_minimum_lbfgs_stalls() {
    let mut state = start(&lbfgs(), &[1.0, 1.0], rosenbrock);
    let mut f = |x: &[f64]| Ok::<_, Undefined>(rosenbrock(x));
    assert_eq!(state.step(&lbfgs(), &mut f), Ok(Step::Stalled));
}

#[test]
fn a_kink_at_the_minimum_is_found() {
    // |x| + 2|y|: no gradient at the minimum; pairs are turned down, and steps shortened.
    let kinked = |x: &[f64]| {
        let gradient = vec![x[0].signum(), 2.0 * x[1].signum()];
        Ok(evaluation(x[0].abs() + 2.0 * x[1].abs(), gradient))
    };
    let mut state = State::new(&lbfgs(), vec![3.0, -2.0], evaluation(7.0, vec![1.0, -2.0]));
    descend(&mut state, &lbfgs(), 200, kinked);
    assert!(state.here.value < 0.1, "{state:?}");
}

#[test]
fn a_state_that_was_written_and_read_goes_on_to_the_last_bit() {
    let adam = Optimizer::Adam(Adam {
        decay: Decay::Cosine { steps: 60 },
        ..Adam::default()
    });
    for optimizer in [lbfgs(), adam] {
        let x = [-1.2, 1.0, 0.7, 0.1];
        let mut whole = start(&optimizer, &x, rosenbrock);
        let mut parts = whole.clone();
        descend(&mut whole, &optimizer, 30, |x| Ok(rosenbrock(x)));
        for _ in 0..3 {
            descend(&mut parts, &optimizer, 10, |x| Ok(rosenbrock(x)));
            let text = serde_json::to_string(&parts).expect("JSON");
            parts = serde_json::from_str(&text).expect("JSON");
            assert!(parts.fits(&optimizer, 4) && !parts.fits(&optimizer, 5));
        }
        assert_eq!(whole, parts);
    }
}
