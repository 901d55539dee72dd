//! Every warning on a cloud that deserves it, and none on one that does not.

use isograd::clean;
use isograd::isosurface::Level;
use isograd::isosurface::trim::Trim;
use isograd::orient::Method;
use isograd::orient::doubt::Reason;
use isograd::{
    Error, Grid, Options, Outliers, PointCloud, Reconstructor, Report, Resolution,
    SurfaceResolution, Verdict, Warning,
};

use crate::common::{TORUS, Uniform};

fn report(points: Vec<[f64; 3]>, cells: usize) -> Report {
    let cloud = PointCloud::new(points).expect("finite points");
    report_with(&cloud, cells, Options::default())
}

fn report_with(cloud: &PointCloud<f64>, cells: usize, options: Options) -> Report {
    let resolution = Resolution::Cells(cells);
    let grid = Grid::fit_with(cloud, resolution, 0.1, options.outliers).expect("fits");
    let mut plan = Reconstructor::new(grid, options).expect("valid options");
    plan.reconstruct(cloud)
        .expect("reconstructs")
        .report()
        .clone()
}

fn codes(report: &Report) -> Vec<&'static str> {
    report.reasons().into_iter().map(Warning::code).collect()
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
    let reports = [
        report(torus.points().to_vec(), 64),
        report(sphere(10_000, -1.0, [0.0; 3], 1.0), 48),
    ];
    for report in reports {
        assert_eq!(report.warnings, []);
        assert_eq!(report.verdict(), Some(Verdict::Good));
        assert_eq!(report.conclusion(), "good");
    }
}

#[test]
fn samples_in_mid_air_are_named_and_those_of_a_sparse_part_are_not() {
    let mut random = Uniform::new(8);
    let mut body = sphere(10_000, -1.0, [0.0; 3], 1.0);
    let in_mid_air: Vec<[f64; 3]> = (0..400)
        .map(|_| std::array::from_fn(|_| 4.0 * random.next() - 2.0))
        .collect();
    let cloud = [&body[..], &in_mid_air].concat();
    let kept = PointCloud::new(cloud.clone()).expect("finite points");
    let with = report_with(&kept, 48, Options::default().outliers(Outliers::Keep));
    assert_eq!(codes(&with).first(), Some(&"stray"), "{with:?}");
    assert_eq!(with.verdict(), Some(Verdict::Bad));
    // By default they are left out, but for those near the surface.
    let default = report(cloud.clone(), 48);
    assert_eq!(codes(&default), ["outliers"]);
    assert!(default.outliers.len() > 300 && default.outliers[0] >= 10_000);
    let statistical = Some(clean::Statistical {
        neighbors: 16,
        ratio: 2.0,
    });
    let options = clean::Options {
        statistical,
        ..clean::Options::default()
    };
    let cleaned = (0..2).fold(cloud, |cloud, _| {
        let kept = clean::clean(&cloud, &options).expect("options").kept;
        kept.iter().map(|&i| cloud[i as usize]).collect()
    });
    let without = report(cleaned, 48);
    assert!(!codes(&without).contains(&"stray"), "{without:?}");
    // One half of the sphere has a hundredth of the samples of the other.
    body.retain(|p| p[2] > 0.0 || random.next() < 0.01);
    let sparse = report(body, 48);
    assert!(!codes(&sparse).contains(&"stray"), "{sparse:?}");
}

#[test]
fn without_checks_there_is_no_verdict() {
    let cloud = PointCloud::new(sphere(2_000, -1.0, [0.0; 3], 1.0)).expect("finite points");
    let report = report_with(&cloud, 24, Options::default().checks(false));
    assert_eq!((report.verdict(), &report.warnings[..]), (None, &[][..]));
    assert_eq!(report.conclusion(), "not checked");
}

#[test]
fn normals_that_point_inward_give_a_surface_inside_out() {
    let points = sphere(4_000, -1.0, [0.0; 3], 1.0);
    let inward = points.iter().map(|p| p.map(|x| -x)).collect();
    let cloud = PointCloud::new(points).and_then(|cloud| cloud.with_normals(inward));
    let options = Options::default().orient(Method::Given);
    let report = report_with(&cloud.expect("a cloud"), 32, options);
    assert_eq!(codes(&report).first(), Some(&"inside-out"));
    assert_eq!(report.verdict(), Some(Verdict::Bad));
    assert!(report.conclusion().contains("--orient auto"), "{report:?}");
}

#[test]
fn a_plate_much_thinner_than_a_cell_is_missed() {
    let mut random = Uniform::new(6);
    let mut points = sphere(6_000, -1.0, [0.0; 3], 0.5);
    for _ in 0..10_000 {
        let (x, y) = (0.4 + 1.6 * random.next(), random.next() - 0.5);
        points.push([x, y, if random.next() < 0.5 { 0.004 } else { -0.004 }]);
    }
    let cloud = PointCloud::new(points).expect("finite points");
    let report = report_with(&cloud, 32, Options::default().level(Level::Mean));
    let far = report.warnings.iter().find_map(|warning| match warning {
        Warning::Missed { far, .. } => Some(*far),
        _ => None,
    });
    assert!(far > Some(0.1), "{report:?}");
    assert_eq!(report.verdict(), Some(Verdict::Bad));
    assert!(report.conclusion().contains("level=\"thin\""), "{report:?}");
}

#[test]
fn copies_of_samples_are_named_where_they_do_harm() {
    let once = sphere(3000, -1.0, [0.0; 3], 1.0);
    let copies: Vec<[f64; 3]> = (0..4).flat_map(|_| once.clone()).collect();
    let spoilt = report(copies.clone(), 32);
    let named = |warning: &Warning| match warning {
        Warning::Duplicates { samples } => (8900..=9000).contains(samples),
        _ => false,
    };
    assert!(spoilt.warnings.iter().any(named), "{spoilt:?}");
    let kept = clean::duplicates(&copies, 0.0).expect("valid");
    let kept = kept.into_iter().map(|i| copies[i as usize]).collect();
    assert_eq!(report(kept, 32).warnings, []);
}

#[test]
fn normals_that_contradict_each_other_are_named() {
    let torus = TORUS.uniform::<f64>(10_000, 7);
    let normals = torus.normals().expect("normals");
    for (one_in, verdict) in [(40, Verdict::Check), (3, Verdict::Bad)] {
        let turned = normals.iter().enumerate();
        let turned = turned.map(|(i, &n)| if i % one_in == 0 { n.map(|x| -x) } else { n });
        let cloud = PointCloud::new(torus.points().to_vec()).expect("finite points");
        let cloud = cloud.with_normals(turned.collect()).expect("one a point");
        let report = report_with(&cloud, 64, Options::default().orient(Method::Given));
        let share = report.warnings.iter().find_map(|warning| match warning {
            Warning::Turned { share } => Some(*share),
            _ => None,
        });
        let share = share.expect("a warning");
        assert!((share * one_in as f64 - 1.0).abs() < 0.1, "{share}");
        assert_eq!(report.verdict(), Some(verdict));
    }
}

#[test]
fn a_bowl_is_called_open() {
    for lowest in [0.0, -0.8] {
        let report = report(sphere(12_000, lowest, [0.0; 3], 1.0), 48);
        assert!(
            codes(&report).contains(&"open"),
            "rim at {lowest}: {report:?}"
        );
        assert_eq!(report.verdict(), Some(Verdict::Bad));
    }
    // Also a small one beside a large body.
    let mut points = sphere(40_000, -1.0, [0.0; 3], 1.0);
    points.extend(sphere(300, 0.0, [2.0, 0.0, 0.0], 0.3));
    let report = report(points, 48);
    assert!(report.guessed > 0.02, "{}", report.guessed);
    assert_eq!(report.verdict(), Some(Verdict::Bad));
}

#[test]
fn sparse_parts_of_a_closed_cloud_are_no_holes_but_holes_in_them_are() {
    // A hundred times as dense at the bottom as at the top.
    let mut random = Uniform::new(5);
    let mut points = sphere(60_000, -1.0, [0.0; 3], 1.0);
    points.retain(|p| random.next() < 0.01f64.powf(0.5 * (p[2] + 1.0)));
    let trimmed = Options::default().trim(Trim::Auto);
    let cloud = PointCloud::new(points.clone()).expect("finite points");
    let whole = report_with(&cloud, 64, trimmed.clone());
    assert_eq!(codes(&whole), Vec::<&str>::new(), "{whole:?}");
    assert!(whole.guessed < 1e-3, "{}", whole.guessed);
    assert_eq!(whole.trim.expect("trimmed").1, 0);
    // Without the top: a hole 1.7 across, twenty distances between the samples around it.
    points.retain(|p| p[2] < 0.5);
    let cloud = PointCloud::new(points).expect("finite points");
    let open = report_with(&cloud, 64, trimmed);
    assert!(open.guessed > 0.02, "{}", open.guessed);
    assert!(open.trim.expect("trimmed").1 > 0);
    assert_eq!(open.verdict(), Some(Verdict::Bad));
}

#[test]
fn doubtful_signs_come_with_their_reason_and_a_remedy() {
    // A flat sheet has no inside: every sign is a guess.
    let mut random = Uniform::new(8);
    let mut sheet = || [random.next(), random.next(), 0.0];
    let report = report((0..4_000).map(|_| sheet()).collect(), 48);
    let text = report.warnings.iter().find_map(|warning| match warning {
        Warning::DoubtfulSigns { doubt, .. } => {
            assert_eq!(doubt, &report.doubt);
            assert!(doubt.share_of(Reason::Open) > 0.95, "{doubt:?}");
            Some((warning.to_string(), warning.remedy(report.level)))
        }
        _ => None,
    });
    let (text, remedy) = text.expect("a warning");
    for part in ["% of the samples: ", "open surface"] {
        assert!(text.contains(part), "'{part}' is missing: {text}");
    }
    assert!(remedy.starts_with("close the gaps, or give"), "{remedy}");
}

#[test]
fn two_balls_are_two_pieces_and_no_fragments() {
    let mut points = sphere(5_000, -1.0, [-1.5, 0.0, 0.0], 1.0);
    points.extend(sphere(5_000, -1.0, [1.5, 0.0, 0.0], 1.0));
    let report = report(points, 64);
    assert_eq!((report.surface.components, codes(&report)), (2, vec![]));
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
fn few_samples_on_a_fine_surface_are_called_sparse() {
    let cloud = PointCloud::new(sphere(400, -1.0, [0.0; 3], 1.0)).expect("finite points");
    for (surface, is_sparse) in [
        (SurfaceResolution::Grid, true),
        (SurfaceResolution::Auto, false),
    ] {
        let warnings = report_with(&cloud, 64, Options::default().surface(surface)).warnings;
        let found = warnings.iter().any(|w| matches!(w, Warning::Sparse { .. }));
        assert_eq!(found, is_sparse, "{surface:?}: {warnings:?}");
    }
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
