//! Every warning on a cloud that deserves it, and none on one that does not.

use isograd::orient::doubt::Reason;
use isograd::{Error, Grid, Options, PointCloud, Reconstructor, Report, Resolution, Warning};

use crate::common::{TORUS, Uniform};

fn report(points: Vec<[f64; 3]>, cells: usize) -> Report {
    let cloud = PointCloud::new(points).expect("finite points");
    let grid = Grid::fit(&cloud, Resolution::Cells(cells), 0.1).expect("fits");
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    plan.reconstruct(&cloud)
        .expect("reconstructs")
        .report()
        .clone()
}

/// `n` uniform random points of the unit sphere with `z` above `lowest`, moved and scaled.
fn sphere(n: usize, lowest: f64, center: [f64; 3], radius: f64) -> Vec<[f64; 3]> {
    let mut random = Uniform::new(n as u64);
    let point = |_| {
        let z = lowest + (1.0 - lowest) * random.next();
        let (turn, r) = (std::f64::consts::TAU * random.next(), (1.0 - z * z).sqrt());
        let p = [r * turn.cos(), r * turn.sin(), z];
        std::array::from_fn(|a| center[a] + radius * p[a])
    };
    (0..n).map(point).collect()
}

#[test]
fn a_sound_cloud_has_no_warning() {
    let torus = TORUS.uniform::<f64>(20_000, 11);
    assert_eq!(report(torus.points().to_vec(), 64).warnings, []);
    assert_eq!(report(sphere(10_000, -1.0, [0.0; 3], 1.0), 48).warnings, []);
}

#[test]
fn a_bowl_is_called_open() {
    for lowest in [0.0, -0.8] {
        let warnings = report(sphere(12_000, lowest, [0.0; 3], 1.0), 48).warnings;
        let open = warnings.iter().any(|w| matches!(w, Warning::Open { .. }));
        assert!(open, "rim at z = {lowest}: {warnings:?}");
    }
}

#[test]
fn doubtful_signs_come_with_their_reason_and_a_remedy() {
    // A flat sheet has no inside: every sign is a guess.
    let mut random = Uniform::new(8);
    let mut sheet = || [random.next(), random.next(), 0.0];
    let report = report((0..4_000).map(|_| sheet()).collect(), 48);
    let text = report.warnings.iter().find_map(|warning| match warning {
        Warning::DoubtfulSigns { doubt } => {
            assert_eq!(doubt, &report.doubt);
            assert!(doubt.share_of(Reason::Open) > 0.95, "{doubt:?}");
            Some(warning.to_string())
        }
        _ => None,
    });
    let text = text.expect("a warning");
    for part in [
        "% of the samples: ",
        "open surface; close the gaps, or give",
    ] {
        assert!(text.contains(part), "'{part}' is missing: {text}");
    }
}

#[test]
fn two_balls_are_two_pieces() {
    let mut points = sphere(5_000, -1.0, [-1.5, 0.0, 0.0], 1.0);
    points.extend(sphere(5_000, -1.0, [1.5, 0.0, 0.0], 1.0));
    assert_eq!(
        report(points, 64).warnings,
        [Warning::Components { count: 2 }]
    );
}

#[test]
fn a_plate_of_two_cells_of_the_surface_is_called_thin() {
    let mut random = Uniform::new(4);
    let mut points = Vec::new();
    for _ in 0..20_000 {
        let (x, y) = (2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0);
        points.push([x, y, if random.next() < 0.5 { 0.02 } else { -0.02 }]);
    }
    let warnings = report(points, 64).warnings;
    let thin = warnings.iter().find_map(|w| match w {
        Warning::Thin { share } => Some(*share),
        _ => None,
    });
    assert!(thin.is_some_and(|share| share > 0.5), "{warnings:?}");
}

#[test]
fn few_samples_on_a_fine_grid_are_called_sparse() {
    let warnings = report(sphere(400, -1.0, [0.0; 3], 1.0), 64).warnings;
    let sparse = warnings.iter().any(|w| matches!(w, Warning::Sparse { .. }));
    assert!(sparse, "{warnings:?}");
}

#[test]
fn samples_too_near_to_the_wall_are_refused_with_their_index() {
    let cloud = PointCloud::new(sphere(2_000, -1.0, [0.0; 3], 1.0)).expect("finite points");
    let grid = Grid::from_bounds([-1.2, -1.2, -0.5], [1.2; 3], Resolution::Cells(48));
    let grid = grid.expect("a box with a volume");
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    let message = plan
        .reconstruct(&cloud)
        .err()
        .map(|e| e.to_string())
        .unwrap_or_default();
    assert!(
        message.contains("point ") && message.contains("larger bounds"),
        "{message}"
    );
}

#[test]
fn clouds_that_bound_nothing_are_errors_and_not_panics() {
    let line: Vec<[f64; 3]> = (0..100)
        .map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0])
        .collect();
    let cloud = PointCloud::new(line).expect("finite points");
    let grid = Grid::fit(&cloud, Resolution::Cells(32), 0.1).expect("a line has an extent");
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    assert!(matches!(
        plan.reconstruct(&cloud),
        Err(Error::NoPlane { points: 100 })
    ));

    for n in 0..4 {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][..n].to_vec();
        let cloud = PointCloud::new(points).expect("finite points");
        let error = plan
            .reconstruct(&cloud)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(error.contains(&format!("{n} points")), "{n}: {error}");
    }
    let equal = PointCloud::new(vec![[3.0; 3]; 50]).expect("finite points");
    let error = plan
        .reconstruct(&equal)
        .err()
        .map(|e| e.to_string())
        .unwrap_or_default();
    assert!(error.contains("all 50 points are equal"), "{error}");
}

#[test]
fn distance_from_the_origin_changes_nothing_but_the_last_digits() {
    let near = report(sphere(5_000, -1.0, [0.0; 3], 1.0), 40);
    let far = report(sphere(5_000, -1.0, [1e6, -1e6, 1e6], 1.0), 40);
    // Coordinates of 10⁶ are rounded to 1e-10; the grid's corner moves by as much.
    assert!((near.surface.area - far.surface.area).abs() < 1e-6 * near.surface.area);
    assert!((near.surface.volume - far.surface.volume).abs() < 1e-6 * near.surface.volume);
    assert_eq!(far.warnings, []);
}
