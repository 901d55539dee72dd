//! Positions of the points of a cloud.
//!
//! Each variable is a coordinate of the displacement `u_i` of a point from its start, in cells. The field does not
//! determine so many variables. The term `w/|E| Σ_(i,j)∈E |u_i − u_j|²/s²` over the pairs `E` of neighbors in the cloud
//! at the start (`s` is its spacing) favors equal displacements of neighbors. It is 0 for a translation of the whole
//! cloud, and does not shrink the body, as a penalty on the positions would.

use isograd::PointCloud;
use isograd::neighbors::CellIndex;
use rayon::prelude::*;

use crate::error::Error;
use crate::fingerprint::Fingerprint;

/// Points per task, fixed so that sums have the same bits for any number of threads.
const CHUNK: usize = 2048;

/// The coordinates of every point of a cloud.
#[derive(Clone, Debug)]
pub struct Points {
    /// Points at the start. Normals and attributes are ignored.
    pub cloud: PointCloud<f64>,
    /// Weight `w` of the smoothness of the displacement; 0 for none.
    pub smoothness: f64,
    /// Neighbors of each point in that term.
    pub neighbors: usize,
}

impl Points {
    /// All points of `cloud`, with a smoothness of 0.01 over 8 neighbors.
    pub fn new(cloud: PointCloud<f64>) -> Self {
        Self {
            cloud,
            smoothness: 0.01,
            neighbors: 8,
        }
    }
}

/// Neighbors of each point, as concatenated lists.
#[derive(Clone, Debug, Default)]
struct Graph {
    /// Start of each point's list in `neighbors`, and the end of the last.
    starts: Vec<usize>,
    neighbors: Vec<u32>,
}

impl Graph {
    /// `i` and `j` are neighbors if one is among the `k` nearest of the other.
    fn new(points: &[[f64; 3]], k: usize) -> Self {
        let index = CellIndex::new(points);
        let nearest: Vec<Vec<u32>> = (0..points.len())
            .into_par_iter()
            .map(|i| {
                let mut found = Vec::new();
                index.nearest(points[i], k + 1, &mut found);
                let others = found.iter().map(|&(j, _)| j).filter(|&j| j as usize != i);
                others.take(k).collect()
            })
            .collect();
        let mut pairs = Vec::with_capacity(2 * k * points.len());
        for (i, others) in nearest.iter().enumerate() {
            pairs.extend(others.iter().flat_map(|&j| [(i as u32, j), (j, i as u32)]));
        }
        pairs.par_sort_unstable();
        pairs.dedup();
        let starts = (0..=points.len())
            .map(|i| pairs.partition_point(|&(from, _)| (from as usize) < i))
            .collect();
        Self {
            starts,
            neighbors: pairs.into_iter().map(|(_, to)| to).collect(),
        }
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.neighbors[self.starts[i]..self.starts[i + 1]]
    }
}

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Degrees {
    points: Vec<[f64; 3]>,
    /// Unit length per unit of a variable.
    cell: f64,
    graph: Graph,
    /// Factor of `|u_i − u_j|²`, in cells².
    weight: f64,
    smoothness: f64,
}

impl Degrees {
    pub fn new(options: Points, cell: f64) -> Result<Self, Error> {
        if !(options.smoothness >= 0.0) || !options.smoothness.is_finite() {
            return Err(Error::Option {
                what: "the smoothness",
                value: options.smoothness,
                range: "0 or more, and finite",
            });
        }
        let points = options.cloud.points().to_vec();
        let (mut graph, mut weight) = (Graph::default(), 0.0);
        if options.smoothness > 0.0 && points.len() > 1 {
            graph = Graph::new(&points, options.neighbors.max(1));
            let spacing = spacing(&points, &graph);
            let pairs = (graph.neighbors.len() / 2).max(1) as f64;
            if spacing > 0.0 {
                weight = options.smoothness / pairs * (cell / spacing).powi(2);
            }
        }
        Ok(Self {
            points,
            cell,
            graph,
            weight,
            smoothness: options.smoothness,
        })
    }

    pub fn start(&self) -> Vec<f64> {
        vec![0.0; 3 * self.points.len()]
    }

    pub fn points(&self, x: &[f64]) -> Vec<[f64; 3]> {
        let moved = |(p, u): (&[f64; 3], &[f64])| [0, 1, 2].map(|a| p[a] + self.cell * u[a]);
        self.points
            .iter()
            .zip(x.chunks_exact(3))
            .map(moved)
            .collect()
    }

    pub fn pullback(&self, points_bar: &[[f64; 3]]) -> Vec<f64> {
        points_bar.iter().flatten().map(|b| self.cell * b).collect()
    }

    /// The smoothness term; its gradient is added to `gradient`.
    pub fn roughness(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        let at = |i: usize, a: usize| x[3 * i + a];
        let chunks = gradient.par_chunks_mut(3 * CHUNK).enumerate();
        let partial: Vec<f64> = chunks
            .map(|(chunk, gradient)| {
                let mut total = 0.0;
                for (row, gradient) in gradient.chunks_exact_mut(3).enumerate() {
                    let i = chunk * CHUNK + row;
                    for &j in self.graph.of(i) {
                        for a in 0..3 {
                            let off = at(i, a) - at(j as usize, a);
                            // Each pair is met from both its ends.
                            total += 0.5 * off * off;
                            gradient[a] += 2.0 * self.weight * off;
                        }
                    }
                }
                total
            })
            .collect();
        self.weight * partial.into_iter().sum::<f64>()
    }

    pub fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::default();
        hash.numbers(self.points.as_flattened());
        hash.numbers(&[self.smoothness, self.cell]);
        hash.number(self.graph.neighbors.len() as u64);
        hash.finish()
    }
}

/// Median distance of a point to its nearest neighbor.
fn spacing(points: &[[f64; 3]], graph: &Graph) -> f64 {
    let distance = |i: usize, j: u32| {
        isograd_element::vector::norm(isograd_element::vector::sub(points[i], points[j as usize]))
    };
    let nearest = |i: usize| {
        let all = graph.of(i).iter().map(|&j| distance(i, j));
        all.fold(f64::INFINITY, f64::min)
    };
    let mut nearest: Vec<f64> = (0..points.len()).map(nearest).collect();
    let middle = nearest.len() / 2;
    *nearest.select_nth_unstable_by(middle, f64::total_cmp).1
}
