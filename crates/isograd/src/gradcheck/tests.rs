use super::*;
use crate::neighbors::tests::torus;

fn cloud() -> PointCloud<f64> {
    PointCloud::new(torus(8000, 5).iter().map(|s| s.0).collect()).expect("finite")
}

fn grid() -> Grid<f64> {
    Grid::new([-1.213, -1.206, -0.619], 2.4 / 32.0, [32, 32, 16]).expect("a grid")
}

#[test]
fn pullback_agrees_with_small_steps_and_nearly_with_large_ones() {
    let check = gradcheck(&cloud(), grid(), &Options::default(), &mut |_| ()).expect("a torus");
    for row in &check.rows {
        assert!(row.small.is_smooth(), "{row:?}");
        let error = (row.pullback - row.small.value).abs();
        assert!(
            error < 1e-6 * row.pullback.abs().max(1e-2 * row.scale),
            "{row:?}"
        );
        // Half a cell of noise at every point is no small step: normals turn by tens of degrees. And a
        // torus does not feel it where it turns around its own axis.
        let smooth = row.motion != Motion::Noise && row.motion != Motion::Rotation(2);
        // As the surface passes the cell centers, its place between them wobbles by a hundredth of a cell.
        assert!(!smooth || (row.large_ratio() - 1.0).abs() < 0.05, "{row:?}");
    }
    assert_eq!(check.guarded, 0);
}

#[test]
fn half_cells_are_named_until_the_surface_is_marched_on_them() {
    let half_cells = |reconstruction: crate::Options| {
        let options = Options {
            reconstruction,
            motions: Vec::new(),
            ..Options::default()
        };
        let check = gradcheck(&cloud(), grid(), &options, &mut |_| ());
        check.expect("a torus").half_cells
    };
    let thin = crate::Options::default();
    let size = half_cells(thin.clone()).expect("whole cells");
    assert_eq!(
        half_cells(thin.clone().surface(SurfaceResolution::Spacing(size))),
        None
    );
    assert_eq!(
        half_cells(thin.level(crate::isosurface::Level::Local)),
        None
    );
}

#[test]
fn a_wrong_pullback_would_be_seen() {
    let cloud = cloud();
    let options = Options {
        motions: vec![Motion::Noise],
        ..Options::default()
    };
    let check = gradcheck(&cloud, grid(), &options, &mut |_| ()).expect("a torus");
    let noise = check.rows[0];
    // The paper's weights have another derivative: the same functional, another number.
    let paper = Options {
        reconstruction: crate::Options::default()
            .splat(crate::splat::Weights::Paper)
            // Smaller cells have smaller jumps.
            .surface(crate::SurfaceResolution::Factor(2.0))
            // It would mend what the weights do.
            .level(crate::isosurface::Level::Mean)
            .smoothing(crate::poisson::Smoothing::Cells(0.0)),
        motions: vec![Motion::Growth, Motion::Noise],
        ..options
    };
    let other = gradcheck(&cloud, grid(), &paper, &mut |_| ()).expect("a torus");
    assert!((other.rows[1].pullback / noise.small.value - 1.0).abs() > 1e-3);
    // And they jump at the faces of cells, which the derivative does not know.
    assert!(
        (other.rows[0].small_ratio() - 1.0).abs() < 1e-6,
        "{other:?}"
    );
    assert!(
        (other.rows[0].large_ratio() - 1.0).abs() > 0.05,
        "{other:?}"
    );
}

#[test]
fn directions_are_of_unit_length_and_different() {
    let points = cloud().points().to_vec();
    let all = Motion::ALL.map(|motion| motion.direction(&points, 3));
    for (a, motion) in all.iter().zip(Motion::ALL) {
        let longest = a
            .iter()
            .fold(0.0, |m: f64, &v| m.max(crate::vector::norm(v)));
        assert!((longest - 1.0).abs() < 1e-12, "{motion:?}");
        assert_eq!(all.iter().filter(|b| *b == a).count(), 1, "{motion:?}");
    }
}

#[test]
fn bad_steps_and_grids_are_refused_with_a_reason() {
    let refused = |grid, step| {
        let options = Options {
            step,
            ..Options::default()
        };
        let result = gradcheck(&cloud(), grid, &options, &mut |_| ());
        result.expect_err("refused").to_string()
    };
    assert!(refused(grid(), 0.0).contains("positive"));
    assert!(refused(grid(), f64::NAN).contains("positive"));
    assert!(refused(grid(), 9.0).contains("moved by 9 cells"));
}
