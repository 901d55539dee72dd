//! A surface on a grid of its own: φ is the exact distance to it, whatever the grid of φ, and parts thinner than a cell of
//! φ are there.

use isograd::distance::{Band, Query};
use isograd::orient::Method;
use isograd::{
    Grid, Mesh, Options, Pipeline, PointCloud, Reconstruction, Reconstructor, SurfaceResolution,
};

use crate::common::{TORUS, Uniform};

fn coarse<T: Pipeline>() -> Grid<T> {
    let lower = [-1.213, -1.206, -0.619].map(T::of);
    Grid::new(lower, T::of(0.1), [24, 24, 12]).expect("a grid")
}

fn reconstruct<T: Pipeline>(
    cloud: &PointCloud<T>,
    grid: Grid<T>,
    options: Options,
) -> Reconstruction<T> {
    let mut plan = Reconstructor::new(grid, options.orient(Method::Given)).expect("options");
    plan.reconstruct(cloud).expect("a surface");
    plan.into_reconstruction()
}

/// A plate of half the size `[1, 0.7, thickness/2]` with samples about `spacing` apart and exact normals, turned so that its
/// faces lie in every way between cell centers.
fn plate(thickness: f64, spacing: f64) -> PointCloud<f64> {
    let half = [1.0, 0.7, 0.5 * thickness];
    let mut random = Uniform::new(5);
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let tilted = |[x, y, z]: [f64; 3]| [0.8 * x - 0.6 * z, y, 0.6 * x + 0.8 * z];
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let [na, nb] = [a, b].map(|a| (2.0 * half[a] / spacing).ceil() as usize);
        for side in [-1.0, 1.0] {
            let normal: [f64; 3] = std::array::from_fn(|k| if k == axis { side } else { 0.0 });
            for place in 0..na * nb {
                let mut p = normal.map(|n| n * half[axis]);
                for (k, n, i) in [(a, na, place / nb), (b, nb, place % nb)] {
                    let jitter = 0.6 * (random.next() - 0.5);
                    p[k] = half[k] * (2.0 * (i as f64 + 0.5 + jitter) / n as f64 - 1.0);
                }
                points.push(tilted(p));
                normals.push(tilted(normal));
            }
        }
    }
    let cloud = PointCloud::new(points).expect("finite");
    cloud.with_normals(normals).expect("one each")
}

/// φ at every cell, from the mesh alone.
fn distances<T: Pipeline>(mesh: &Mesh<T>, grid: &Grid<T>) -> Vec<T> {
    let centers: Vec<[T; 3]> = (0..grid.cells())
        .map(|i| grid.center(grid.cell(i)))
        .collect();
    let query = Query::new(mesh.clone()).expect("a mesh");
    let hits = query.query(&centers, None);
    hits.iter().map(|hit| hit.distance).collect()
}

fn assert_exact<T: Pipeline>(factor: f64, tolerance: f64) {
    let cloud = TORUS.uniform::<T>(4000, 3);
    let surface = SurfaceResolution::Factor(factor);
    let result = reconstruct(&cloud, coarse(), Options::default().surface(surface));
    let fine = *result.surface_grid();
    assert!(fine.spacing().f64() <= 0.1 / factor * (1.0 + 1e-6));
    let same = Options::default().surface(SurfaceResolution::Factor(1.0));
    let alone = reconstruct(&cloud, fine, same);
    assert!(result.mesh() == alone.mesh());
    let expected = distances(result.mesh(), result.sdf().grid());
    for (cell, (&phi, &exact)) in result.sdf().values().iter().zip(&expected).enumerate() {
        let error = (phi - exact).f64().abs();
        // Rounding of the cell center, and of the sign at a distance of that size.
        assert!(error < tolerance, "cell {cell}: {phi} for {exact}");
    }
}

#[test]
fn phi_is_the_distance_to_the_surface_of_the_finer_grid() {
    for factor in [1.25, 2.0, 3.0] {
        assert_exact::<f64>(factor, 1e-13);
        assert_exact::<f32>(factor, 3e-7);
    }
}

#[test]
fn cells_beyond_a_narrow_band_have_the_side_of_the_surface() {
    let cloud = TORUS.uniform::<f64>(4000, 3);
    let options = Options::default().surface(SurfaceResolution::Factor(2.0));
    let whole = reconstruct(&cloud, coarse(), options.clone());
    for width in [1e-3, 0.02, 0.1] {
        let band = reconstruct(&cloud, coarse(), options.clone().band(Band::Within(width)));
        let pairs = band.sdf().values().iter().zip(whole.sdf().values());
        for (&phi, &full) in pairs {
            let clamped = full.clamp(-width, width);
            // Where the surface passes within a cell of it, a center beyond the band has the side of χ, interpolated.
            let near = full.abs() < 0.5 * whole.surface_grid().spacing();
            assert!(phi == clamped || near && phi.abs() == width, "{phi} {full}");
        }
    }
}

#[test]
fn plates_thinner_than_a_cell_of_phi_are_whole() {
    let h = 0.1;
    for cells in [2.0, 1.0, 0.5] {
        let thickness = cells * h;
        let cloud = plate(thickness, thickness / 3.0);
        let grid = Grid::new([-1.37, -1.11, -1.23], h, [28, 22, 25]).expect("a grid");
        let surface = SurfaceResolution::Spacing(0.3 * thickness);
        let options = Options::default().surface(surface);
        let result = reconstruct(&cloud, grid, options);
        let measures = &result.report().surface;
        assert_eq!((measures.components, measures.euler), (1, 2), "{cells}");
        let area = 4.0 * (1.0 * 0.7 + (1.0 + 0.7) * 0.5 * thickness) * 2.0;
        println!("{cells} cells thick: area {} of {area}", measures.area);
        // Edges are rounded by about a sample spacing, a third of the thickness.
        assert!((measures.area / area - 1.0).abs() < 0.04, "{cells}");
        let query = Query::new(result.mesh().clone()).expect("a mesh");
        let hits = query.query(cloud.points(), None);
        let off = hits.iter().map(|hit| hit.distance.abs());
        let worst = off.fold(0.0, f64::max);
        println!(
            "{cells} cells thick: samples off by up to {} cells",
            worst / h
        );
        assert!(worst < 0.3 * thickness, "{cells}: {worst}");
    }
}

#[test]
fn an_automatic_surface_follows_the_samples() {
    let fine = |samples: usize| {
        let cloud = TORUS.uniform::<f64>(samples, 3);
        let result = reconstruct(&cloud, coarse(), Options::default());
        let report = result.report().surface_spacing;
        assert_eq!(report, result.surface_grid().spacing());
        result.surface_grid().shape()[0]
    };
    // 0.15, 0.08 and 0.03 apart, on cells of 0.1.
    assert_eq!([300, 1000, 8000].map(fine), [24, 36, 90]);
}

/// A grid of φ that is finer than the samples does not make the surface finer than they are, and parts that are hardly thicker
/// than the distance between samples stay whole.
#[test]
fn a_surface_is_not_finer_than_its_samples() {
    let (thickness, spacing) = (0.15, 0.1);
    let cloud = plate(thickness, spacing);
    for h in [0.021, 0.035, 0.05, 0.08] {
        let cells = [2.9, 2.3, 2.6].map(|side: f64| (side / h).ceil() as usize);
        let grid = Grid::new([-1.44, -1.15, -1.3], h, cells).expect("a grid");
        let result = reconstruct(&cloud, grid, Options::default());
        let in_spacings = result.surface_grid().spacing() / spacing;
        let measures = &result.report().surface;
        println!("{h}: {in_spacings}, {measures:?}");
        assert!((0.6..1.0).contains(&in_spacings), "{h}: {in_spacings}");
        assert_eq!((measures.components, measures.euler), (1, 2), "{h}");
        assert_eq!(result.sdf().values().len(), grid.cells());
        let expected = distances(result.mesh(), &grid);
        for (&phi, &exact) in result.sdf().values().iter().zip(&expected) {
            assert!((phi - exact).abs() < 1e-13, "{phi} for {exact}");
        }
    }
}
