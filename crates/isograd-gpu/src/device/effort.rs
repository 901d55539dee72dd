//! Launches and waits: the overhead of work on a device.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts of launches and waits, each of which costs some microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Kernels that were queued.
    pub launches: u64,
    /// Times that this program waited until all that was queued was done.
    pub waits: u64,
}

impl Effort {
    /// From `before` to this.
    pub fn since(self, before: Self) -> Self {
        Self {
            launches: self.launches - before.launches,
            waits: self.waits - before.waits,
        }
    }
}

/// Counts of a device and its clones.
#[derive(Clone, Default)]
pub(super) struct Counts(Arc<[AtomicU64; 2]>);

impl Counts {
    pub fn launch(&self) {
        self.0[0].fetch_add(1, Ordering::Relaxed);
    }

    pub fn wait(&self) {
        self.0[1].fetch_add(1, Ordering::Relaxed);
    }

    pub fn effort(&self) -> Effort {
        let [launches, waits] = [&self.0[0], &self.0[1]].map(|count| count.load(Ordering::Relaxed));
        Effort { launches, waits }
    }
}
