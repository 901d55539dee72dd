//! Scratch buffers of the recursion.

use super::block::CHILDREN;
use super::packet::CELLS;
use super::site_list::{ChildLists, Site};
use super::sites::Spoke;
use crate::distance::bvh::{LANES, Stack};

/// Halvings from a block to 4×4×4 cells.
pub(super) const LEVELS: usize = 2;

/// Scratch buffers of one thread.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    pub stack: Stack,
    pub leaves: Vec<u32>,
    /// Candidates of a block of side [`BLOCK`](super::block::BLOCK).
    pub sites: Vec<Site>,
    /// All of them, by their places.
    pub listed: Vec<u32>,
    pub large: Vec<u32>,
    pub levels: [ChildCandidates; LEVELS],
    pub measured: Candidates,
}

/// A small triangle that may be closest to some cell of a packet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Candidate {
    /// Its place in the tree.
    pub place: u32,
    /// The corner that is at `from`.
    pub corner: u32,
    /// In cells from the center of the block.
    pub from: [f32; 3],
}

/// Candidates with distances in single precision, each triangle once.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    pub candidates: Vec<Candidate>,
    /// Squared distances from the cells of a packet.
    pub squared: Vec<[f32; CELLS]>,
    pub length: usize,
    /// Places of sites.
    pub near: Vec<u32>,
    chosen: Vec<u32>,
    choices: usize,
    seen: Visited,
}

/// Triangles that may be closest to some cell of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lists<'a> {
    /// Places in [`Workspace::sites`].
    pub sites: &'a [u32],
    /// Large triangles, by their places in the tree.
    pub large: &'a [u32],
}

impl Lists<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.sites.is_empty() && self.large.is_empty()
    }
}

/// Candidates of each child of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct ChildCandidates {
    pub sites: ChildLists,
    pub large: [Vec<u32>; CHILDREN],
}

impl ChildCandidates {
    pub(super) fn of(&self, child: usize) -> Lists<'_> {
        Lists {
            sites: self.sites.of(child),
            large: &self.large[child],
        }
    }
}

/// Set of small integers that is cleared in constant time.
#[derive(Clone, Debug, Default)]
pub(super) struct Visited {
    rounds: Vec<u32>,
    round: u32,
}

impl Visited {
    pub(super) fn empty(&mut self, size: usize) {
        if self.rounds.len() < size || self.round == u32::MAX {
            self.rounds.clear();
            self.rounds.resize(size, 0);
            self.round = 0;
        }
        self.round += 1;
    }

    #[inline(always)]
    fn open(&mut self) -> Open<'_> {
        Open {
            rounds: &mut self.rounds,
            round: self.round,
        }
    }
}

/// [`Visited`] in a loop: stays in registers while other memory is written.
struct Open<'a> {
    rounds: &'a mut [u32],
    round: u32,
}

impl Open<'_> {
    /// Whether it is new.
    #[inline(always)]
    fn insert(&mut self, index: u32) -> bool {
        let round = &mut self.rounds[index as usize];
        let new = *round != self.round;
        *round = self.round;
        new
    }
}

impl Candidates {
    /// Clears the list; triangles are below `size`.
    pub(super) fn clear(&mut self, size: usize) {
        self.seen.empty(size);
        self.length = 0;
    }

    /// Appends the triangles of a star that are not listed yet; `from` is its vertex.
    #[inline(always)]
    pub(super) fn extend(&mut self, star: &[Spoke], from: [f32; 3]) {
        let most = self.length + star.len();
        if most > self.candidates.len() {
            self.candidates.resize(2 * most, Candidate::default());
            self.squared.resize(2 * most, [0.0; CELLS]);
        }
        let candidates = &mut self.candidates[self.length..most];
        let mut seen = self.seen.open();
        let mut length = 0;
        for spoke in star {
            let place = spoke.place();
            // Written in any case, kept if new: about half are, and a branch would be mispredicted.
            candidates[length] = Candidate {
                place,
                corner: spoke.corner(),
                from,
            };
            length += usize::from(seen.insert(place));
        }
        self.length += length;
    }

    /// Selects the triangles within the limit of some cell of a half of the packet.
    #[inline(always)]
    pub(super) fn choose(&mut self, half: usize, limit: &[f32; CELLS]) {
        if self.chosen.len() < self.length {
            self.chosen.resize(self.length, 0);
        }
        let first = half * LANES;
        let mut own = [0.0; LANES];
        own.copy_from_slice(&limit[first..first + LANES]);
        let candidates = &self.candidates[..self.length];
        let chosen = &mut self.chosen[..self.length];
        let mut length = 0;
        for (candidate, squared) in candidates.iter().zip(&self.squared) {
            let mut near = false;
            for l in 0..LANES {
                near |= !(squared[first + l] > own[l]);
            }
            // Written in any case, kept if near: a branch would be mispredicted.
            chosen[length] = candidate.place;
            length += usize::from(near);
        }
        self.choices = length;
    }

    /// Places in the tree of the triangles chosen.
    #[inline(always)]
    pub(super) fn chosen(&self) -> &[u32] {
        &self.chosen[..self.choices]
    }
}
