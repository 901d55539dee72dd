//! The indicator and the distance are continuous in the points: one sample moves along the surface, through the
//! neighborhoods of others, and what they change by in one step is ever less in ever smaller ones.

use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::orient::Method;
use isograd::{Grid, Options, PointCloud, Reconstruction, Reconstructor, SurfaceResolution};

use crate::common::{TORUS, Uniform};

/// A torus of 400 samples, one of which is moved.
struct Line {
    cloud: PointCloud<f64>,
    moving: usize,
    direction: [f64; 3],
    plan: Reconstructor<f64>,
    values: fn(&Reconstruction<f64>) -> Vec<f64>,
}

/// The indicator, relative to its level at the surface.
fn indicator(result: &Reconstruction<f64>) -> Vec<f64> {
    let values = result.indicator().values().iter();
    values.map(|chi| chi - result.iso_value()).collect()
}

fn distance(result: &Reconstruction<f64>) -> Vec<f64> {
    result.sdf().values().to_vec()
}

impl Line {
    fn new(seed: u64, options: &Options, values: fn(&Reconstruction<f64>) -> Vec<f64>) -> Self {
        let grid = Grid::new([-1.23, -1.21, -0.62], 0.1, [25, 25, 13]).expect("a grid");
        let cloud = TORUS.uniform::<f64>(400, seed);
        let mut random = Uniform::new(seed);
        let moving = (400.0 * random.next()) as usize;
        let [x, y, _] = cloud.points()[moving];
        // Along the surface, by about three times the distance between samples.
        let direction = [-y, x, 0.0].map(|v| 0.4 * v / x.hypot(y));
        Self {
            cloud,
            moving,
            direction,
            plan: Reconstructor::new(grid, options.clone()).expect("options"),
            values,
        }
    }

    fn at(&mut self, step: f64) -> Vec<f64> {
        let mut points = self.cloud.points().to_vec();
        let start = points[self.moving];
        points[self.moving] = std::array::from_fn(|a| start[a] + step * self.direction[a]);
        let normals = self.cloud.normals().expect("given").to_vec();
        let moved = PointCloud::new(points).and_then(|cloud| cloud.with_normals(normals));
        let result = self.plan.reconstruct(&moved.expect("a cloud"));
        (self.values)(result.expect("a torus"))
    }

    /// The largest of the changes in `steps` steps, and of it the larger half, 30 times over.
    fn jump(&mut self, steps: usize) -> f64 {
        let change = |a: &[f64], b: &[f64]| {
            let changes = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            changes.fold(0.0, f64::max)
        };
        let place = |k: usize| k as f64 / steps as f64;
        let mut largest = (0.0, 0);
        let mut last = self.at(0.0);
        for k in 1..=steps {
            let next = self.at(place(k));
            let changed = change(&last, &next);
            if changed > largest.0 {
                largest = (changed, k);
            }
            last = next;
        }
        let [mut low, mut high] = [place(largest.1 - 1), place(largest.1)];
        let (mut below, mut above) = (self.at(low), self.at(high));
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            let between = self.at(middle);
            match change(&below, &between) > change(&between, &above) {
                true => (high, above) = (middle, between),
                false => (low, below) = (middle, between),
            }
        }
        change(&below, &above)
    }
}

/// On a finer surface, on one that is marched on half cells, and on the grid with a local level.
fn options() -> [Options; 3] {
    let sided = Options::default().orient(Method::Signs).checks(false);
    let [fine, halved] =
        [1.5, 0.7].map(|factor| sided.clone().surface(SurfaceResolution::Factor(factor)));
    let local = sided.surface(SurfaceResolution::Grid).level(Level::Local);
    [fine, halved, local]
}

#[test]
fn the_indicator_does_not_jump_where_a_sample_enters_a_neighborhood() {
    for options in options() {
        for seed in 1..4 {
            let jump = Line::new(seed, &options, indicator).jump(60);
            assert!(jump < 1e-8, "seed {seed}: {jump:e}, {options:?}");
        }
    }
}

/// Corners of cubes change sides, and marching cubes its triangles.
#[test]
fn the_distance_does_not_jump_where_the_triangles_change() {
    for options in options() {
        for seed in 1..7 {
            let jump = Line::new(seed, &options, distance).jump(60);
            assert!(jump < 1e-8, "seed {seed}: {jump:e}, {options:?}");
        }
    }
}

/// The test above finds jumps.
#[test]
fn the_indicator_jumps_with_the_weights_of_the_paper() {
    let options = Options::default().orient(Method::Signs).checks(false);
    let options = options
        .surface(SurfaceResolution::Grid)
        .radius(Radius::Cut(0.3));
    let jumps = (1..4).map(|seed| Line::new(seed, &options, indicator).jump(60));
    let jumps = jumps.filter(|&jump| jump > 1e-5).count();
    assert!(jumps >= 2, "{jumps} of 3");
}
