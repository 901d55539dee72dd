//! Dipoles of the nodes of the bounding volume hierarchy.

use std::f64::consts::PI;

use super::super::bvh::{LANES, LEAF, Points, WIDTH};
use super::area_vector;
use crate::parallel;
use crate::vector::{add, norm, scale, sub};

/// Expansion of the winding number of some triangles about their center, over the moments of their area vectors.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cluster {
    /// Mean of the centroids, weighted by area.
    pub center: [f64; 3],
    /// Radius of a ball around the center that contains the triangles.
    pub radius: f64,
    /// Sum of the areas.
    area: f64,
    /// `Σ a n / 4π`.
    dipole: [f64; 3],
    /// `Σ (x − center) (a n)ᵀ / 4π`, symmetric part: xx, yy, zz, xy, yz, zx.
    moments: [f64; 6],
    low: [f64; 3],
    high: [f64; 3],
}

/// Clusters of all leaves, of the nodes above them, and so on to the root.
#[derive(Default)]
pub(super) struct Clusters {
    levels: Vec<Vec<Cluster>>,
}

impl Clusters {
    /// Clusters of `triangles`, the corners of which are given by place in the hierarchy.
    pub(super) fn new(triangles: usize, corners: &(impl Fn(u32) -> [[f64; 3]; 3] + Sync)) -> Self {
        let leaf = |leaf: usize| {
            let places = leaf * LEAF..triangles.min((leaf + 1) * LEAF);
            let parts: Vec<Cluster> = places.map(|p| of_triangle(corners(p as u32))).collect();
            joined(&parts)
        };
        let mut levels = vec![parallel::map(triangles.div_ceil(LEAF), leaf)];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let parts = |above: usize| &below[above * WIDTH..below.len().min((above + 1) * WIDTH)];
            let above = parallel::map(below.len().div_ceil(WIDTH), |above| joined(parts(above)));
            levels.push(above);
        }
        Self { levels }
    }

    /// Level and place of the root.
    pub(super) fn root(&self) -> (u32, u32) {
        (self.levels.len() as u32 - 1, 0)
    }

    pub(super) fn get(&self, level: u32, index: u32) -> &Cluster {
        &self.levels[level as usize][index as usize]
    }

    /// Levels and places of the clusters below one that is not a leaf.
    pub(super) fn children(
        &self,
        level: u32,
        index: u32,
    ) -> impl DoubleEndedIterator<Item = (u32, u32)> + use<> {
        let count = self.levels[level as usize - 1].len() as u32;
        let first = index * WIDTH as u32;
        (first..count.min(first + WIDTH as u32)).map(move |child| (level - 1, child))
    }
}

fn of_triangle(corners: [[f64; 3]; 3]) -> Cluster {
    let (area_vector, centroid) = area_vector(corners);
    let bound = |f: fn(f64, f64) -> f64| {
        std::array::from_fn(|a| f(f(corners[0][a], corners[1][a]), corners[2][a]))
    };
    Cluster {
        center: centroid,
        area: norm(area_vector),
        dipole: scale(area_vector, 1.0 / (4.0 * PI)),
        low: bound(f64::min),
        high: bound(f64::max),
        ..Cluster::default()
    }
}

/// One cluster of several: first moments are exact.
fn joined(parts: &[Cluster]) -> Cluster {
    let area: f64 = parts.iter().map(|part| part.area).sum();
    let mut whole = Cluster {
        area,
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        ..Cluster::default()
    };
    for part in parts {
        whole.dipole = add(whole.dipole, part.dipole);
        for a in 0..3 {
            whole.low[a] = whole.low[a].min(part.low[a]);
            whole.high[a] = whole.high[a].max(part.high[a]);
        }
    }
    whole.center = match area > 0.0 {
        true => parts.iter().fold([0.0; 3], |sum, part| {
            add(sum, scale(part.center, part.area / area))
        }),
        false => scale(add(whole.low, whole.high), 0.5),
    };
    for part in parts {
        let [x, y, z] = sub(part.center, whole.center);
        let [u, v, w] = part.dipole;
        let moved = [
            x * u,
            y * v,
            z * w,
            0.5 * (x * v + y * u),
            0.5 * (y * w + z * v),
            0.5 * (z * u + x * w),
        ];
        for (k, moment) in whole.moments.iter_mut().enumerate() {
            *moment += part.moments[k] + moved[k];
        }
    }
    let corner = std::array::from_fn(|a| {
        let c = whole.center[a];
        (whole.high[a] - c).max(c - whole.low[a])
    });
    whole.radius = norm(corner);
    whole
}

impl Cluster {
    /// Adds the winding number at some points outside the ball of the cluster.
    #[inline(always)]
    pub(super) fn add_to(&self, sum: &mut [f64; LANES], points: &Points) {
        let [u, v, w] = self.dipole;
        let [xx, yy, zz, xy, yz, zx] = self.moments;
        let trace = xx + yy + zz;
        for l in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|a| self.center[a] - points[a][l]);
            let squared = x * x + y * y + z * z;
            let inverse = 1.0 / squared;
            let cubed = inverse / squared.sqrt();
            let diagonal = xx * x * x + yy * y * y + zz * z * z;
            let mixed = xy * x * y + yz * y * z + zx * z * x;
            let along = u * x + v * y + w * z;
            sum[l] += cubed * (along + trace - 3.0 * inverse * (diagonal + 2.0 * mixed));
        }
    }
}
