//! The grid's parts against plain versions.

use super::regions::{Regions, Walls, sides};
use super::shapes::Random;
use super::visibility::Visibility;

fn random_cells(shape: [usize; 3], share: f64, seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    (0..shape.iter().product())
        .map(|_| u8::from(random.unit() < share))
        .collect()
}

fn cells([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nx * ny * nz).map(move |c| [c / (ny * nz), c / nz % ny, c % nz])
}

/// The cell `step` away, or `None` outside the grid.
fn neighbor(cell: [usize; 3], step: [i64; 3], shape: [usize; 3]) -> Option<[usize; 3]> {
    let at = [0, 1, 2].map(|a| cell[a] as i64 + step[a]);
    let inside = (0..3).all(|a| (0..shape[a] as i64).contains(&at[a]));
    inside.then(|| at.map(|x| x as usize))
}

#[test]
fn visibility_agrees_with_rays() {
    let mut visibility = Visibility::default();
    for (shape, share) in [
        ([5, 7, 9], 0.1),
        ([9, 4, 6], 0.4),
        ([1, 1, 3], 0.3),
        ([6, 6, 1], 0.2),
    ] {
        let occupied = random_cells(shape, share, 21);
        let at = |[x, y, z]: [usize; 3]| (x * shape[1] + y) * shape[2] + z;
        visibility.compute(&occupied, shape);
        for cell in cells(shape) {
            let escapes = |step: [i64; 3]| {
                let mut place = Some(cell);
                while let Some(here) = place {
                    if occupied[at(here)] != 0 {
                        return false;
                    }
                    place = neighbor(here, step, shape);
                }
                true
            };
            let steps = (0..27).map(|k| [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1]);
            let seen = steps.filter(|&s| s != [0; 3] && escapes(s)).count();
            assert_eq!(
                usize::from(visibility.free(at(cell))),
                seen,
                "{cell:?} of {shape:?}"
            );
        }
    }
}

#[test]
fn regions_are_those_of_a_plain_flood() {
    let mut regions = Regions::default();
    for (seed, shape) in [(3, [6, 7, 8]), (4, [8, 3, 5]), (5, [4, 9, 9])] {
        let mut occupied = random_cells(shape, 0.55, seed);
        occupied[0] = 0;
        regions.find(&occupied, shape);
        let at = |[x, y, z]: [usize; 3]| (x * shape[1] + y) * shape[2] + z;
        let mut plain = vec![u32::MAX; occupied.len()];
        let mut count = 0;
        for start in cells(shape) {
            if occupied[at(start)] != 0 || plain[at(start)] != u32::MAX {
                continue;
            }
            let mut open = vec![start];
            while let Some(cell) = open.pop() {
                if occupied[at(cell)] != 0 || plain[at(cell)] != u32::MAX {
                    continue;
                }
                plain[at(cell)] = count;
                for a in 0..3 {
                    for direction in [-1, 1] {
                        let mut step = [0; 3];
                        step[a] = direction;
                        open.extend(neighbor(cell, step, shape));
                    }
                }
            }
            count += 1;
        }
        // Both number regions in the order of their first cell.
        assert_eq!(regions.len, count as usize);
        for cell in cells(shape) {
            let expected = (occupied[at(cell)] == 0).then_some(plain[at(cell)]);
            assert_eq!(
                regions.at(cell[0] * shape[1] + cell[1], cell[2]),
                expected,
                "{cell:?}"
            );
        }
    }
}

#[test]
fn air_and_matter_alternate_across_the_stronger_walls() {
    // Air 0, shell 1, its cavity 2, a ball in the cavity 3; region 4 touches nothing; a leaky few
    // samples see the cavity straight from outside.
    let samples = [
        vec![(0, 1); 50],
        vec![(1, 2); 30],
        vec![(2, 3); 10],
        vec![(0, 2); 3],
    ]
    .concat();
    let parts = samples.chunks(7);
    let parts = parts.map(|part| Walls::of(part.iter().copied()));
    let mut found = Vec::new();
    sides(5, Walls::sum(parts.collect()), &mut found);
    assert_eq!(found, [1, -1, 1, -1, 0]);
}

#[test]
fn a_grid_without_a_free_cell_has_no_sides() {
    let mut regions = Regions::default();
    regions.find(&[1; 24], [2, 3, 4]);
    let mut found = vec![1];
    sides(regions.len, Walls::default(), &mut found);
    assert_eq!((regions.len, found.len()), (0, 0));
}
