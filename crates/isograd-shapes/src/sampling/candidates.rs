//! Random points of a surface, distributed by area (times the density) by rejection sampling.

use isograd_element::vector::{norm, normalized};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{Density, SampleError};
use crate::shape::{SurfaceCoordinate, evaluate};
use crate::surface::Surface;

/// Range of the number of cells of all patches, about one per draw.
const CELLS: (usize, usize) = (4_000, 40_000);

/// Largest and smallest number of cells along each side of a patch.
const SIDE: (usize, usize) = (60, 6);

/// Factor from the largest area element at the corners and the center of a cell to the bound for the cell.
/// If a draw exceeds the bound, the sampling is repeated with a larger factor.
const MARGIN: f64 = 1.2;

/// Sampling fails if, after `MIN_DRAWS` draws, fewer than one in `MAX_REJECTION` is accepted.
const MIN_DRAWS: usize = 1 << 20;
const MAX_REJECTION: usize = 1000;

/// A random point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub coordinate: SurfaceCoordinate,
    pub position: [f64; 3],
    pub normal: [f64; 3],
    /// Density relative to its maximum.
    pub density: f64,
}

/// Random points of a surface and the estimated area.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    pub candidates: Vec<Candidate>,
    /// Estimate of `∫ density dA`.
    pub weighted_area: f64,
}

/// A surface divided into cells, with a bound of the area element in each.
///
/// A draw selects a cell with a probability proportional to its bound, and a uniform point in it, which is
/// accepted with the ratio of its area element to the bound. This is unbiased if the bounds hold, which is
/// checked at every draw.
pub(super) struct RejectionSampler<'a> {
    surface: &'a dyn Surface,
    density: Density,
    /// Cells along each side of a patch.
    side: usize,
    /// Largest sampled area element of each cell.
    maxima: Vec<f64>,
    lower: [f64; 3],
    upper: [f64; 3],
}

/// A bound of an area element did not hold.
struct BoundExceeded;

impl<'a> RejectionSampler<'a> {
    /// Tabulates a surface for `n` draws.
    pub fn new(surface: &'a dyn Surface, density: Density, n: usize) -> Self {
        let patches = surface.patches();
        let side = ((n.clamp(CELLS.0, CELLS.1) / patches.max(1)) as f64).sqrt() as usize;
        let mut sampler = Self {
            surface,
            density,
            side: side.clamp(SIDE.1, SIDE.0),
            maxima: Vec::new(),
            lower: [f64::INFINITY; 3],
            upper: [f64::NEG_INFINITY; 3],
        };
        for patch in 0..patches {
            sampler.tabulate(patch);
        }
        sampler
    }

    /// Adds the cells of a patch to the table.
    fn tabulate(&mut self, patch: usize) {
        let side = self.side;
        let corners = self.elements(patch, side + 1, 0.0);
        let centers = self.elements(patch, side, 0.5);
        let first = self.maxima.len();
        for cell in 0..side * side {
            let corner = cell / side * (side + 1) + cell % side;
            let around = [corner, corner + 1, corner + side + 1, corner + side + 2];
            let elements = around.map(|k| corners[k]).into_iter();
            self.maxima.push(elements.fold(centers[cell], f64::max));
        }
        // A cell whose five points are degenerate may still have some area.
        let floor = 1e-3 * self.maxima[first..].iter().copied().fold(0.0, f64::max);
        self.maxima[first..].iter_mut().for_each(|g| *g += floor);
    }

    /// Area elements on a lattice of `count²` points, `offset` cells from the corner of the patch.
    fn elements(&mut self, patch: usize, count: usize, offset: f64) -> Vec<f64> {
        // Away from the edge of the patch, where a map may not be smooth.
        let coordinate =
            |k: usize| ((k as f64 + offset) / self.side as f64).clamp(1e-9, 1.0 - 1e-9);
        let mut elements = Vec::with_capacity(count * count);
        for k in 0..count * count {
            let point = evaluate(
                self.surface,
                patch,
                coordinate(k / count),
                coordinate(k % count),
            );
            for a in 0..3 {
                self.lower[a] = self.lower[a].min(point.position[a]);
                self.upper[a] = self.upper[a].max(point.position[a]);
            }
            let element = norm(point.area_vector());
            elements.push(if element.is_finite() { element } else { 0.0 });
        }
        elements
    }

    /// `n` random points.
    pub fn draw(&self, n: usize, seed: u64) -> Result<Candidates, SampleError> {
        let mut margin = MARGIN;
        // Beyond that almost all draws are rejected.
        while margin < MAX_REJECTION as f64 {
            match self.draw_with(n, seed, margin) {
                Err(BoundExceeded) => margin *= 2.0,
                Ok(drawn) if drawn.candidates.len() == n => return Ok(drawn),
                Ok(_) => break,
            }
        }
        Err(SampleError::NoSurface)
    }

    fn draw_with(&self, n: usize, seed: u64, margin: f64) -> Result<Candidates, BoundExceeded> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut cumulative = Vec::with_capacity(self.maxima.len());
        let mut total = 0.0;
        for bound in &self.maxima {
            total += bound * margin;
            cumulative.push(total);
        }
        let (mut candidates, mut draws) = (Vec::with_capacity(n), 0usize);
        while candidates.len() < n && total > 0.0 {
            if draws >= MIN_DRAWS && candidates.len() < draws / MAX_REJECTION {
                break;
            }
            draws += 1;
            let target = uniform(&mut random) * total;
            let cell = cumulative
                .partition_point(|&b| b <= target)
                .min(cumulative.len() - 1);
            candidates.extend(self.attempt(cell, margin, &mut random)?);
        }
        let acceptance = candidates.len() as f64 / draws.max(1) as f64;
        let cell_area = 1.0 / (self.side * self.side) as f64;
        Ok(Candidates {
            candidates,
            weighted_area: acceptance * total * cell_area,
        })
    }

    /// Draws a random point of a cell; `None` if it is rejected.
    fn attempt(
        &self,
        cell: usize,
        margin: f64,
        random: &mut Pcg64,
    ) -> Result<Option<Candidate>, BoundExceeded> {
        let cells = self.side * self.side;
        let (patch, cell_of_patch) = (cell / cells, cell % cells);
        let side = self.side as f64;
        let u = ((cell_of_patch / self.side) as f64 + uniform(random)) / side;
        let v = ((cell_of_patch % self.side) as f64 + uniform(random)) / side;
        let threshold = uniform(random);
        let point = evaluate(self.surface, patch, u, v);
        let bound = self.maxima[cell] * margin;
        let element = norm(point.area_vector());
        if element > bound {
            return Err(BoundExceeded);
        }
        let density = self.density_at(point.position);
        let (accepted, normal) = (
            threshold * bound < element * density,
            normalized(point.area_vector()),
        );
        let Some(normal) = normal.filter(|_| accepted) else {
            return Ok(None);
        };
        if self.surface.is_union() && !self.surface.exposed(patch, point.position) {
            return Ok(None);
        }
        Ok(Some(Candidate {
            coordinate: SurfaceCoordinate {
                patch: patch as u32,
                u,
                v,
            },
            position: point.position,
            normal,
            density,
        }))
    }

    /// Density at a point, relative to its maximum.
    fn density_at(&self, point: [f64; 3]) -> f64 {
        let Density::Gradient { axis, ratio } = self.density else {
            return 1.0;
        };
        let extent = self.upper[axis] - self.lower[axis];
        let share = ((point[axis] - self.lower[axis]) / extent).clamp(0.0, 1.0);
        if ratio >= 1.0 {
            ratio.powf(share - 1.0)
        } else {
            ratio.powf(share)
        }
    }
}

/// Uniform random number in the open interval (0, 1).
fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 12) as f64 + 0.5) / (1u64 << 52) as f64
}
