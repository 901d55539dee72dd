use std::sync::Arc;

use super::Random;
use crate::data::blocks::{BlockField, Marks};
use crate::data::cells::Cells;
use crate::distance::lattice::{Band, NO_TRIANGLE, Scratch, forward_on};
use crate::testing::assert_same_bits;
use crate::vector::{norm, sub};
use crate::{Field, Grid, Mesh, isosurface};

/// Cells of the indicator along x, y and z; φ has half of them.
const FINE: [usize; 3] = [160, 96, 64];
/// Blocks contain at least so many cells on each side of the surface.
const REACH: f64 = 2.0;
/// Cells of φ in the band.
const BAND: f64 = 1.5;

/// The unit is a cell of the indicator. Negative inside of: all that is below a plane `x = wall`, and two thick shells, one
/// with a ball in its cavity.
fn bodies(seed: u64) -> impl Fn([f64; 3]) -> f64 {
    let mut random = Random::new(seed);
    let wall = 17.0 + 2.0 * random.signed();
    let centers = [
        random.near([62.0, 60.0, 32.0], 1.5),
        random.near([126.0, 58.0, 32.0], 1.5),
    ];
    let outer = [24.0, 22.0].map(|r| r + random.signed());
    let cavity = [9.0, 14.0].map(|r| r + random.signed());
    let ball = 4.0 + random.signed();
    move |p| {
        let far = centers.map(|c| norm(sub(p, c)));
        let shell = |k: usize| (far[k] - outer[k]).max(cavity[k] - far[k]);
        let all = [p[0] - wall, shell(0), shell(1), far[1] - ball];
        all.into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// The indicator at every cell, and in blocks near its surface.
fn indicators(seed: u64) -> (Field<f64>, BlockField<f64>) {
    let grid = Grid::new([0.0; 3], 1.0, FINE).expect("valid");
    let body = bodies(seed);
    let values: Vec<f64> = (0..grid.cells())
        .map(|index| body(grid.center_f64(grid.cell(index))))
        .collect();
    let mut marks = Marks::new(FINE);
    for (index, value) in values.iter().enumerate() {
        if value.abs() < REACH {
            let cell = grid.cell(index).map(|c| c as isize);
            marks.mark(cell, cell);
        }
    }
    let mut blocks = BlockField::zeros(grid, Arc::new(marks.build()));
    for (index, &value) in values.iter().enumerate() {
        if let Some(place) = blocks.blocks.place(grid.cell(index)) {
            blocks.values[place] = value;
        }
    }
    (Field::new(grid, values).expect("a value per cell"), blocks)
}

fn solve(mesh: &Mesh<f64>, chi: Cells<'_, f64>) -> (Vec<f64>, Vec<u32>) {
    let grid = Grid::new([0.0; 3], 2.0, FINE.map(|n| n / 2)).expect("valid");
    let (mut phi, mut closest) = (Field::zeros(grid), Vec::new());
    let (band, mut scratch) = (Band::Within(2.0 * BAND), Scratch::default());
    forward_on(
        mesh,
        chi,
        0.0,
        band,
        &mut scratch,
        &mut phi,
        Some(&mut closest),
    )
    .expect("a mesh");
    (phi.values().to_vec(), closest)
}

/// Numbers of planes and of rows in other planes that are wholly beyond the band.
fn beyond(closest: &[u32]) -> [usize; 2] {
    let [_, ny, nz] = FINE.map(|n| n / 2);
    let is_beyond = |cells: &[u32]| cells.iter().all(|&face| face == NO_TRIANGLE);
    let (beyond, reached): (Vec<&[u32]>, _) =
        closest.chunks(ny * nz).partition(|plane| is_beyond(plane));
    let rows = reached.iter().flat_map(|plane: &&[u32]| plane.chunks(nz));
    [beyond.len(), rows.filter(|row| is_beyond(row)).count()]
}

#[test]
fn signs_carried_across_planes_rows_and_cavities_beyond_the_band_are_the_dense_ones() {
    for seed in 1..=5 {
        let (dense, blocks) = indicators(seed);
        assert!(
            2 * blocks.blocks.nodes() < dense.values().len(),
            "seed {seed}: blocks leave much of the grid out"
        );
        let mut mesh = Mesh::default();
        isosurface::blocks::forward(
            &blocks,
            0.0,
            &|edge| isosurface::blocks::linear(&blocks, 0.0, edge),
            &mut mesh,
        )
        .expect("a surface");
        let (expected, _) = solve(&mesh, (&dense).into());
        let (found, closest) = solve(&mesh, (&blocks).into());
        let [planes, rows] = beyond(&closest);
        assert!(planes > 4 && rows > 100, "seed {seed}: {planes} {rows}");
        let side = |phi: f64| phi < 0.0;
        let far = |inside| {
            let cells = closest.iter().zip(&expected);
            let is = |&(&face, &phi): &(&u32, &f64)| face == NO_TRIANGLE && side(phi) == inside;
            cells.filter(is).count()
        };
        assert!(far(true) > 1000 && far(false) > 1000, "seed {seed}");
        for (index, (&a, &b)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(side(a), side(b), "seed {seed}, cell {index}: {a}, not {b}");
        }
        assert_same_bits(|| solve(&mesh, (&blocks).into()));
    }
}
