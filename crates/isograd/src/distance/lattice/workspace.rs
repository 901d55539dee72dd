//! Memory of the recursion.

use std::sync::{Mutex, PoisonError};

use super::kernels::{CHILDREN, Site};
use crate::distance::bvh::Stack;

/// Halvings from a block to 2×2×2 cells.
pub(super) const LEVELS: usize = 3;

/// Memory of one thread.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    pub stack: Stack,
    pub leaves: Vec<u32>,
    pub sites: Vec<Site>,
    /// The number of each of the sites.
    pub numbers: Vec<u32>,
    pub top: Lists,
    pub levels: [[Lists; CHILDREN]; LEVELS],
    pub measured: Measured,
}

/// Workspaces that wait for a thread. What is in one has no influence on the next result.
#[derive(Debug, Default)]
pub(super) struct Pool(Mutex<Vec<Workspace>>);

impl Pool {
    /// Does `work` with a workspace of the pool.
    pub(super) fn with(&self, work: impl FnOnce(&mut Workspace)) {
        let waiting = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut workspace = waiting().pop().unwrap_or_default();
        work(&mut workspace);
        waiting().push(workspace);
    }
}

impl Clone for Pool {
    /// An empty pool: what is in it is only memory.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// The triangles to measure, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    pub list: Vec<u32>,
    pub seen: Seen,
}

/// What may be closest to some cell of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    /// Places in `[`Workspace::sites`]`.
    pub sites: Vec<u32>,
    /// Large triangles, by their places in the tree.
    pub large: Vec<u32>,
}

impl Lists {
    pub(super) fn clear(&mut self) {
        self.sites.clear();
        self.large.clear();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sites.is_empty() && self.large.is_empty()
    }
}

/// A set of small integers that is emptied at once.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    rounds: Vec<u32>,
    round: u32,
}

impl Seen {
    pub(super) fn empty(&mut self, size: usize) {
        if self.rounds.len() < size || self.round == u32::MAX {
            self.rounds.clear();
            self.rounds.resize(size, 0);
            self.round = 0;
        }
        self.round += 1;
    }

    /// Whether it is new.
    #[inline(always)]
    pub(super) fn insert(&mut self, index: u32) -> bool {
        let round = &mut self.rounds[index as usize];
        let new = *round != self.round;
        *round = self.round;
        new
    }
}

impl Measured {
    /// Lists `first` and what is in the stars; all are below `size`.
    pub(super) fn collect<'a>(
        &mut self,
        first: &[u32],
        stars: impl Iterator<Item = &'a [u32]> + Clone,
        size: usize,
    ) {
        self.seen.empty(size);
        self.list.clear();
        self.list.extend_from_slice(first);
        let mut length = first.len();
        self.list
            .resize(length + stars.clone().map(<[u32]>::len).sum::<usize>(), 0);
        for star in stars {
            for &place in star {
                // Written in any case, and kept if new: half of them are, and no branch can foretell which.
                self.list[length] = place;
                length += usize::from(self.seen.insert(place));
            }
        }
        self.list.truncate(length);
    }
}
