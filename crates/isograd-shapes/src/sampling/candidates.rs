//! Random points of a surface, each place as likely as its area (times the density wanted).

use isograd_element::vector::{norm, normalized};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{Density, SampleError};
use crate::shape::{SurfaceCoordinate, evaluate};
use crate::surface::Surface;

/// Cells of the table, all patches together: about one for each draw, at least and at most.
const CELLS: (usize, usize) = (4_000, 40_000);

/// Cells along each side of a patch, at most and at least.
const SIDE: (usize, usize) = (60, 6);

/// How far the area element may exceed the greatest that was seen at the corners and the center of a
/// cell. Where a draw exceeds it all the same, the margin is raised and all begins again.
const MARGIN: f64 = 1.2;

/// The surface is given up when fewer than one in `PATIENCE` of this many draws or more are taken.
const TRIAL: usize = 1 << 20;
const PATIENCE: usize = 1000;

/// A random point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub coordinate: SurfaceCoordinate,
    pub position: [f64; 3],
    pub normal: [f64; 3],
    /// Density wanted here, relative to the greatest.
    pub density: f64,
}

/// Random points of a surface and what was learned by drawing them.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    pub candidates: Vec<Candidate>,
    /// Estimate of `∫ density dA`.
    pub weighted_area: f64,
}

/// A surface cut into cells, with a bound of the area element in each.
///
/// A draw takes a cell as often as its bound says and a point in it, and accepts it as often as its
/// area element says: unbiased as long as the bounds hold, which is checked at every draw.
pub(super) struct Source<'a> {
    surface: &'a dyn Surface,
    density: Density,
    /// Cells along each side of a patch.
    side: usize,
    /// Greatest area element seen in each cell.
    greatest: Vec<f64>,
    lower: [f64; 3],
    upper: [f64; 3],
}

/// A bound of an area element did not hold.
struct BoundExceeded;

impl<'a> Source<'a> {
    /// A table that suits `n` draws.
    pub fn new(surface: &'a dyn Surface, density: Density, n: usize) -> Self {
        let patches = surface.patches();
        let side = ((n.clamp(CELLS.0, CELLS.1) / patches.max(1)) as f64).sqrt() as usize;
        let mut source = Self {
            surface,
            density,
            side: side.clamp(SIDE.1, SIDE.0),
            greatest: Vec::new(),
            lower: [f64::INFINITY; 3],
            upper: [f64::NEG_INFINITY; 3],
        };
        for patch in 0..patches {
            source.tabulate(patch);
        }
        source
    }

    /// Adds the cells of a patch to the table.
    fn tabulate(&mut self, patch: usize) {
        let side = self.side;
        let corners = self.elements(patch, side + 1, 0.0);
        let centers = self.elements(patch, side, 0.5);
        let first = self.greatest.len();
        for cell in 0..side * side {
            let corner = cell / side * (side + 1) + cell % side;
            let around = [corner, corner + 1, corner + side + 1, corner + side + 2];
            let seen = around
                .map(|k| corners[k])
                .into_iter()
                .fold(centers[cell], f64::max);
            self.greatest.push(seen);
        }
        // A cell where the map degenerates at all five points still has some area.
        let floor = 1e-3 * self.greatest[first..].iter().copied().fold(0.0, f64::max);
        self.greatest[first..].iter_mut().for_each(|g| *g += floor);
    }

    /// Area elements on a lattice of `count²` points, `offset` cells from the corner of the patch.
    fn elements(&mut self, patch: usize, count: usize, offset: f64) -> Vec<f64> {
        // Off the very edge of the patch, where a map may not be smooth.
        let place = |k: usize| ((k as f64 + offset) / self.side as f64).clamp(1e-9, 1.0 - 1e-9);
        let mut elements = Vec::with_capacity(count * count);
        for k in 0..count * count {
            let point = evaluate(self.surface, patch, place(k / count), place(k % count));
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
    pub fn draw(&self, n: usize, seed: u64) -> Result<Drawn, SampleError> {
        let mut margin = MARGIN;
        // Beyond that next to no draw is taken.
        while margin < PATIENCE as f64 {
            match self.draw_with(n, seed, margin) {
                Err(BoundExceeded) => margin *= 2.0,
                Ok(drawn) if drawn.candidates.len() == n => return Ok(drawn),
                Ok(_) => break,
            }
        }
        Err(SampleError::NoSurface)
    }

    fn draw_with(&self, n: usize, seed: u64, margin: f64) -> Result<Drawn, BoundExceeded> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut below = Vec::with_capacity(self.greatest.len());
        let mut total = 0.0;
        for bound in &self.greatest {
            total += bound * margin;
            below.push(total);
        }
        let (mut candidates, mut draws) = (Vec::with_capacity(n), 0usize);
        while candidates.len() < n && total > 0.0 {
            if draws >= TRIAL && candidates.len() < draws / PATIENCE {
                break;
            }
            draws += 1;
            let target = uniform(&mut random) * total;
            let cell = below.partition_point(|&b| b <= target).min(below.len() - 1);
            candidates.extend(self.attempt(cell, margin, &mut random)?);
        }
        let share = candidates.len() as f64 / draws.max(1) as f64;
        let cell_area = 1.0 / (self.side * self.side) as f64;
        Ok(Drawn {
            candidates,
            weighted_area: share * total * cell_area,
        })
    }

    /// One random point of a cell, or none if it is turned down.
    fn attempt(
        &self,
        cell: usize,
        margin: f64,
        random: &mut Pcg64,
    ) -> Result<Option<Candidate>, BoundExceeded> {
        let (patch, place) = (
            cell / (self.side * self.side),
            cell % (self.side * self.side),
        );
        let side = self.side as f64;
        let u = ((place / self.side) as f64 + uniform(random)) / side;
        let v = ((place % self.side) as f64 + uniform(random)) / side;
        let lot = uniform(random);
        let point = evaluate(self.surface, patch, u, v);
        let bound = self.greatest[cell] * margin;
        let element = norm(point.area_vector());
        if element > bound {
            return Err(BoundExceeded);
        }
        let density = self.density_at(point.position);
        let (accepted, normal) = (
            lot * bound < element * density,
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

    /// Density wanted at a point, relative to the greatest.
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

/// A number in the open interval from 0 to 1.
fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 12) as f64 + 0.5) / (1u64 << 52) as f64
}
