//! Trimmed surfaces and sheets, beside closed forms and finite differences.

use crate::data::PointCloud;
use crate::isosurface::trim::Trim;
use crate::neighbors::tests::even_sphere;
use crate::orient::Method;
use crate::sheet::Sheet;
use crate::testing::noise;
use crate::{Cotangent, Error, Grid, Options, Reconstruction, Reconstructor, Saved, vector};

/// Samples of the unit sphere above `z = 0`, and their normals.
fn half_sphere(count: usize) -> PointCloud<f64> {
    let mut points = even_sphere(2 * count);
    points.retain(|p| p[2] > 0.0);
    let cloud = PointCloud::new(points.clone());
    cloud
        .and_then(|cloud| cloud.with_normals(points))
        .expect("a cloud")
}

/// Samples of the square `|x|, |y| < 1` at `z = 0`, with their normals.
fn square(side: usize) -> PointCloud<f64> {
    let mut next = noise(3);
    let mut points = Vec::new();
    for i in 0..side {
        for j in 0..side {
            let at = |k: usize, moved: f64| {
                (2 * k + 1) as f64 / side as f64 - 1.0 + 0.2 * moved / side as f64
            };
            points.push([at(i, next()), at(j, next()), 0.0]);
        }
    }
    let normals = vec![[0.0, 0.0, 1.0]; points.len()];
    PointCloud::new(points)
        .and_then(|cloud| cloud.with_normals(normals))
        .expect("a cloud")
}

fn grid() -> Grid<f64> {
    Grid::new([-1.6, -1.6, -1.2], 0.1, [32, 32, 30]).expect("valid")
}

fn reconstruct(cloud: &PointCloud<f64>, options: Options) -> Reconstruction<f64> {
    let mut plan = Reconstructor::new(grid(), options).expect("a plan");
    plan.reconstruct(cloud).expect("reconstructs");
    plan.into_reconstruction()
}

/// Largest error of φ among the cells that `expected` has a value for.
fn largest_error(of: &Reconstruction<f64>, expected: impl Fn([f64; 3]) -> Option<f64>) -> f64 {
    let (grid, phi) = (of.sdf().grid(), of.sdf().values());
    let error = |i: usize| expected(grid.center(grid.cell(i))).map(|e| (phi[i] - e).abs());
    let errors: Vec<f64> = (0..phi.len()).filter_map(error).collect();
    assert!(errors.len() > 1000, "{}", errors.len());
    errors.into_iter().fold(0.0, f64::max)
}

#[test]
fn trimmed_mesh_ends_near_the_samples_and_phi_is_as_before() {
    let cloud = half_sphere(2000);
    let options = Options::default().orient(Method::Given);
    let whole = reconstruct(&cloud, options.clone());
    let found = reconstruct(&cloud, options.clone().trim(Trim::Distance(0.15)));
    assert_eq!(found.sdf(), whole.sdf());
    assert_eq!(found.closest(), whole.closest());
    assert_eq!(found.closest_mesh(), whole.mesh());
    let (distance, removed) = found.report().trim.expect("trimmed");
    assert_eq!(distance, 0.15);
    assert_eq!(
        removed,
        whole.mesh().faces().len() - found.mesh().faces().len()
    );
    assert!(removed > 100 && !found.report().surface.closed);
    assert!(found.mesh().vertices().iter().all(|p| p[2] > -0.16));
    // Half the sphere, and a strip of the width of the distance at most.
    let area = found.report().surface.area / std::f64::consts::TAU;
    assert!((0.97..1.16).contains(&area), "{area}");
    let auto = reconstruct(&cloud, options.trim(Trim::Auto));
    let spacing = (std::f64::consts::TAU / 2000.0).sqrt();
    let (distance, _) = auto.report().trim.expect("trimmed");
    assert!((distance / spacing / 4.0 - 1.0).abs() < 0.2, "{distance}");
}

#[test]
fn sheets_have_the_distance_of_closed_forms_and_closed_shells() {
    let thickness = 0.3;
    let sheet = Options::default().sheet(Sheet::Thickness(thickness));
    for method in [Method::Given, Method::Auto] {
        let options = sheet.clone().orient(method).trim(Trim::Distance(0.15));
        let plate = reconstruct(&square(50), options.clone());
        // Away from the rim, which lies within the distance of the trim.
        let error = largest_error(&plate, |p| {
            (p[0].abs() < 0.8 && p[1].abs() < 0.8 && p[2].abs() < 0.2)
                .then_some(p[2].abs() - 0.5 * thickness)
        });
        // In cells of 0.1.
        assert!(error < 0.01, "plate: {error}");
        let beyond = |p: [f64; 3]| {
            let over = |x: f64, half: f64| (x.abs() - half).max(0.0);
            let to = |half: f64| vector::norm([over(p[0], half), over(p[1], half), p[2]]);
            [to(1.15), to(1.0)].map(|d| d - 0.5 * thickness)
        };
        let (at, phi) = (plate.sdf().grid(), plate.sdf().values());
        for (i, &phi) in phi.iter().enumerate() {
            let [low, high] = beyond(at.center(at.cell(i)));
            assert!(
                (low - 0.02..high + 0.06).contains(&phi),
                "{low} {phi} {high}"
            );
        }
        assert!(plate.report().surface.closed && plate.report().surface.components == 1);
        let volume = plate.report().surface.volume;
        // From the plate with its round rim to that of a plate that is wider by the distance of the trim.
        assert!((1.2..2.1).contains(&volume), "{volume}");

        let dome = reconstruct(&half_sphere(2500), options);
        let error = largest_error(&dome, |p| {
            let r = vector::norm(p);
            (p[2] > 0.5 * r && (0.8..1.2).contains(&r)).then_some((r - 1.0).abs() - 0.5 * thickness)
        });
        assert!(error < 0.01, "dome: {error}");
        assert!(dome.report().surface.closed);
        assert!(
            !dome
                .report()
                .warnings
                .iter()
                .any(|w| w.to_string().contains("wall"))
        );
    }
}

#[test]
fn pullback_of_sheets_and_trimmed_meshes_agrees_with_differences() {
    let cloud = half_sphere(500);
    let mut next = noise(5);
    let direction: Vec<[f64; 3]> = cloud
        .points()
        .iter()
        .map(|p| {
            let wave = (2.0 * p[0] + 3.0 * p[1]).sin();
            [0.3 * wave, 0.5 * p[2], 0.7 + wave + 0.1 * next()]
        })
        .collect();
    let base = Options::default()
        .orient(Method::Given)
        .trim(Trim::Distance(0.4));
    for options in [base.clone(), base.sheet(Sheet::Thickness(0.35))] {
        let held = reconstruct(&cloud, options.clone());
        let cells = held.sdf().grid().cells();
        let wave = |k: usize| (0.37 * k as f64).sin();
        // φ within three cells; the medial axis of the sheet is further away.
        let near = |k: usize| held.sdf().values()[k].abs() < 0.12;
        let sdf: Vec<f64> = (0..cells)
            .map(|k| if near(k) { wave(k) } else { 0.0 })
            .collect();
        let vertices: Vec<[f64; 3]> = (0..held.mesh().vertices().len())
            .map(|k| [wave(k), wave(k + 1), wave(k + 2)])
            .collect();
        for (sdf, vertices) in [(Some(&sdf), None), (None, Some(&vertices))] {
            let cotangent = Cotangent {
                sdf: sdf.map(|s| &s[..]),
                vertices: vertices.map(|v: &Vec<[f64; 3]>| &v[..]),
                ..Cotangent::default()
            };
            let pulled = held.pullback(&cotangent).expect("pulls back").points;
            let slope: f64 = pulled
                .iter()
                .zip(&direction)
                .map(|(a, b)| vector::dot(*a, *b))
                .sum();
            let loss = |step: f64| {
                let moved =
                    |(p, v): (&[f64; 3], &[f64; 3])| vector::add(*p, vector::scale(*v, step));
                let points = cloud.points().iter().zip(&direction).map(moved).collect();
                let moved = PointCloud::new(points).expect("finite");
                let moved = moved
                    .with_normals(cloud.points().to_vec())
                    .expect("normals");
                let mut plan = Reconstructor::new(grid(), options.clone()).expect("a plan");
                let of = plan.reconstruct_held(&moved, &held).expect("reconstructs");
                assert_eq!(of.mesh().faces().len(), held.mesh().faces().len());
                let dots = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
                    a.iter().zip(b).map(|(a, b)| vector::dot(*a, *b)).sum()
                };
                sdf.map_or(0.0, |s| {
                    s.iter().zip(of.sdf().values()).map(|(a, b)| a * b).sum()
                }) + vertices.map_or(0.0, |v| dots(v, of.mesh().vertices()))
            };
            let step = 1e-7;
            let difference = (loss(step) - loss(-step)) / (2.0 * step);
            let error = (slope / difference - 1.0).abs();
            // A few cells change their closest feature within the step.
            assert!(error < 1e-4, "{slope} {difference}");
        }
    }
}

#[test]
fn restored_sheets_have_the_same_mesh_and_gradients() {
    let cloud = half_sphere(800);
    let options = Options::default()
        .orient(Method::Given)
        .sheet(Sheet::Thickness(0.3));
    let result = reconstruct(&cloud, options.clone());
    let saved = Saved {
        sdf: result.sdf().values(),
        closest: result.closest(),
        normals: result.normals(),
    };
    let mut plan = Reconstructor::new(grid(), options).expect("a plan");
    let restored = plan.restore(&cloud, &saved).expect("restores");
    assert_eq!(restored.mesh(), result.mesh());
    let bar = vec![1.0; grid().cells()];
    let cotangent = Cotangent {
        sdf: Some(&bar),
        ..Cotangent::default()
    };
    assert_eq!(
        restored.pullback(&cotangent).expect("pulls"),
        result.pullback(&cotangent).expect("pulls")
    );
}

#[test]
fn bad_trims_and_sheets_are_errors() {
    let refused = |options: Options| match Reconstructor::<f64>::new(grid(), options) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("accepted"),
    };
    let default = Options::default;
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(default().trim(Trim::Distance(bad))).contains("the trim is"));
        assert!(refused(default().sheet(Sheet::Thickness(bad))).contains("the sheet is"));
    }
    let cloud = half_sphere(300);
    let given = default().orient(Method::Given);
    let result = |options| {
        let mut plan = Reconstructor::new(grid(), options).expect("a plan");
        plan.reconstruct(&cloud).map(|_| ()).expect_err("an error")
    };
    let error = result(given.clone().trim(Trim::Distance(1e-9)));
    assert!(matches!(error, Error::Trimmed { .. }), "{error}");
    let error = result(given.sheet(Sheet::Thickness(1e-9)));
    assert!(
        error.to_string().contains("2 cells of the surface"),
        "{error}"
    );
}
