//! One sample moves on a line through the cloud, and nothing jumps: what changes in one step changes ever less in ever
//! smaller ones.

use super::{Residual, forward};
use crate::neighbors::tests::{Random, torus};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::{splat, vector};

/// Normals, radii and areas of the cloud at one step.
struct State {
    normals: Vec<[f64; 3]>,
    /// Radii and roots of areas, which have the unit of the points.
    lengths: Vec<f64>,
    /// Whether the axis of a point is told from others: its jump is then no exchange of eigenvectors.
    is_clear: Vec<bool>,
}

struct Line {
    points: Vec<[f64; 3]>,
    moving: usize,
    direction: [f64; 3],
    radius: Radius,
}

impl Line {
    fn at(&self, step: f64) -> State {
        let mut points = self.points.clone();
        let start = points[self.moving];
        points[self.moving] = vector::add(start, vector::scale(self.direction, step));
        let (mut near, mut axes) = <(Neighborhoods<f64>, Residual<f64>)>::default();
        neighbors::forward(&points, self.radius, &mut near).expect("a cloud");
        forward(&near, &mut axes);
        let mut lengths = Vec::new();
        splat::area::forward(&near, &mut lengths);
        lengths.iter_mut().for_each(|area| *area = area.sqrt());
        lengths.extend(&axes.radius);
        let is_clear = axes.planes.iter().map(|plane| {
            let [first, second, third] = plane.eigenvalues;
            second - first > 0.02 * third
        });
        State {
            normals: axes.normals,
            is_clear: is_clear.collect(),
            lengths,
        }
    }

    /// Largest change of a normal, and of a length in parts of the radius.
    fn change(&self, a: &State, b: &State) -> f64 {
        let turn = |i: usize| match a.is_clear[i] && b.is_clear[i] {
            true => vector::norm(vector::cross(a.normals[i], b.normals[i])),
            false => 0.0,
        };
        let turns = (0..a.normals.len()).map(turn);
        let lengths = a.lengths.iter().zip(&b.lengths);
        let lengths = lengths.map(|(&a, &b)| (a / b).ln().abs());
        turns.chain(lengths).fold(0.0, f64::max)
    }

    /// The largest of the changes in `steps` steps along the line, and of it the larger half, 40 times over.
    fn jump(&self, steps: usize) -> f64 {
        let states: Vec<State> = (0..=steps)
            .map(|k| self.at(k as f64 / steps as f64))
            .collect();
        let changes = states
            .windows(2)
            .map(|pair| self.change(&pair[0], &pair[1]));
        let (k, _) = changes
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("steps");
        let place = |k: usize| (k as f64 / steps as f64, self.at(k as f64 / steps as f64));
        let [mut low, mut high] = [k, k + 1].map(place);
        for _ in 0..40 {
            let middle = 0.5 * (low.0 + high.0);
            let between = (middle, self.at(middle));
            match self.change(&low.1, &between.1) > self.change(&between.1, &high.1) {
                true => high = between,
                false => low = between,
            }
        }
        self.change(&low.1, &high.1)
    }
}

/// Lines of clouds with an even surface, with a surface that has few samples at one end, and with noise.
fn lines(radius: Radius) -> impl Iterator<Item = Line> {
    (0..12).map(move |seed| {
        let mut random = Random::new(seed);
        let noise = [0.0, 0.0, 0.06][seed as usize % 3];
        let mut points: Vec<[f64; 3]> = Vec::new();
        for (i, (p, _)) in torus(120, seed).into_iter().enumerate() {
            if seed % 3 != 1 || p[0] < 0.4 || i % 9 == 0 {
                points.push(p.map(|x| x + noise * (random.uniform() + random.uniform() - 1.0)));
            }
        }
        let pick = |random: &mut Random| (random.uniform() * points.len() as f64) as usize;
        let (moving, target) = (pick(&mut random), pick(&mut random));
        let towards = vector::sub(points[target], points[moving]);
        let direction = vector::scale(towards, 0.3 / vector::norm(towards).max(0.1));
        Line {
            points,
            moving,
            direction,
            radius,
        }
    })
}

#[test]
fn normals_areas_and_radii_do_not_jump() {
    for (seed, line) in lines(Radius::Auto).enumerate() {
        let jump = line.jump(850);
        assert!(jump < 1e-9, "seed {seed}: {jump}");
    }
}

/// The test above finds jumps.
#[test]
fn the_weights_of_the_paper_jump() {
    let jumps = lines(Radius::Cut(0.25)).map(|line| line.jump(100));
    let jumps = jumps.filter(|&jump| jump > 1e-3).count();
    assert!(jumps >= 10, "{jumps} of 12");
}
