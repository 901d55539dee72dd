//! Walls of the grid and the surfaces of incomplete and half bodies.

use crate::data::PointCloud;
use crate::neighbors::tests::even_sphere;
use crate::orient::Method;
use crate::poisson::Walls;
use crate::{Grid, Options, Reconstruction, Reconstructor, Resolution, Warning};

/// Samples of the unit sphere with `z` below `highest`, and their normals.
fn bowl(highest: f64) -> PointCloud<f64> {
    let mut points = even_sphere(4000);
    points.retain(|p| p[2] < highest);
    let cloud = PointCloud::new(points.clone());
    cloud
        .and_then(|cloud| cloud.with_normals(points))
        .expect("a cloud")
}

fn reconstruct(cloud: &PointCloud<f64>, grid: Grid<f64>, walls: Walls) -> Reconstruction<f64> {
    let options = Options::default().orient(Method::Given).walls(walls);
    let mut plan = Reconstructor::new(grid, options).expect("a plan");
    plan.reconstruct(cloud).expect("reconstructs");
    plan.into_reconstruction()
}

/// Largest distance of a vertex from the unit sphere, in its radius.
fn largest_error(of: &Reconstruction<f64>) -> f64 {
    let distance = |p: &[f64; 3]| (p.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs();
    of.mesh()
        .vertices()
        .iter()
        .map(distance)
        .fold(0.0, f64::max)
}

#[test]
fn surface_of_an_incomplete_body_stays_off_closed_walls() {
    // A cap of a tenth to 45 % of the area is missing.
    for highest in [0.8, 0.4, 0.1] {
        let cloud = bowl(highest);
        let grid = Grid::fit(&cloud, Resolution::Cells(40), 0.1).expect("fits");
        let [free, closed, auto] =
            [Walls::Free, Walls::Closed, Walls::Auto].map(|w| reconstruct(&cloud, grid, w));
        assert_eq!(auto.report().walls, "closed");
        assert_eq!(auto.sdf(), closed.sdf());
        assert!(!closed.report().warnings.contains(&Warning::TouchesWall));
        assert!(closed.report().surface.closed);
        let walls = [&free, &closed].map(|of| of.report().warnings.contains(&Warning::TouchesWall));
        println!(
            "{highest}: {walls:?} {:?}",
            [free, closed].map(|of| largest_error(&of))
        );
    }
}

#[test]
fn half_a_body_passes_through_a_free_wall() {
    // The wall z = 0 is the plane of symmetry; samples within 2 cells of it are missing.
    let grid = Grid::new([-1.5, -1.5, -1.5], 0.05, [60, 60, 30]).expect("valid");
    let cloud = bowl(-0.1);
    let auto = reconstruct(&cloud, grid, Walls::Auto);
    assert_eq!(auto.report().walls, "free");
    assert!(auto.report().warnings.contains(&Warning::TouchesWall));
    assert!(largest_error(&auto) < 0.01, "{}", largest_error(&auto));
    let closed = reconstruct(&cloud, grid, Walls::Closed);
    assert!(!closed.report().warnings.contains(&Warning::TouchesWall));
}
