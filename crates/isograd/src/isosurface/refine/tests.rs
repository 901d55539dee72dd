use super::*;
use crate::Mesh;
use crate::neighbors::tests::Random;
use crate::testing::bspline;

/// A step along x, with noise.
fn setting() -> Field<f64> {
    with_noise(1.0)
}

/// A step along x of 1 per cell, with noise from 0 to `noise`.
fn with_noise(noise: f64) -> Field<f64> {
    let grid = Grid::new([-0.3, 0.1, 2.0], 0.25, [25, 14, 9]).expect("a grid");
    let mut random = Random::new(7);
    let value = |n: usize| grid.cell(n)[0] as f64 - 12.2 + noise * random.uniform();
    let values = (0..grid.cells()).map(value).collect();
    Field::new(grid, values).expect("sizes match")
}

/// Weight of a cell at a place, in cells from the corner of the grid: over the cell itself and its image behind each wall.
fn weight(shape: [usize; 3], cell: [usize; 3], place: [f64; 3]) -> f64 {
    let along = |a: usize| {
        let (n, center) = (shape[a] as f64, cell[a] as f64 + 0.5);
        [center, -center, 2.0 * n - center]
            .map(|c| bspline(c - place[a]))
            .iter()
            .sum::<f64>()
    };
    along(0) * along(1) * along(2)
}

/// The spline at a place, in cells from the corner of the grid, as a sum over all cells.
fn spline(chi: &Field<f64>, place: [f64; 3]) -> f64 {
    let part = |o: usize| chi.values()[o] * weight(chi.grid().shape(), chi.grid().cell(o), place);
    (0..chi.grid().cells()).map(part).sum()
}

/// The surface of `chi`.
fn surface(chi: &Field<f64>, level: f64) -> (Grid<f64>, Mesh<f64>) {
    let refined = forward(chi, level, None).expect("a grid");
    let mut mesh = Mesh::default();
    let place = |edge| on_edge(chi, &refined.grid, level, edge);
    crate::isosurface::blocks::forward(&refined, level, &place, &mut mesh).expect("a surface");
    (refined.grid, mesh)
}

#[test]
fn values_are_those_of_the_spline_and_every_crossing_has_them() {
    let (chi, level) = (setting(), 0.1);
    let refined = forward(&chi, level, None).expect("a grid");
    let (shape, fine) = (chi.grid().shape(), refined.grid);
    assert_eq!(fine.shape(), shape.map(|n| 2 * n));
    assert_eq!(fine.spacing(), 0.125);
    let center = |n: usize| fine.cell(n).map(|c| (c as f64 + 0.5) / 2.0);
    let plain: Vec<f64> = (0..fine.cells()).map(|n| spline(&chi, center(n))).collect();
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
fn every_vertex_is_where_the_spline_has_the_level() {
    let (bounded, _) = check_vertices(&setting());
    assert_eq!(bounded, 0);
}

#[test]
fn few_vertices_of_a_rough_surface_have_bounded_odds() {
    let (bounded, vertices) = check_vertices(&with_noise(8.0));
    assert!((1..vertices / 20).contains(&bounded), "{bounded}");
}

/// Every vertex is where the spline has the level, or has the odds that are nearest to that. Returns how many have bounded odds,
/// and how many there are.
fn check_vertices(chi: &Field<f64>) -> (usize, usize) {
    let level = 0.1;
    let (fine, mesh) = surface(chi, level);
    let (mut linear, mut bounded) = (0.0_f64, 0);
    for (vertex, edge) in mesh.vertices().iter().zip(mesh.edges()) {
        let place = chi.grid().to_index(*vertex);
        let start = fine.cell(edge.cell()).map(|c| (c as f64 + 0.5) / 2.0);
        let excess = |fraction: f64| {
            let mut place = start;
            place[edge.axis()] += 0.5 * fraction;
            spline(chi, place) - level
        };
        let [below, above] = [0.0, 1.0].map(excess);
        assert!((below < 0.0) != (above < 0.0));
        let fraction = 2.0 * (place[edge.axis()] - start[edge.axis()]);
        assert!((-1e-12..=1.0 + 1e-12).contains(&fraction));
        let between = below / (below - above);
        linear = linear.max((fraction - between).abs());
        if excess(fraction).abs() < 1e-12 {
            continue;
        }
        // The root is beyond the bound.
        bounded += 1;
        let odds = fraction / (1.0 - fraction) / (between / (1.0 - between));
        let is_most = (odds / 16.0 - 1.0).abs() < 1e-9;
        assert!(is_most || (odds * 16.0 - 1.0).abs() < 1e-9, "{odds}");
        let side = if is_most { below } else { above };
        assert!((excess(fraction) < 0.0) == (side < 0.0));
    }
    // The noise bends the spline.
    assert!(linear > 0.01, "{linear}");
    (bounded, mesh.edges().len())
}

#[test]
fn pullback_is_the_derivative_by_every_cell_the_level_and_the_grid() {
    check_pullback(&setting());
    // Some vertices have bounded odds.
    check_pullback(&with_noise(8.0));
}

fn check_pullback(chi: &Field<f64>) {
    let level = 0.1;
    let (fine, mesh) = surface(chi, level);
    let mut random = Random::new(8);
    let bars: Vec<[f64; 3]> = mesh
        .vertices()
        .iter()
        .map(|_| std::array::from_fn(|_| random.uniform() - 0.5))
        .collect();
    let mut chi_bar = vec![0.0; chi.grid().cells()];
    let found = pullback(chi, level, &fine, &mesh, &bars, &mut chi_bar);
    assert_eq!(found.guarded, 0);
    let loss = |chi: &Field<f64>, level: f64| -> f64 {
        let (_, moved) = surface(chi, level);
        assert_eq!(moved.edges(), mesh.edges());
        let parts = moved.vertices().iter().zip(&bars);
        parts.map(|(v, bar)| crate::vector::dot(*v, *bar)).sum()
    };
    let close = |found: f64, expected: f64, what: &str| {
        let scale = 1.0 + expected.abs();
        assert!(
            (found - expected).abs() < 1e-6 * scale,
            "{what}: {found} {expected}"
        );
    };
    let step = 1e-6;
    for _ in 0..20 {
        let direction: Vec<f64> = chi_bar.iter().map(|_| random.uniform() - 0.5).collect();
        let at = |step: f64| {
            let values = chi.values().iter().zip(&direction);
            let values = values.map(|(chi, d)| chi + step * d).collect();
            loss(
                &Field::new(*chi.grid(), values).expect("sizes match"),
                level,
            )
        };
        let slope: f64 = chi_bar.iter().zip(&direction).map(|(bar, d)| bar * d).sum();
        close(slope, (at(step) - at(-step)) / (2.0 * step), "χ");
    }
    let by_level = (loss(chi, level + step) - loss(chi, level - step)) / (2.0 * step);
    close(found.level, by_level, "level");
    let on = |lower: [f64; 3], spacing: f64| {
        let grid = Grid::new(lower, spacing, chi.grid().shape()).expect("a grid");
        loss(
            &Field::new(grid, chi.values().to_vec()).expect("sizes match"),
            level,
        )
    };
    let (lower, spacing) = (chi.grid().lower(), chi.grid().spacing());
    let by_spacing = (on(lower, spacing + step) - on(lower, spacing - step)) / (2.0 * step);
    close(found.grid.spacing, by_spacing, "spacing");
    for a in 0..3 {
        let moved = |step: f64| {
            let mut lower = lower;
            lower[a] += step;
            on(lower, spacing)
        };
        let by_lower = (moved(step) - moved(-step)) / (2.0 * step);
        close(found.grid.lower[a], by_lower, "lower");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let chi = setting();
    crate::testing::assert_same_bits(|| {
        let (fine, mesh) = surface(&chi, 0.1);
        let mut chi_bar = vec![0.0; chi.grid().cells()];
        let found = pullback(&chi, 0.1, &fine, &mesh, mesh.vertices(), &mut chi_bar);
        (mesh, chi_bar, found)
    });
}
