//! Vertices of a mesh in the order of the tree, with the triangles around each, for culling.

use super::facet::Facet;
use crate::distance::bvh::{Bvh, LEAF};
use crate::large::is_large;
use crate::vector::to_f64;
use crate::{Mesh, Real, parallel};

/// A triangle whose slack (see `Frame`) is above this many squared cells is culled by itself; the others by
/// their corners, of which there are fewer than triangles, and which are quicker to test.
pub(super) const LARGE: f64 = 4.0;

/// The vertices of the small triangles, numbered as the leaves of the tree first name them: so every leaf
/// owns a run of them, and neighbors in space are neighbors in memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Sites {
    /// Where the sites of each leaf begin.
    leaves: Vec<u32>,
    position: Vec<[f64; 3]>,
    /// The largest slack of the triangles of each site.
    slack: Vec<f64>,
    /// The slack of each triangle, in the order of the tree.
    slacks: Vec<f64>,
    /// Where the triangles of each site begin in `stars`.
    starts: Vec<u32>,
    /// The small triangles of each.
    stars: Vec<Spoke>,
    /// All triangles, in the order of the tree.
    facets: Vec<Facet>,
    /// Whether each triangle of the tree is large; empty where none is.
    large: Vec<bool>,
    longest_edge: f64,
    /// The site of each vertex.
    of_vertex: Vec<u32>,
}

/// A small triangle of the star of a vertex: four times its place in the tree, and which of its corners the vertex is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spoke(u32);

impl Spoke {
    /// Places that it can hold.
    const PLACES: usize = 1 << 30;

    /// The triangle's place in the tree.
    #[inline(always)]
    pub(super) fn place(self) -> u32 {
        self.0 >> 2
    }

    /// The corner that is the vertex.
    #[inline(always)]
    pub(super) fn corner(self) -> u32 {
        self.0 & 3
    }
}

/// Beyond this many cells squares leave the range of single precision: then all triangles count as large, as they do where
/// there are more than a [`Spoke`] can tell apart.
const FAR: f64 = 1e15;

/// The site of a vertex that only large triangles have.
const NONE: u32 = u32::MAX;

/// Triangles measured in one piece.
const PIECE: usize = 4096;

impl Sites {
    /// For a lattice of cell size `spacing`; `magnitude` is the largest absolute coordinate.
    pub(super) fn rebuild<T: Real>(
        &mut self,
        mesh: &Mesh<T>,
        bvh: &Bvh,
        spacing: f64,
        magnitude: f64,
    ) {
        let limit = if magnitude < FAR * spacing && bvh.len() <= Spoke::PLACES {
            LARGE * spacing * spacing
        } else {
            f64::NEG_INFINITY
        };
        self.measure(mesh, bvh, limit);
        let mut facets = std::mem::take(&mut self.facets);
        parallel::join(
            || {
                parallel::fill_large(&mut facets, bvh.len(), &|place| {
                    let place = place as u32;
                    Facet::new(&bvh.frame_of(mesh, place), bvh.face(place), 1.0 / spacing)
                });
            },
            || {
                self.number(mesh, bvh);
                self.collect_stars(mesh, bvh);
            },
        );
        self.facets = facets;
        if is_large(bvh.len()) {
            self.slacks = Vec::new();
            self.of_vertex = Vec::new();
        }
        if !self.large.contains(&true) {
            self.large.clear();
        }
    }

    /// Finds the longest edge, and the triangles whose slack is not within `limit`.
    fn measure<T: Real>(&mut self, mesh: &Mesh<T>, bvh: &Bvh, limit: f64) {
        parallel::resize(&mut self.slacks, bvh.len(), 0.0);
        let pieces = self.slacks.chunks_mut(PIECE);
        let longest = parallel::map_each(pieces, |k, slacks| {
            let mut longest = 0.0_f64;
            for (place, slack) in (k * PIECE..).zip(slacks) {
                let frame = bvh.frame_of(mesh, place as u32);
                *slack = frame.slack();
                longest = longest.max(frame.longest_edge());
            }
            longest
        });
        self.longest_edge = longest.into_iter().fold(0.0, f64::max);
        let exceeds_limit = |slack: &f64| !(*slack <= limit);
        self.large.clear();
        self.large.extend(self.slacks.iter().map(exceeds_limit));
    }

    fn number<T: Real>(&mut self, mesh: &Mesh<T>, bvh: &Bvh) {
        self.of_vertex.clear();
        self.of_vertex.resize(mesh.vertices().len(), NONE);
        self.leaves.clear();
        self.position.clear();
        self.slack.clear();
        self.position.reserve_exact(mesh.vertices().len());
        self.slack.reserve_exact(mesh.vertices().len());
        for place in 0..bvh.len() {
            if place % LEAF == 0 {
                self.leaves.push(self.position.len() as u32);
            }
            if self.large[place] {
                continue;
            }
            let slack = self.slacks[place];
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
        self.stars.resize(total as usize, Spoke::default());
        // Filled from the back, so that every start ends where it belongs.
        for place in (0..bvh.len()).rev().filter(small) {
            for (corner, site) in sites(place).into_iter().enumerate() {
                self.starts[site] -= 1;
                let spoke = Spoke((place << 2 | corner) as u32);
                self.stars[self.starts[site] as usize] = spoke;
            }
        }
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.leaves.capacity()
            + self.position.capacity()
            + self.slacks.capacity()
            + self.starts.capacity()
            + self.stars.capacity()
            + self.facets.capacity()
            + self.of_vertex.capacity()
    }

    /// The longest edge of all triangles.
    pub(super) fn longest_edge(&self) -> f64 {
        self.longest_edge
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

    /// The triangles, in the order of the tree.
    #[inline(always)]
    pub(super) fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// The small triangles around a site.
    #[inline(always)]
    pub(super) fn star(&self, site: u32) -> &[Spoke] {
        let s = site as usize;
        &self.stars[self.starts[s] as usize..self.starts[s + 1] as usize]
    }
}
