//! The order in which the automatic method works.

use crate::neighbors::Neighborhoods;
use crate::{Real, parallel};

/// Numbers the points by their places. Signs are decided one after the other, and among equals the first one wins: in this
/// order, unlike that of the input, the outcome is a function of the cloud alone. Points that are close in it are close in
/// space.
#[derive(Clone, Debug, Default)]
pub struct Sites {
    /// Site → sorted position in the neighbor index.
    position: Vec<u32>,
    /// Site → input index.
    order: Vec<u32>,
    /// Input index → site.
    of: Vec<u32>,
}

impl Sites {
    /// Numbers the points of a cloud.
    pub fn find<T: Real>(&mut self, neighborhoods: &Neighborhoods<T>) {
        let index = &neighborhoods.index;
        index.positions_by_place(&mut self.position);
        let position = &self.position;
        parallel::fill(&mut self.order, position.len(), |site| {
            index.order()[position[site] as usize]
        });
        parallel::resize(&mut self.of, index.len(), 0);
        for (site, &i) in (0u32..).zip(&self.order) {
            self.of[i as usize] = site;
        }
    }

    /// `(N,)` input index of each site.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// `(N,)` sorted position of each site in the neighbor index.
    pub fn positions(&self) -> &[u32] {
        &self.position
    }

    /// Sorted position of a site in the neighbor index.
    ///
    /// # Panics
    /// There is no such site.
    #[inline(always)]
    pub fn position(&self, site: usize) -> usize {
        self.position[site] as usize
    }

    /// Site of the point with this input index.
    ///
    /// # Panics
    /// There is no such point.
    #[inline(always)]
    pub fn of(&self, i: u32) -> u32 {
        self.of[i as usize]
    }
}
