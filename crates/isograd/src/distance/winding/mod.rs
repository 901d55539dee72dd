//! Generalized winding number of a triangle mesh: the sign where there is no indicator.
//!
//! The winding number of a point is the sum of the signed solid angles of all triangles, over 4π. It is a whole number
//! for a closed mesh, and ½ in the middle of a hole of an open one (A. Jacobson, L. Kavan and O. Sorkine-Hornung, *Robust
//! inside-outside segmentation using generalized winding numbers*, 2013). Triangles nearby are summed exactly; a cluster of
//! triangles farther away than [`FAR`] of its radii counts as a dipole with its first moments (G. Barill and others, *Fast
//! winding numbers for soups and clouds*, 2018). Clusters are the nodes of the bounding volume hierarchy.

mod clusters;
mod edges;
mod solid_angle;
#[cfg(test)]
mod tests;

use super::bvh::{Bvh, LANES, Points};
use crate::vector::{add, cross, norm, scale, sub};
use crate::{Mesh, Real};
use clusters::{Cluster, Clusters};
pub(super) use edges::is_closed;
use solid_angle::{Angles, Triangle};

/// A cluster farther away than so many of its radii counts as a dipole.
const FAR: f64 = 2.0;

/// Winding number from which on a point is inside.
pub(super) const INSIDE: f64 = 0.5;

/// Winding numbers of a mesh; lengths are in units of its extent, relative to its first vertex.
pub(super) struct Winding<'a, T> {
    mesh: &'a Mesh<T>,
    bvh: &'a Bvh,
    clusters: Clusters,
    origin: [f64; 3],
    per_unit: f64,
}

/// Triangles and clusters that give the winding number near a place; its memory is used again.
#[derive(Default)]
pub(super) struct Sources {
    near: Vec<Triangle>,
    far: Vec<Cluster>,
    stack: Vec<(u32, u32)>,
}

impl<'a, T: Real> Winding<'a, T> {
    /// `bvh` is that of `mesh`, which has a triangle.
    pub(super) fn new(mesh: &'a Mesh<T>, bvh: &'a Bvh) -> Self {
        let origin = mesh.corners(bvh.face(0) as usize)[0].map(T::f64);
        let mut this = Self {
            mesh,
            bvh,
            clusters: Clusters::default(),
            origin,
            per_unit: bvh.per_unit(),
        };
        this.clusters = Clusters::new(bvh.len(), &|place| this.corners(place));
        this
    }

    /// A point in the unit of the sums.
    #[inline(always)]
    pub(super) fn to_local(&self, p: [f64; 3]) -> [f64; 3] {
        scale(sub(p, self.origin), self.per_unit)
    }

    fn corners(&self, place: u32) -> [[f64; 3]; 3] {
        let corners = self.mesh.corners(self.bvh.face(place) as usize);
        corners.map(|corner| self.to_local(corner.map(T::f64)))
    }

    /// Finds the triangles and clusters for all points within `radius` of `center`, both in the unit of the sums.
    pub(super) fn collect(&self, center: [f64; 3], radius: f64, sources: &mut Sources) {
        let Sources { near, far, stack } = sources;
        near.clear();
        far.clear();
        stack.clear();
        stack.push(self.clusters.root());
        while let Some((level, index)) = stack.pop() {
            let cluster = self.clusters.get(level, index);
            let distance = norm(sub(cluster.center, center)) - radius;
            if distance > FAR * cluster.radius {
                far.push(*cluster);
            } else if level == 0 {
                let triangles = self.bvh.leaf(index).map(|place| {
                    let [a, b, c] = self.corners(place);
                    let normal = cross(sub(b, a), sub(c, a));
                    Triangle {
                        corners: [a, b, c],
                        normal,
                    }
                });
                near.extend(triangles.filter(|triangle| triangle.normal != [0.0; 3]));
            } else {
                stack.extend(self.clusters.children(level, index).rev());
            }
        }
    }
}

impl Sources {
    /// Winding numbers of some points for which the sources were collected.
    #[inline(always)]
    pub(super) fn winding_numbers(&self, points: &Points) -> [f64; LANES] {
        let mut angles = Angles::default();
        for triangle in &self.near {
            angles.add(triangle, points);
        }
        let mut sum = angles.turns();
        for cluster in &self.far {
            cluster.add_to(&mut sum, points);
        }
        sum
    }
}

/// Area times unit normal, and centroid, of a triangle.
fn area_vector([a, b, c]: [[f64; 3]; 3]) -> ([f64; 3], [f64; 3]) {
    let normal = scale(cross(sub(b, a), sub(c, a)), 0.5);
    (normal, scale(add(add(a, b), c), 1.0 / 3.0))
}
