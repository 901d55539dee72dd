use super::*;
use crate::neighbors::tests::Random;
use crate::testing::bspline;

/// Noise on a grid, a step along x.
fn setting() -> Field<f64> {
    let grid = Grid::new([-0.3, 0.1, 2.0], 0.25, [25, 14, 9]).expect("a grid");
    let mut random = Random::new(7);
    let value = |n: usize| grid.cell(n)[0] as f64 - 12.2 + random.uniform();
    let values = (0..grid.cells()).map(value).collect();
    Field::new(grid, values).expect("sizes match")
}

/// Weight of a cell at a cell half as large: over the cell itself and its image behind each wall.
fn weight(shape: [usize; 3], cell: [usize; 3], fine: [usize; 3]) -> f64 {
    let along = |a: usize| {
        let (n, x) = (shape[a] as f64, (fine[a] as f64 + 0.5) / 2.0);
        let center = cell[a] as f64 + 0.5;
        [center, -center, 2.0 * n - center]
            .map(|c| bspline(c - x))
            .iter()
            .sum::<f64>()
    };
    along(0) * along(1) * along(2)
}

#[test]
fn values_are_those_of_the_spline_and_every_crossing_has_them() {
    let (chi, level) = (setting(), 0.1);
    let refined = forward(&chi, level, None).expect("a grid");
    let (shape, fine) = (chi.grid().shape(), refined.grid);
    assert_eq!(fine.shape(), shape.map(|n| 2 * n));
    assert_eq!(fine.spacing(), 0.125);
    let cells = 0..chi.grid().cells();
    let plain: Vec<f64> = (0..fine.cells())
        .map(|n| {
            let part = |o: usize| chi.values()[o] * weight(shape, chi.grid().cell(o), fine.cell(n));
            cells.clone().map(part).sum()
        })
        .collect();
    let mut absent = 0;
    for n in 0..fine.cells() {
        let cell = fine.cell(n);
        match refined.get(cell) {
            Some(value) => assert!((value - plain[n]).abs() < 1e-13, "{cell:?}"),
            None => absent += 1,
        }
        for axis in 0..3 {
            let mut next = cell;
            next[axis] += 1;
            let crosses = next[axis] < fine.shape()[axis]
                && (plain[n] < level) != (plain[fine.index(next)] < level);
            let both = [cell, next].map(|cell| refined.get(cell).is_some());
            assert!(!crosses || both == [true; 2], "{cell:?}");
        }
    }
    assert!(absent > 0);
}

#[test]
fn pullback_is_the_transpose() {
    let chi = setting();
    let refined = forward(&chi, 0.1, None).expect("a grid");
    let mut random = Random::new(8);
    let mut bars = refined.clone();
    bars.values.fill_with(|| random.uniform() - 0.5);
    // Beyond the grid there are no values.
    for n in 0..bars.values.len() {
        let corner = bars.blocks.corner(n / NODES);
        let at = [n % NODES / EDGE / EDGE, n / EDGE % EDGE, n % EDGE];
        if (0..3).any(|a| corner[a] + at[a] >= bars.grid.shape()[a]) {
            bars.values[n] = 0.0;
        }
    }
    let mut chi_bar = vec![0.0; chi.grid().cells()];
    pullback(&bars, chi.grid(), &mut chi_bar);
    let shape = chi.grid().shape();
    for (o, &found) in chi_bar.iter().enumerate() {
        let part = |n: usize| {
            let fine = bars.grid.cell(n);
            bars.get(fine)
                .map_or(0.0, |bar| bar * weight(shape, chi.grid().cell(o), fine))
        };
        let plain: f64 = (0..bars.grid.cells()).map(part).sum();
        assert!((found - plain).abs() < 1e-12, "{o}: {found} {plain}");
    }
}
