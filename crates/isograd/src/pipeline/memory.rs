//! Memory that a reconstruction needs, and memory that it keeps for its pullback.

use super::{Error, Reconstruction};
use crate::{Grid, Real};

/// Largest number of values held at once for each cell: φ, χ, the closest triangles, and the scratch buffers of the
/// Fourier transform and of the distance. Measurements are on the scaling page.
const VALUES: f64 = 4.5;

const GIB: f64 = (1u64 << 30) as f64;

/// Checks that the reconstruction on `grid` fits into the free memory, where the system reports it (Linux).
///
/// # Errors
/// [`Error::Memory`].
pub fn check_memory<T: Real>(grid: &Grid<T>) -> Result<(), Error> {
    let cells: f64 = grid.shape().iter().map(|&n| n as f64).product();
    let needed = cells * VALUES * size_of::<T>() as f64;
    match available_memory() {
        Some(available) if needed > available => Err(Error::Memory {
            shape: grid.shape(),
            needed: needed / GIB,
            available: available / GIB,
        }),
        _ => Ok(()),
    }
}

/// Free memory in bytes on Linux; `None` elsewhere.
pub fn available_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let mut lines = text.lines();
    let line = lines.find(|line| line.starts_with("MemAvailable:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0)
}

impl<T: Real> Reconstruction<T> {
    /// Bytes kept for the pullback beside φ, the mesh and the oriented normals: the indicator and the closest face of
    /// every cell, the edges of the vertices, the samples and their areas, and the residuals of the stages at the
    /// samples (search tree, radii, fitted planes, order, values of the indicator, local iso-value).
    pub fn residual_bytes(&self) -> usize {
        let [[neighbors, _], [normals, _]] = self.sample_bytes();
        size_of_val(self.indicator.values())
            + size_of_val(self.closest.as_slice())
            + size_of_val(self.mesh.edges())
            + size_of_val(self.points.as_slice())
            + size_of_val(self.given.as_slice())
            + size_of_val(self.areas.as_slice())
            + size_of_val(self.residuals.splat.order.as_slice())
            + size_of_val(self.residuals.iso_value.at_samples.as_slice())
            + self.residuals.local_level.bytes()
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
}
