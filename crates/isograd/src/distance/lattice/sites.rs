//! What culling needs to know of a mesh: its vertices in the order of the tree, and the triangles round each.

use crate::distance::bvh::{Bvh, LEAF};
use crate::vector::to_f64;
use crate::{Mesh, Real};

/// A triangle whose slack (see `Frame`) is above this many squared cells is culled by itself; the others by
/// their corners, of which there are fewer than triangles, and which are quicker to test.
pub(super) const LARGE: f64 = 4.0;

/// The vertices of the small triangles, numbered as the leaves of the tree first name them: so every leaf
/// owns a run of them, and neighbours in space are neighbours in memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Sites {
    /// Where the sites of each leaf begin.
    leaves: Vec<u32>,
    position: Vec<[f64; 3]>,
    /// The largest slack of the triangles of each site.
    slack: Vec<f64>,
    /// Where the triangles of each site begin in `stars`.
    starts: Vec<u32>,
    /// Small triangles, by their places in the tree.
    stars: Vec<u32>,
    /// Whether each triangle of the tree is large; empty where none is.
    large: Vec<bool>,
    /// The site of each vertex.
    of_vertex: Vec<u32>,
}

/// The site of a vertex that only large triangles have.
const NONE: u32 = u32::MAX;

impl Sites {
    /// For a lattice of cell size `spacing`.
    pub(super) fn rebuild<T: Real>(&mut self, mesh: &Mesh<T>, bvh: &Bvh, spacing: f64) {
        let limit = LARGE * spacing * spacing;
        let triangles = 0..bvh.len() as u32;
        self.large.clear();
        self.large
            .extend(triangles.map(|place| !(bvh.frame(place).slack() <= limit)));
        self.number(mesh, bvh);
        self.collect_stars(mesh, bvh);
        if !self.large.contains(&true) {
            self.large.clear();
        }
    }

    fn number<T: Real>(&mut self, mesh: &Mesh<T>, bvh: &Bvh) {
        self.of_vertex.clear();
        self.of_vertex.resize(mesh.vertices().len(), NONE);
        self.leaves.clear();
        self.position.clear();
        self.slack.clear();
        for place in 0..bvh.len() {
            if place % LEAF == 0 {
                self.leaves.push(self.position.len() as u32);
            }
            if self.large[place] {
                continue;
            }
            let slack = bvh.frame(place as u32).slack();
            for vertex in mesh.faces()[bvh.face(place as u32) as usize] {
                let site = &mut self.of_vertex[vertex as usize];
                if *site == NONE {
                    *site = self.position.len() as u32;
                    self.position.push(to_f64(mesh.vertices()[vertex as usize]));
                    self.slack.push(slack);
                } else {
                    let most = &mut self.slack[*site as usize];
                    *most = most.max(slack);
                }
            }
        }
        self.leaves.push(self.position.len() as u32);
    }

    /// A counting sort of the triangles by their sites.
    fn collect_stars<T: Real>(&mut self, mesh: &Mesh<T>, bvh: &Bvh) {
        let (large, of_vertex) = (&self.large, &self.of_vertex);
        let small = |place: &usize| !large[*place];
        let sites = |place: usize| {
            let face = mesh.faces()[bvh.face(place as u32) as usize];
            face.map(|v| of_vertex[v as usize] as usize)
        };
        self.starts.clear();
        self.starts.resize(self.position.len() + 1, 0);
        for place in (0..bvh.len()).filter(small) {
            for site in sites(place) {
                self.starts[site] += 1;
            }
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += *start;
            *start = total;
        }
        self.stars.clear();
        self.stars.resize(total as usize, 0);
        // Filled from the back, so that every start ends where it belongs.
        for place in (0..bvh.len()).rev().filter(small) {
            for site in sites(place) {
                self.starts[site] -= 1;
                self.stars[self.starts[site] as usize] = place as u32;
            }
        }
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.leaves.capacity()
            + self.position.capacity()
            + self.starts.capacity()
            + self.stars.capacity()
            + self.of_vertex.capacity()
    }

    /// Whether there is a triangle that is culled by itself.
    pub(super) fn any_large(&self) -> bool {
        !self.large.is_empty()
    }

    /// Whether the triangle is culled by itself.
    pub(super) fn is_large(&self, place: u32) -> bool {
        self.any_large() && self.large[place as usize]
    }

    /// The sites that a leaf owns.
    #[inline(always)]
    pub(super) fn of_leaf(&self, leaf: u32) -> std::ops::Range<u32> {
        self.leaves[leaf as usize]..self.leaves[leaf as usize + 1]
    }

    #[inline(always)]
    pub(super) fn position(&self, site: u32) -> [f64; 3] {
        self.position[site as usize]
    }

    /// The largest slack in the star of a site.
    #[inline(always)]
    pub(super) fn slack(&self, site: u32) -> f64 {
        self.slack[site as usize]
    }

    /// The small triangles round a site.
    #[inline(always)]
    pub(super) fn star(&self, site: u32) -> &[u32] {
        let s = site as usize;
        &self.stars[self.starts[s] as usize..self.starts[s + 1] as usize]
    }
}
