//! One motion: its differences, and the pullback beside them.

use rayon::slice::ParallelSliceMut;

use super::functional::{Functional, parting};
use super::{CheckError, Difference, Motion, Options, Row};
use crate::data::LatticeEdge;
use crate::distance::lattice::NO_TRIANGLE;
use crate::distance::triangle::closest_point;
use crate::isosurface::Level;
use crate::neighbors::Radius;
use crate::splat::Weights;
use crate::vector::{dot, norm, sub};
use crate::{
    CloudCotangent, Cotangent, Error, Mesh, PointCloud, Reconstruction, Reconstructor, parallel,
};

/// Small steps that are tried, in cells: the first one over which nothing changes that has no derivative is
/// taken, or else the last one. In 5 of 8 directions of noise at all samples of a torus, steps of 1e-6 pass kinks of the surface on half
/// cells that are not counted, and differ from the pullback by up to 6e-7 of [`Row::scale`]; these, by less than 5e-10.
const SMALL_STEPS: [f64; 2] = [1e-7, 1e-8];

/// How far the closest point to a cell goes in a small step, in cells, where the cell crosses the medial axis.
/// No vertex goes so far: those that do go a thousand times as far as the samples.
const JUMP: f64 = 1e-2;

/// Data common to all motions.
pub(super) struct Check<'a> {
    cloud: &'a PointCloud<f64>,
    base: &'a Reconstruction<f64>,
    functional: Functional,
    /// See [`Row::scale`].
    scale: f64,
    pulled: CloudCotangent<f64>,
    plan: Reconstructor<f64>,
}

impl<'a> Check<'a> {
    pub(super) fn new(
        cloud: &'a PointCloud<f64>,
        base: &'a Reconstruction<f64>,
        plan: Reconstructor<f64>,
    ) -> Result<Self, CheckError> {
        let functional = Functional::new(cloud, base.sdf().grid());
        let bar = functional.cotangent(base.sdf());
        Ok(Self {
            cloud,
            base,
            functional,
            scale: bar.iter().map(|x| x.abs()).sum(),
            pulled: pull(base, &bar)?,
            plan,
        })
    }

    pub(super) fn guarded(&self) -> usize {
        self.pulled.guarded
    }

    pub(super) fn row(&mut self, motion: Motion, options: &Options) -> Result<Row, CheckError> {
        let direction = motion.direction(self.cloud.points(), options.seed);
        let mut ridges = Vec::new();
        let [first, smaller @ ..] = SMALL_STEPS;
        let (mut small, mut slopes) =
            self.difference(motion, &direction, first, true, &mut ridges)?;
        for step in smaller {
            if !small.is_smooth() {
                (small, slopes) = self.difference(motion, &direction, step, true, &mut ridges)?;
            }
        }
        let (large, large_slopes) =
            self.difference(motion, &direction, options.step, false, &mut ridges)?;
        Ok(Row {
            motion,
            pullback: self.derivative(&direction, &ridges)?,
            scale: self.scale,
            small,
            large,
            parting: parting(self.base.sdf().grid(), &slopes, &large_slopes),
            ridges: ridges.len(),
        })
    }

    /// By pullback, without the cells `ridges`.
    fn derivative(&self, direction: &[[f64; 3]], ridges: &[usize]) -> Result<f64, CheckError> {
        let along = |bar: &[[f64; 3]]| {
            direction
                .iter()
                .zip(bar)
                .map(|(v, bar)| dot(*v, *bar))
                .sum()
        };
        if ridges.is_empty() {
            return Ok(along(&self.pulled.points));
        }
        let mut bar = self.functional.cotangent(self.base.sdf());
        ridges.iter().for_each(|&cell| bar[cell] = 0.0);
        Ok(along(&pull(self.base, &bar)?.points))
    }

    /// The central difference over a step in cells, and each cell's part in it, without the cells `ridges`. A
    /// step with signs held adds to these.
    fn difference(
        &mut self,
        motion: Motion,
        direction: &[[f64; 3]],
        step: f64,
        held: bool,
        ridges: &mut Vec<usize>,
    ) -> Result<(Difference, Vec<f64>), CheckError> {
        let length = step * self.base.sdf().grid().spacing();
        let mut side = |length: f64| {
            let moved = moved(self.cloud, direction, length);
            let side = self.side(&moved, held);
            side.map_err(|source| CheckError::Reconstruct {
                what: format!("the cloud moved by {step} cells ({})", motion.name()),
                source,
            })
        };
        let (plus, minus) = (side(length)?, side(-length)?);
        if held {
            ridges.extend(self.ridges(&plus, &minus));
            ridges.sort_unstable();
            ridges.dedup();
        }
        let parts = plus.parts.iter().zip(&minus.parts);
        let mut slopes: Vec<f64> = parts.map(|(p, m)| (p - m) / (2.0 * length)).collect();
        ridges.iter().for_each(|&cell| slopes[cell] = 0.0);
        let normals = plus.normals.iter().zip(&minus.normals);
        let difference = Difference {
            step,
            value: slopes.iter().sum(),
            neighborhoods: unequal(&plus.counts, &minus.counts),
            normals: normals.filter(|(a, b)| dot(**a, **b) < 0.0).count(),
            edges: symmetric_difference(&plus.edges, &minus.edges),
            crossings: unequal(&plus.between, &minus.between),
        };
        Ok((difference, slopes))
    }

    fn side(&mut self, moved: &PointCloud<f64>, held: bool) -> Result<Side, Error> {
        let result = match held {
            true => self.plan.reconstruct_held(moved, self.base)?,
            false => self.plan.reconstruct(moved)?,
        };
        let grid = result.surface_grid();
        let options = result.options();
        let faces = options.splat == Weights::Paper || options.level != Level::Mean;
        let between = |x: f64| match faces {
            true => (2.0 * x).floor() as i64,
            false => (x + 0.5).floor() as i64,
        };
        let mut edges = result.mesh().edges().to_vec();
        edges.par_sort_unstable();
        let places = moved.points().iter().map(|&p| grid.to_index(p));
        Ok(Side {
            parts: self.functional.parts(result.sdf()),
            edges,
            between: places.map(|x| x.map(between)).collect(),
            counts: match options.radius {
                Radius::Cut(_) => [result.neighbor_counts(), result.axis_counts()].concat(),
                Radius::Auto | Radius::Fixed(_) => Vec::new(),
            },
            normals: result.normals().to_vec(),
            surface: held.then(|| (result.closest_mesh().clone(), result.closest().to_vec())),
        })
    }

    /// Cells whose closest point jumps between the two ends of a small step.
    fn ridges(&self, plus: &Side, minus: &Side) -> Vec<usize> {
        let grid = self.base.sdf().grid();
        let (Some(plus), Some(minus)) = (&plus.surface, &minus.surface) else {
            return Vec::new();
        };
        let closest = |(mesh, closest): &(Mesh<f64>, Vec<u32>), cell: usize| {
            let corners = mesh.faces()[closest[cell] as usize].map(|v| mesh.vertices()[v as usize]);
            closest_point(grid.center(grid.cell(cell)), corners).point
        };
        parallel::flat_map(grid.cells(), |cell| {
            let (a, b) = (plus.1[cell], minus.1[cell]);
            let jumps = a != b
                && a != NO_TRIANGLE
                && b != NO_TRIANGLE
                && norm(sub(closest(plus, cell), closest(minus, cell))) > JUMP * grid.spacing();
            jumps.then_some(cell)
        })
    }
}

fn pull(base: &Reconstruction<f64>, bar: &[f64]) -> Result<CloudCotangent<f64>, CheckError> {
    let cotangent = Cotangent {
        sdf: Some(bar),
        ..Cotangent::default()
    };
    Ok(base.pullback(&cotangent)?)
}

/// Data of one end of a step.
struct Side {
    /// Of the functional, cell by cell.
    parts: Vec<f64>,
    /// Those that the surface crosses, sorted.
    edges: Vec<LatticeEdge>,
    /// Between which of the planes that have to do with [`Difference::crossings`] each point lies.
    between: Vec<[i64; 3]>,
    /// Of samples in neighborhoods, where their weights jump.
    counts: Vec<u32>,
    normals: Vec<[f64; 3]>,
    /// Of small steps, the mesh and the closest face of each cell.
    surface: Option<(Mesh<f64>, Vec<u32>)>,
}

/// Number of entries that only one of two sorted lists has.
fn symmetric_difference(a: &[LatticeEdge], b: &[LatticeEdge]) -> usize {
    let common = a.iter().filter(|edge| b.binary_search(edge).is_ok());
    a.len() + b.len() - 2 * common.count()
}

/// Number of places in which two lists differ.
fn unequal<E: PartialEq>(a: &[E], b: &[E]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// The cloud with every point moved by `length` times its direction, its normals and sensors as they are. A point that
/// the motion would make infinite stays.
fn moved(cloud: &PointCloud<f64>, direction: &[[f64; 3]], length: f64) -> PointCloud<f64> {
    let points = cloud.points().iter().zip(direction);
    let points = points.map(|(p, v)| std::array::from_fn(|a| p[a] + length * v[a]));
    let moved = PointCloud::new(points.collect());
    let moved = moved.and_then(|moved| match cloud.normals() {
        Some(normals) => moved.with_normals(normals.to_vec()),
        None => Ok(moved),
    });
    let moved = moved.and_then(|moved| match cloud.sensors() {
        Some(sensors) => moved.with_sensors(sensors.clone()),
        None => Ok(moved),
    });
    moved.unwrap_or_else(|_| cloud.clone())
}
