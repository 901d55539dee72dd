//! Memory that a reconstruction needs, and memory that it keeps for its pullback.

#[cfg(any(target_os = "linux", test))]
mod linux;

use std::fmt;

use super::sparse::Sparse;
use super::{Error, Reconstruction};
use crate::data::blocks::Blocks;
use crate::large::is_large;
use crate::{Grid, Real};

/// Largest number of values held at once for each cell: φ, χ, the closest triangles, and the scratch buffers of the
/// Fourier transform and of the distance. Measurements are on the scaling page.
const CELL_VALUES: f64 = 4.5;
/// Values for each cell, of [`CELL_VALUES`], that a new plan allocates: φ and χ. They take no memory of the machine before
/// they are written.
const FIRST_CELL_VALUES: f64 = 2.0;
/// Memory held at once for each sample, as measured there, for search trees, neighborhoods, fitted planes and evidence for
/// signs: bytes that do not depend on the number type, and values.
const OF_POINT: [f64; 2] = [500.0, 75.0];
/// [`OF_POINT`] of a [large](is_large) cloud, for which no scratch memory is kept.
const OF_POINT_OF_LARGE: [f64; 2] = [420.0, 40.0];
/// [`OF_POINT_OF_LARGE`] with given normals and without residuals.
const OF_POINT_GIVEN: [f64; 2] = [10.0, 58.0];

/// Largest number of values held at once for each cell in a block of a sparse solve: right-hand side and indicator of all
/// octaves, and what the local iso-value needs.
const BLOCK_VALUES: f64 = 6.0;
/// [`BLOCK_VALUES`] for each cell of its coarsest grid.
const COARSE_VALUES: f64 = 4.0;

const MIB: f64 = (1u64 << 20) as f64;
const GIB: f64 = (1u64 << 30) as f64;

/// Free memory of this process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvailableMemory {
    /// Bytes.
    pub bytes: f64,
    /// The limit that leaves no more.
    pub limit: MemoryLimit,
}

/// Limits of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryLimit {
    /// Memory of the machine that programs can get without swapping.
    Machine,
    /// A control group of Linux: a container, or a unit of systemd.
    ControlGroup,
    /// Address space of the process: `ulimit -v`.
    AddressSpace,
    /// Data of the process: `ulimit -d`.
    Data,
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Machine => "in this machine",
            Self::ControlGroup => "in its control group or container",
            Self::AddressSpace => "below the limit of its address space, ulimit -v",
            Self::Data => "below the limit of its data, ulimit -d",
        })
    }
}

/// Purpose of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryUse {
    /// A grid of this shape.
    Grid([usize; 3]),
    /// This number of samples.
    Points(usize),
}

/// A reconstruction needs more memory than there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemoryError {
    /// Purpose of the memory.
    pub purpose: MemoryUse,
    /// Bytes that it needs, approximately.
    pub needed: f64,
    /// Free memory.
    pub available: AvailableMemory,
}

impl std::error::Error for MemoryError {}

impl fmt::Display for MemoryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (needed, free) = (Amount(self.needed), Amount(self.available.bytes));
        match self.purpose {
            MemoryUse::Grid(shape) => write!(f, "a grid of {shape:?} cells needs about {needed}"),
            MemoryUse::Points(points) => write!(f, "{points} points need about {needed}"),
        }?;
        write!(f, ", and {free} are free ({}); ", self.available.limit)?;
        f.write_str(match self.purpose {
            MemoryUse::Grid(_) => "use a lower resolution, a larger spacing or tighter bounds",
            MemoryUse::Points(_) => "use fewer points or a lower resolution",
        })
    }
}

/// An amount of memory in bytes, shown in MiB or GiB.
struct Amount(f64);

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 < GIB {
            true => write!(f, "{:.1} MiB", self.0 / MIB),
            false => write!(f, "{:.1} GiB", self.0 / GIB),
        }
    }
}

/// Checks that the reconstruction on `grid` fits into the free memory, where that is known.
///
/// # Errors
/// [`Error::Memory`].
pub fn check_memory<T: Real>(grid: &Grid<T>) -> Result<(), Error> {
    let cells: f64 = grid.shape().iter().map(|&n| n as f64).product();
    let needed = cells * CELL_VALUES * size_of::<T>() as f64;
    Ok(check(MemoryUse::Grid(grid.shape()), needed, 0.0, free)?)
}

/// Checks that the [distance of a mesh](crate::distance::lattice::forward_of_mesh) and the closest faces at every cell of `grid` fit into
/// the free memory, where that is known.
///
/// # Errors
/// The memory that it needs, and the memory that is free.
pub fn check_distance_memory<T: Real>(grid: &Grid<T>) -> Result<(), MemoryError> {
    let cells: f64 = grid.shape().iter().map(|&n| n as f64).product();
    let needed = cells * (size_of::<T>() + size_of::<u32>()) as f64;
    check(MemoryUse::Grid(grid.shape()), needed, 0.0, free)
}

/// Checks that the stages get memory for `points` samples and, in the first call of a plan, for what else they need on
/// its grid. From previous calls the plan holds memory for `held` samples; `is_lean` says that their normals are given,
/// and that no residuals are kept.
///
/// # Errors
/// [`Error::Memory`].
pub(super) fn check_points<T: Real>(
    points: usize,
    held: usize,
    cells: usize,
    is_lean: bool,
) -> Result<(), Error> {
    if points <= held {
        return Ok(());
    }
    let value = size_of::<T>() as f64;
    let cells = if held == 0 { cells as f64 } else { 0.0 };
    let [bytes, values] = match is_large(points) {
        true if is_lean => OF_POINT_GIVEN,
        true => OF_POINT_OF_LARGE,
        false => OF_POINT,
    };
    let untouched = cells * FIRST_CELL_VALUES * value;
    let needed = (points - held) as f64 * (bytes + values * value)
        + cells * (CELL_VALUES - FIRST_CELL_VALUES) * value;
    Ok(check(MemoryUse::Points(points), needed, untouched, free)?)
}

/// Checks that a sparse solve in `blocks` of `grid` fits into the free memory; its coarsest cells are those of the grid, halved
/// `octaves` times.
///
/// # Errors
/// [`Error::Memory`].
pub(super) fn check_blocks<T: Real>(
    grid: &Grid<T>,
    octaves: usize,
    blocks: &Blocks,
) -> Result<(), Error> {
    let coarse: f64 = grid
        .shape()
        .iter()
        .map(|&n| (n >> octaves) as f64)
        .product();
    let values = BLOCK_VALUES * blocks.nodes() as f64 + COARSE_VALUES * coarse;
    let needed = values * size_of::<T>() as f64 + blocks.bytes() as f64;
    Ok(check(MemoryUse::Grid(grid.shape()), needed, 0.0, free)?)
}

/// `untouched` bytes are allocated and not written yet: limits of a process count them already, the machine and its
/// control groups do not.
fn check(
    purpose: MemoryUse,
    needed: f64,
    untouched: f64,
    free: impl FnOnce() -> Option<AvailableMemory>,
) -> Result<(), MemoryError> {
    let Some(available) = free() else {
        return Ok(());
    };
    let needed = match available.limit {
        MemoryLimit::Machine | MemoryLimit::ControlGroup => needed + untouched,
        MemoryLimit::AddressSpace | MemoryLimit::Data => needed,
    };
    match needed > available.bytes {
        true => Err(MemoryError {
            purpose,
            needed,
            available,
        }),
        false => Ok(()),
    }
}

/// Free memory of this process in bytes: on Linux the least of what the machine, the control groups (versions 1 and 2)
/// and the limits of the process leave; on macOS and Windows that of the machine; `None` elsewhere.
pub fn available_memory() -> Option<f64> {
    free().map(|available| available.bytes)
}

#[cfg(target_os = "linux")]
fn free() -> Option<AvailableMemory> {
    linux::free(std::path::Path::new("/"))
}

#[cfg(any(target_os = "macos", windows))]
fn free() -> Option<AvailableMemory> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    Some(AvailableMemory {
        bytes: system.available_memory() as f64,
        limit: MemoryLimit::Machine,
    })
}

#[cfg(not(any(target_os = "linux", target_os = "macos", windows)))]
fn free() -> Option<AvailableMemory> {
    None
}

impl<T: Real> Reconstruction<T> {
    /// Bytes kept for the pullback beside φ, the mesh and the oriented normals: the indicator (the blocks of a sparse one) and the closest face of
    /// every cell, the edges of the vertices, the samples and their areas, and the residuals of the stages at the
    /// samples (search tree, radii, fitted planes, order, values of the indicator, local iso-value).
    pub fn residual_bytes(&self) -> usize {
        let [[neighbors, _], [normals, _]] = self.sample_bytes();
        size_of_val(self.indicator.values())
            + self.sparse.as_ref().map_or(0, Sparse::bytes)
            + size_of_val(self.closest.as_slice())
            + size_of_val(self.mesh.edges())
            + size_of_val(self.points.as_slice())
            + size_of_val(self.given.as_slice())
            + size_of_val(self.areas.as_slice())
            + size_of_val(self.residuals.splat.order.as_slice())
            + size_of_val(self.residuals.iso_value.at_samples.as_slice())
            + (self.residuals.screened.as_ref())
                .map_or(0, |level| size_of_val(level.at_samples.as_slice()))
            + self.residuals.local_level.bytes()
            + self.residuals.thickened.bytes()
            + neighbors
            + normals
    }

    /// Bytes of scratch buffers of the samples that stay with the result for the next call of its plan.
    pub fn work_bytes(&self) -> usize {
        let [[_, neighbors], [_, normals]] = self.sample_bytes();
        neighbors + normals
    }

    fn sample_bytes(&self) -> [[usize; 2]; 2] {
        let residuals = &self.residuals;
        [residuals.neighborhoods.bytes(), residuals.normals.bytes()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, Reconstructor};

    #[test]
    fn a_grid_that_memory_can_not_hold_is_refused_with_what_it_would_take() {
        if available_memory().is_none_or(|free| free > 130.0 * GIB) {
            println!("SKIPPED: 130 GiB are free, or this system does not say how much is");
            return;
        }
        // About as many cells as can be indexed, each of 4.5 values of 8 bytes.
        let grid = Grid::<f64>::new([0.0; 3], 1.0, [1600; 3]).expect("a grid");
        let Err(error) = Reconstructor::new(grid, Options::default()) else {
            panic!("a plan of 137 GiB");
        };
        let text = error.to_string();
        assert!(text.contains("needs about 137.3 GiB"), "{text}");
        assert!(text.contains("lower resolution"), "{text}");
    }

    #[test]
    fn the_error_names_the_purpose_and_the_limit() {
        let text = |purpose, limit| {
            let available = AvailableMemory {
                bytes: 3.0 * MIB,
                limit,
            };
            let enough = check(purpose, 2.9 * MIB, 0.0, || Some(available));
            assert_eq!(enough, Ok(()));
            let error = check(purpose, 2.5 * GIB, 0.0, || Some(available));
            error.expect_err("too little").to_string()
        };
        assert_eq!(
            text(MemoryUse::Points(7), MemoryLimit::ControlGroup),
            "7 points need about 2.5 GiB, and 3.0 MiB are free (in its control group or container); use fewer points or a lower resolution"
        );
        assert_eq!(
            text(MemoryUse::Grid([2, 3, 4]), MemoryLimit::AddressSpace),
            "a grid of [2, 3, 4] cells needs about 2.5 GiB, and 3.0 MiB are free (below the limit of its address space, ulimit -v); use a lower resolution, a larger spacing or tighter bounds"
        );
        assert_eq!(check(MemoryUse::Points(7), f64::MAX, 0.0, || None), Ok(()));
    }

    #[test]
    fn what_is_not_written_yet_counts_where_the_limit_does_not_count_it() {
        let needed = |limit| {
            let available = AvailableMemory { bytes: 5.0, limit };
            let found = check(MemoryUse::Points(7), 4.0, 2.0, || Some(available));
            found.err().map(|error| error.needed)
        };
        assert_eq!(needed(MemoryLimit::Machine), Some(6.0));
        assert_eq!(needed(MemoryLimit::ControlGroup), Some(6.0));
        assert_eq!(needed(MemoryLimit::AddressSpace), None);
        assert_eq!(needed(MemoryLimit::Data), None);
    }

    #[test]
    fn memory_that_a_plan_holds_is_not_asked_for_again() {
        let points = usize::MAX >> 11;
        if available_memory().is_some() {
            check_points::<f32>(points, 0, 8, false).expect_err("more than any machine has");
            check_points::<f32>(9, 0, points, true).expect_err("more than any machine has");
        }
        check_points::<f32>(points, points, points, false).expect("is there");
        check_points::<f32>(points + 1, points, points, true).expect("little is missing");
    }
}
