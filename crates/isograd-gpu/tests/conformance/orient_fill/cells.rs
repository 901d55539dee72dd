//! Regions and sky of grids of cells.

use cubecl::prelude::Runtime;
use isograd_gpu::Device;
use isograd_gpu::orient::auto::fill::Occupied;
use isograd_gpu::orient::auto::fill::regions::{NO_REGION, Regions};
use isograd_gpu::orient::auto::fill::sky::Sky;

use crate::devices::{Numbers, on_each_device};

/// Occupied cells (1) and free ones (0).
struct Cells {
    name: &'static str,
    shape: [usize; 3],
    occupied: Vec<u8>,
}

impl Cells {
    fn new(
        name: &'static str,
        shape: [usize; 3],
        mut occupied: impl FnMut([usize; 3]) -> bool,
    ) -> Self {
        let cells = (0..shape.iter().product()).map(|c| u8::from(occupied(place(c, shape))));
        Self {
            name,
            shape,
            occupied: cells.collect(),
        }
    }

    fn random(shape: [usize; 3], share: f64, seed: u64) -> Self {
        let mut numbers = Numbers(seed);
        Self::new("random", shape, |_| numbers.unit() < share)
    }

    /// The cell a step away, if it is in the grid.
    fn beside(&self, cell: usize, step: [i64; 3]) -> Option<usize> {
        let at = place(cell, self.shape);
        let mut index = 0;
        for a in 0..3 {
            let x = at[a] as i64 + step[a];
            if !(0..self.shape[a] as i64).contains(&x) {
                return None;
            }
            index = index * self.shape[a] + x as usize;
        }
        Some(index)
    }

    fn upload<R: Runtime>(&self, device: &Device<R>) -> Occupied {
        let occupied = Occupied::from_cells(device, &self.occupied, self.shape).unwrap();
        assert_eq!(occupied.cells(device).unwrap(), self.occupied);
        occupied
    }

    /// A flood from each cell that no flood has reached yet.
    fn regions(&self) -> (Vec<u32>, usize) {
        let mut regions = vec![NO_REGION; self.occupied.len()];
        let mut count = 0;
        for first in 0..self.occupied.len() {
            if self.occupied[first] == 1 || regions[first] != NO_REGION {
                continue;
            }
            regions[first] = count;
            let mut open = vec![first];
            while let Some(cell) = open.pop() {
                for k in 0..6 {
                    let mut step = [0; 3];
                    step[k / 2] = 2 * (k as i64 % 2) - 1;
                    let Some(next) = self.beside(cell, step) else {
                        continue;
                    };
                    if self.occupied[next] == 0 && regions[next] == NO_REGION {
                        regions[next] = count;
                        open.push(next);
                    }
                }
            }
            count += 1;
        }
        (regions, count as usize)
    }

    /// A march along each ray.
    fn sky(&self) -> Vec<u32> {
        let steps = (0..27).map(|k: i64| [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1]);
        let steps: Vec<[i64; 3]> = steps.filter(|step| *step != [0; 3]).collect();
        let escapes = |cell: usize, step: &[i64; 3]| {
            let mut here = Some(cell);
            while let Some(cell) = here {
                if self.occupied[cell] == 1 {
                    return false;
                }
                here = self.beside(cell, *step);
            }
            true
        };
        let free = |cell| steps.iter().filter(|step| escapes(cell, step)).count() as u32;
        (0..self.occupied.len()).map(free).collect()
    }
}

fn place(cell: usize, [_, ny, nz]: [usize; 3]) -> [usize; 3] {
    [cell / (ny * nz), cell / nz % ny, cell % nz]
}

/// One corridor, one cell wide, through the whole grid: along one axis, then back along it beside a wall, and so on,
/// then back through the next layer. `order` says which axis is the first, the second, the third.
fn serpentine(shape: [usize; 3], order: [usize; 3]) -> Cells {
    Cells::new("serpentine", shape, |at| {
        let [u, v, w] = order.map(|a| at[a]);
        let [nu, nv, _] = order.map(|a| shape[a]);
        let lanes = nv - (nv + 1) % 2;
        let end = |k: usize, last: usize| if (k / 2).is_multiple_of(2) { last } else { 0 };
        match (v % 2, w % 2) {
            (0, 0) => v >= lanes,
            (1, 0) => v >= lanes || u != (if v / 2 % 2 == 0 { nu - 1 } else { 0 }),
            // A layer ends where its last lane does, and the next one begins there and goes back.
            _ => {
                let exit = if (lanes / 2) % 2 == 0 { nu - 1 } else { 0 };
                let corner = (end(w, lanes - 1), if w / 2 % 2 == 0 { exit } else { 0 });
                (v, u) != corner
            }
        }
    })
}

/// Shapes whose rows end within a word, at its end and in the next; and with axes of one cell.
fn grids() -> Vec<Cells> {
    let mut grids = Vec::new();
    for (k, shape) in [
        [5, 7, 9],
        [9, 4, 31],
        [6, 11, 32],
        [4, 5, 33],
        [3, 17, 64],
        [2, 3, 150],
        [1, 1, 97],
        [1, 40, 1],
        [30, 1, 1],
        [50, 1, 3],
        [1, 1, 1],
        [70, 3, 40],
        [26, 27, 28],
    ]
    .into_iter()
    .enumerate()
    {
        for share in [0.0, 0.03, 0.3, 0.6, 1.0] {
            grids.push(Cells::random(shape, share, k as u64));
        }
    }
    for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        grids.push(serpentine([21, 24, 71], order));
    }
    grids.push(Cells::new("checkers", [9, 10, 66], |[x, y, z]| {
        (x + y + z) % 2 == 1
    }));
    grids.push(Cells::new("shells", [41, 39, 70], |at| {
        let from_wall = |a: usize| at[a].min([40, 38, 69][a] - at[a]);
        from_wall(0).min(from_wall(1)).min(from_wall(2)) % 4 == 3
    }));
    grids
}

#[test]
fn regions_are_those_of_a_plain_flood() {
    on_each_device!(check_regions);
}

fn check_regions<R: Runtime>(device: &Device<R>) {
    let mut most = 0;
    for grid in grids() {
        let occupied = grid.upload(device);
        let (expected, count) = grid.regions();
        for _ in 0..2 {
            let regions = Regions::find(device, &occupied).unwrap();
            assert_eq!(regions.count(device).unwrap(), count, "{}", grid.name);
            let found = regions.of_cells(device, &occupied).unwrap();
            let found = device.download(&found).unwrap();
            assert!(found == expected, "{} {:?}", grid.name, grid.shape);
        }
        if grid.name == "serpentine" {
            assert_eq!(count, 1);
        }
        most = most.max(count);
    }
    assert!(most > 1000);
}

#[test]
fn the_sky_is_what_a_march_along_rays_finds() {
    on_each_device!(check_sky);
}

fn check_sky<R: Runtime>(device: &Device<R>) {
    for grid in grids() {
        let occupied = grid.upload(device);
        let sky = Sky::new(device, &occupied).unwrap();
        let found = sky.of_cells(device, &occupied).unwrap();
        assert!(
            device.download(&found).unwrap() == grid.sky(),
            "{} {:?}",
            grid.name,
            grid.shape
        );
    }
}

#[test]
fn a_grid_that_is_too_large_or_has_other_cells_is_refused() {
    on_each_device!(check_refused);
}

fn check_refused<R: Runtime>(device: &Device<R>) {
    for (cells, shape) in [(24, [2, 3, 5]), (0, [1 << 20; 3]), (8, [usize::MAX; 3])] {
        assert!(Occupied::from_cells(device, &vec![0; cells], shape).is_err());
    }
}
