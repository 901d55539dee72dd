//! Pullback of the whole pipeline: against finite differences, and against closed forms.

use std::f64::consts::PI;

use isograd::gradcheck::{Motion, Options, gradcheck};
use isograd::isosurface::measure_pullback;
use isograd::{Cotangent, Grid, PointCloud, Reconstructor, Resolution};
use isograd_shapes::Sampling;

use super::{RANDOM, shape};

fn cloud(name: &str, n: usize) -> PointCloud<f64> {
    let samples = shape(name).sample::<f64>(n, &RANDOM, 3).expect("samples");
    PointCloud::new(samples.cloud.points().to_vec()).expect("finite")
}

#[test]
fn whole_pullback_is_the_transpose_of_the_derivative() {
    for (name, n, cells) in [
        ("torus", 3000, 32),
        ("fish", 4000, 64),
        ("airliner", 6000, 64),
    ] {
        let cloud = cloud(name, n);
        let grid = Grid::fit(&cloud, Resolution::Cells(cells), 0.1).expect("a grid");
        // Shifted, so that the planes of symmetry of the bodies do not pass through cell centers, where the
        // derivative is one-sided.
        let shift = [0.137, -0.211, 0.071].map(|s| s * grid.spacing());
        let lower = std::array::from_fn(|a| grid.lower()[a] + shift[a]);
        let grid = Grid::new(lower, grid.spacing(), grid.shape()).expect("a grid");
        let options = Options {
            motions: vec![
                Motion::Noise,
                Motion::Waves,
                Motion::Growth,
                Motion::Bending,
            ],
            ..Options::default()
        };
        let check = gradcheck(&cloud, grid, &options, &mut |_| ()).expect("a body");
        for row in check.rows {
            println!(
                "{name}, {}: off by {:.1e} at {:e} cells; over ±½ cell {:.4}",
                row.motion.name(),
                row.small_ratio() - 1.0,
                row.small.step,
                row.large_ratio()
            );
            assert!(row.small.is_smooth(), "{name}: {row:?}");
            // Where the axis is nearly as good as another, noise changes the slope within a thousandth of a cell; and its
            // derivative is a sum of thousands of terms of either sign, which may nearly cancel.
            let (limit, least) = match row.motion {
                Motion::Noise => (1e-5, 0.2 * row.scale),
                _ => (1e-6, 0.0),
            };
            let error = (row.pullback - row.small.value).abs() / row.pullback.abs().max(least);
            assert!(error < limit, "{name}: {row:?}");
        }
    }
}

/// Relative errors of `d(area)/dr = 8πr`, `d(volume)/dr = 4πr²` and mean `dφ/dr = −1` of a sphere whose center
/// is `shift` cells from that of the grid.
fn sphere_errors(cells: usize, shift: [f64; 3]) -> [f64; 3] {
    let radius = 0.5;
    // The number of samples per cell is the same on every grid.
    let samples = shape("sphere").sample::<f64>(cells * cells * 4, &Sampling::default(), 1);
    let points = samples.expect("samples").cloud.points().to_vec();
    let outward: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| x / radius)).collect();
    let cloud = PointCloud::new(points).expect("finite");
    let h = 1.25 / cells as f64;
    let lower = shift.map(|s| h * s - 0.625);
    let grid = Grid::new(lower, h, [cells; 3]).expect("a grid");
    // On a surface as fine as the samples the error of these few is larger than that of the cells.
    let options = isograd::Options::default().surface(isograd::SurfaceResolution::Grid);
    let mut plan = Reconstructor::new(grid, options).expect("options");
    let result = plan.reconstruct(&cloud).expect("a sphere");
    let derivative = |cotangent: &Cotangent<'_, f64>| -> f64 {
        let pulled = result.pullback(cotangent).expect("a pullback");
        let pairs = pulled.points.iter().zip(&outward);
        pairs
            .map(|(a, b)| isograd_element::vector::dot(*a, *b))
            .sum()
    };
    let of_measure = |area: f64, volume: f64| {
        let mut vertices = Vec::new();
        measure_pullback(result.mesh(), area, volume, &mut vertices);
        derivative(&Cotangent {
            vertices: Some(&vertices),
            ..Cotangent::default()
        })
    };
    let mean = vec![1.0 / grid.cells() as f64; grid.cells()];
    let of_phi = derivative(&Cotangent {
        sdf: Some(&mean),
        ..Cotangent::default()
    });
    [
        of_measure(1.0, 0.0) / (8.0 * PI * radius) - 1.0,
        of_measure(0.0, 1.0) / (4.0 * PI * radius * radius) - 1.0,
        of_phi / -1.0 - 1.0,
    ]
}

#[test]
fn a_growing_sphere_follows_its_closed_forms_and_converges() {
    // Errors depend on the position of the surface between cell centers: average over several shifts.
    let shifts = [
        [0.0; 3],
        [0.3, 0.1, 0.4],
        [0.5, 0.25, 0.05],
        [0.15, 0.35, 0.2],
    ];
    let mean = [32, 64, 96].map(|cells| {
        let mut sums = [0.0f64; 3];
        for shift in shifts {
            let errors = sphere_errors(cells, shift);
            println!("{cells} cells, {shift:?}: area, volume, φ off by {errors:.5?}");
            for (sum, error) in sums.iter_mut().zip(errors) {
                assert!(
                    cells < 64 || error.abs() < 0.01,
                    "{cells}, {shift:?}: {errors:?}"
                );
                *sum += error.abs() / shifts.len() as f64;
            }
        }
        sums
    });
    println!("means: {mean:.5?}");
    let [coarse, _, fine] = mean;
    // The error of the area is too small for a clear trend.
    assert!(mean.iter().all(|errors| errors[0] < 2e-3), "{mean:?}");
    assert!(
        fine[1] < 0.8 * coarse[1] && fine[2] < 0.8 * coarse[2],
        "{mean:?}"
    );
}
