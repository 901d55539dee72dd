//! A permutation of the points changes results by rounding only.

use isograd::{Grid, Options, PointCloud, Reconstruction, Reconstructor, Resolution};
use isograd_shapes::{Density, Layout, Sampling, by_name};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

type Points = Vec<[f64; 3]>;

fn unit(random: &mut Pcg64) -> f64 {
    random.next_u64() as f64 / 2f64.powi(64)
}

fn sampled(name: &str, n: usize, layout: Layout, density: Density) -> Points {
    let sampling = Sampling { layout, density };
    let shape = by_name(name).expect("a shape");
    let samples = shape.sample::<f64>(n, &sampling, 7).expect("samples");
    samples.cloud.points().to_vec()
}

fn random(name: &str, n: usize) -> Points {
    sampled(name, n, Layout::Random, Density::Uniform)
}

fn even(name: &str, n: usize) -> Points {
    sampled(name, n, Layout::Even, Density::Uniform)
}

fn uneven(name: &str, n: usize) -> Points {
    let density = Density::Gradient {
        axis: 0,
        ratio: 10.0,
    };
    sampled(name, n, Layout::Random, density)
}

/// Moves every coordinate by up to `size`.
fn noisy(points: Points, size: f64) -> Points {
    let mut random = Pcg64::seed_from_u64(11);
    let mut moved = |x: f64| x + size * (2.0 * unit(&mut random) - 1.0);
    points.into_iter().map(|p| p.map(&mut moved)).collect()
}

/// Without the points above a share of the extent along x.
fn open(points: Points, share: f64) -> Points {
    let ends = points
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| {
            [l.min(p[0]), h.max(p[0])]
        });
    let limit = ends[0] + share * (ends[1] - ends[0]);
    points.into_iter().filter(|p| p[0] <= limit).collect()
}

fn flattened(points: Points, share: f64) -> Points {
    points
        .into_iter()
        .map(|[x, y, z]| [x, y, share * z])
        .collect()
}

/// Centers of squares on the faces of a cube: many equal coordinates and distances.
fn lattice(n: i32) -> Points {
    let face = |axis: usize, side: f64| {
        let squares =
            (0..n * n).map(move |k| [k / n, k % n].map(|i| (f64::from(i) + 0.5) / f64::from(n)));
        squares.map(move |[u, v]| {
            let mut p = [side, u, v];
            p.rotate_right(axis);
            p
        })
    };
    (0..6)
        .flat_map(|f| face(f % 3, f64::from(u8::from(f > 2))))
        .collect()
}

fn clouds() -> Vec<(&'static str, Points)> {
    let mut doubled = random("fish", 900);
    doubled.extend(doubled.clone().into_iter().step_by(2));
    let mut two = random("sphere", 700);
    two.extend(
        random("torus", 700)
            .iter()
            .map(|p| [p[0] + 3.0, p[1], p[2]]),
    );
    vec![
        ("sphere, 300", random("sphere", 300)),
        ("ellipsoid, 1,025", even("ellipsoid", 1025)),
        ("airliner, 1,025", even("airliner", 1025)),
        ("airliner, random, 1,025", random("airliner", 1025)),
        ("airliner, 5,000", even("airliner", 5000)),
        ("fish, 5,000", random("fish", 5000)),
        ("eel, 1,025", random("eel", 1025)),
        ("torus, 5,000", even("torus", 5000)),
        ("torus, density 10 to 1, 5,000", uneven("torus", 5000)),
        ("fish, density 10 to 1, 2,000", uneven("fish", 2000)),
        ("box, 3,000", random("box", 3000)),
        ("car, 5,000", even("car", 5000)),
        ("knot, 3,000", random("knot", 3000)),
        ("nacelle, 5,000", even("nacelle", 5000)),
        ("vessels, 5,000", random("vessels", 5000)),
        ("noisy sphere, 2,000", noisy(random("sphere", 2000), 0.05)),
        (
            "noisy thin ellipsoid, 1,500",
            noisy(flattened(random("ellipsoid", 1500), 0.2), 0.01),
        ),
        (
            "open sphere, about 1,400",
            open(random("sphere", 2000), 0.7),
        ),
        (
            "thin ellipsoid, 5,000",
            flattened(even("ellipsoid", 5000), 0.1),
        ),
        ("equal points among others, 1,350", doubled),
        ("two bodies, 1,400", two),
        ("lattice on a cube, 1,350", lattice(15)),
    ]
}

/// Input index of each point of a random order.
fn permutation(n: usize, seed: u64) -> Vec<usize> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, (unit(&mut random) * (i + 1) as f64) as usize);
    }
    order
}

fn reconstructed(points: Points) -> Reconstruction<f64> {
    let cloud = PointCloud::new(points).expect("finite points");
    let grid = Grid::fit(&cloud, Resolution::Cells(40), 0.1).expect("a grid");
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    plan.reconstruct(&cloud).expect("reconstructs");
    plan.into_reconstruction()
}

fn largest(differences: impl Iterator<Item = f64>) -> f64 {
    differences.fold(0.0, |most, x| most.max(x.abs()))
}

#[test]
fn a_permutation_of_the_points_changes_rounding_only() {
    for (seed, (name, points)) in (1..).zip(clouds()) {
        let order = permutation(points.len(), seed);
        let permuted = order.iter().map(|&i| points[i]).collect();
        let (a, b) = (reconstructed(points), reconstructed(permuted));
        let name = format!("{name}, seed {seed}");
        assert_eq!(a.report().radius, b.report().radius, "{name}: radius");
        let normals = order.iter().zip(b.normals()).flat_map(|(&i, n)| {
            let before = a.normals()[i];
            [0, 1, 2].map(|k| n[k] - before[k])
        });
        let normals = largest(normals);
        let h = a.sdf().grid().spacing();
        let values = a.sdf().values().iter().zip(b.sdf().values());
        let phi = largest(values.map(|(a, b)| (a - b) / h));
        let (area, other) = (a.report().surface.area, b.report().surface.area);
        let area = other / area - 1.0;
        // Sums in another order: some thousand units of rounding, 2e-16, for the sums over neighbors and the solve. A
        // sign or a neighborhood that differs makes 1e-3 and more.
        assert!(normals < 1e-12, "{name}: normals differ by {normals:e}");
        assert!(phi < 1e-11, "{name}: φ differs by {phi:e} cells");
        assert!(area.abs() < 1e-12, "{name}: areas differ by {area:e}");
    }
}
