//! Evidence for the sign of an axis: which of its two sides is closer to the open air.
//!
//! Every sample is drawn on a grid as a disc in its tangent plane, as wide as the samples around it are
//! apart, so that thin bodies keep their inside and sparse sampling leaves no holes. Regions of free cells
//! that the discs enclose are matter; cells of the open region count as air in proportion to the directions
//! in which they see out of the grid. A body with a hole in its sampling, which a flood fill alone would classify as
//! air, still has a darker and a brighter side.

use super::disc;
use super::regions::{self, Regions, Walls};
use super::sight::{self, RAYS, STEPS};
use super::visibility::Visibility;
use crate::parallel::{self, CHUNK};
use crate::{simd, vector};

/// Free cells on each side of a body.
const MARGIN: f64 = 3.0;

/// The fewest cells that a grid can have: nothing but margins.
const FEWEST: usize = 216;

/// Planes of the grid drawn by one task, and more than the radius of any disc in cells: what one task draws
/// comes from its own samples and those of the tasks beside it.
const SLAB: usize = 8;

/// Most cells of a row that a disc may cover: the diameter of the largest, and one more.
const LONGEST: usize = 16;

/// A cubic grid around a part of the cloud, in user coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    lower: [f64; 3],
    cell: f64,
    shape: [usize; 3],
}

impl Lattice {
    /// A grid over the box from `low` to `high`, which are finite, with cells of the given size, which is positive;
    /// larger cells where there would be more than `budget` of them, or than 216. Three cells are free around the
    /// box.
    pub fn new(low: [f64; 3], high: [f64; 3], cell: f64, budget: usize) -> Self {
        let count = |cell: f64, a: usize| ((high[a] - low[a]) / cell).ceil() + 2.0 * MARGIN;
        let budget = budget.max(FEWEST);
        // At most 15,000 steps from the least positive number to the greatest.
        let mut cell = cell.max(f64::MIN_POSITIVE);
        while count(cell, 0) * count(cell, 1) * count(cell, 2) > budget as f64 {
            cell *= 1.1;
        }
        Self {
            lower: low.map(|x| x - MARGIN * cell),
            cell,
            shape: [0, 1, 2].map(|a| count(cell, a) as usize),
        }
    }

    /// Position in cells, kept inside the grid.
    fn place(&self, point: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|a| {
            let x = ((point[a] - self.lower[a]) / self.cell) as f32;
            disc::inside(x, self.shape[a] as f32)
        })
    }

    fn size(&self) -> usize {
        self.shape.iter().product()
    }
}

/// A sample on the grid; lengths in cells.
#[derive(Clone, Copy, Debug, Default)]
struct Disc {
    center: [f32; 3],
    axis: [f32; 3],
    radius: f32,
    /// Half its thickness: the least that no path through cell faces gets through.
    half: f32,
}

/// First free cell along a ray.
#[derive(Clone, Copy, Debug)]
struct FirstFree {
    /// The cell, and the number of steps to it.
    cell: usize,
    region: u32,
    steps: usize,
}

/// Evidence of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideEvidence {
    /// The evidence, in −1..1: positive where the axis points into the air.
    pub evidence: f32,
    /// The light in front, along the axis, and behind: −1 in matter, up to 1 in the open air.
    pub light: [f32; 2],
}

/// The grid of occupied cells, its regions and their visibility: scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct Fill {
    discs: Vec<Disc>,
    by_slab: Vec<Vec<u32>>,
    occupied: Vec<u8>,
    regions: Regions,
    visibility: Visibility,
    sides: Vec<i8>,
    evidence: Vec<SideEvidence>,
}

impl Fill {
    /// Evidence for each member: `sample(m)` returns its position, axis (of unit length, or zero) and reach in user
    /// units, all finite.
    pub fn run(
        &mut self,
        lattice: &Lattice,
        members: usize,
        sample: impl Fn(usize) -> ([f64; 3], [f32; 3], f64) + Sync,
    ) {
        parallel::fill_large(&mut self.discs, members, &|m| {
            let (point, axis, reach) = sample(m);
            Disc::new(lattice.place(point), axis, (reach / lattice.cell) as f32)
        });
        self.draw(lattice);
        let (occupied, shape) = (&self.occupied, lattice.shape);
        let (regions, visibility) = (&mut self.regions, &mut self.visibility);
        parallel::join(
            || regions.find(occupied, shape),
            || visibility.compute(occupied, shape),
        );
        self.classify_regions(lattice);
        self.compare_sides(lattice);
    }

    /// `(members,)`: evidence of each member of the last run.
    pub fn evidence(&self) -> &[SideEvidence] {
        &self.evidence
    }

    /// Marks the cells that the discs cover.
    fn draw(&mut self, lattice: &Lattice) {
        let [nx, ny, nz] = lattice.shape;
        self.by_slab
            .resize(nx.div_ceil(SLAB).max(self.by_slab.len()), Vec::new());
        self.by_slab.iter_mut().for_each(Vec::clear);
        for (m, disc) in (0u32..).zip(&self.discs) {
            self.by_slab[disc.center[0] as usize / SLAB].push(m);
        }
        self.occupied.clear();
        self.occupied.resize(lattice.size(), 0);
        let (discs, by_slab) = (&self.discs, &self.by_slab);
        let slabs = self.occupied.chunks_mut(SLAB * ny * nz);
        let arch = pulp::Arch::new();
        parallel::each(slabs, |slab, cells| {
            let nearby = slab.saturating_sub(1)..(slab + 2).min(by_slab.len());
            simd::vectorized!(arch, {
                for nearby in &by_slab[nearby.clone()] {
                    for &m in nearby {
                        discs[m as usize].draw(slab * SLAB, [ny, nz], cells);
                    }
                }
            });
        });
    }

    /// Air or matter, for each region.
    fn classify_regions(&mut self, lattice: &Lattice) {
        let between = |disc: &Disc| {
            let front = self.first_free(lattice, disc.center, disc.axis)?;
            let back = self.first_free(lattice, disc.center, disc.axis.map(|a| -a))?;
            let [a, b] = [front.region, back.region];
            (a != b).then_some((a.min(b), a.max(b)))
        };
        let walls = parallel::map_each(self.discs.chunks(CHUNK), |_, discs| {
            Walls::of(discs.iter().filter_map(between))
        });
        regions::sides(self.regions.len, Walls::sum(walls), &mut self.sides);
    }

    /// The evidence of each disc: light on one side less light on the other, over a cone of directions.
    fn compare_sides(&mut self, lattice: &Lattice) {
        let mut all = std::mem::take(&mut self.evidence);
        parallel::fill_large(&mut all, self.discs.len(), &|m| {
            self.compare(lattice, &self.discs[m])
        });
        self.evidence = all;
    }

    fn compare(&self, lattice: &Lattice, disc: &Disc) -> SideEvidence {
        let light = |direction: [f32; 3]| {
            self.first_free(lattice, disc.center, direction)
                .map_or(0.0, |sight| self.light(&sight))
        };
        let pair = |direction: [f32; 3]| light(direction) - light(direction.map(|d| -d));
        let tangents = vector::tangents(disc.axis).unwrap_or_default();
        let ends = [light(disc.axis), light(disc.axis.map(|a| -a))];
        let mut sum = sight::along_axis(ends[0], ends[1]);
        for tangent in tangents {
            sum += pair(vector::add(disc.axis, tangent));
            sum += pair(vector::sub(disc.axis, tangent));
        }
        SideEvidence {
            evidence: sight::evidence(sum),
            light: ends,
        }
    }

    /// Light in the cell that a ray meets: −1 in matter, up to 1 in the open air, less for a longer way.
    fn light(&self, sight: &FirstFree) -> f32 {
        let light = match self.sides[sight.region as usize] {
            // Region 0 is the open air; other air is a cavity, from which nothing leads out.
            1 if sight.region == 0 => {
                sight::open_air(f32::from(self.visibility.free(sight.cell)), RAYS as f32)
            }
            side => f32::from(side),
        };
        sight::dimmed(light, sight.steps as f32, STEPS as f32)
    }

    fn first_free(
        &self,
        lattice: &Lattice,
        from: [f32; 3],
        direction: [f32; 3],
    ) -> Option<FirstFree> {
        let [nx, ny, nz] = lattice.shape;
        for steps in 0..STEPS {
            let at = vector::add(
                from,
                vector::scale(direction, sight::distance(steps as f32)),
            );
            let [x, y, z] = at.map(|x| x.max(0.0) as usize);
            let (x, y, z) = (x.min(nx - 1), y.min(ny - 1), z.min(nz - 1));
            let cell = (x * ny + y) * nz + z;
            if self.occupied[cell] == 0 {
                let region = self.regions.at(x * ny + y, z)?;
                return Some(FirstFree {
                    cell,
                    region,
                    steps,
                });
            }
        }
        None
    }
}

impl Disc {
    fn new(center: [f32; 3], axis: [f32; 3], reach: f32) -> Self {
        Self {
            center,
            axis,
            radius: disc::radius(reach),
            half: disc::half(axis[0], axis[1], axis[2]),
        }
    }

    /// Marks the cells whose center is in the disc, and the cell of its own center, in the planes from
    /// `first_plane` on that `cells` holds.
    #[inline(always)]
    fn draw(&self, first_plane: usize, [ny, nz]: [usize; 2], cells: &mut [u8]) {
        let planes = first_plane..first_plane + cells.len() / (ny * nz);
        let own = self.center.map(|c| c as usize);
        if planes.contains(&own[0]) {
            cells[((own[0] - first_plane) * ny + own[1]) * nz + own[2]] = 1;
        }
        let span = |a: usize, low: usize, high: usize| {
            let first = (self.center[a] - self.radius).max(0.0) as usize;
            let last = (self.center[a] + self.radius) as usize + 1;
            first.max(low)..last.min(high)
        };
        for x in span(0, planes.start, planes.end) {
            for y in span(1, 0, ny) {
                let row = ((x - first_plane) * ny + y) * nz;
                let along = span(2, 0, nz);
                let covered = self.covers([x, y, along.start]);
                let cells = &mut cells[row + along.start..row + along.end];
                for (cell, covered) in cells.iter_mut().zip(covered) {
                    *cell |= covered;
                }
            }
        }
    }

    /// 1 for each cell of a row, from the first on, that is covered.
    #[inline(always)]
    fn covers(&self, [x, y, first]: [usize; 3]) -> [u8; LONGEST] {
        let [ax, ay, az] = self.axis;
        let d = |a: usize, i: usize| i as f32 + 0.5 - self.center[a];
        let (dx, dy) = (d(0, x), d(1, y));
        let mut covered = [0; LONGEST];
        for (k, covered) in covered.iter_mut().enumerate() {
            let dz = d(2, first + k);
            let square = dx * dx + dy * dy + dz * dz;
            let height = dx * ax + dy * ay + dz * az;
            *covered = u8::from(disc::covers(square, height, self.half, self.radius));
        }
        covered
    }
}
