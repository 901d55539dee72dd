use super::*;

fn grid(shape: [usize; 3]) -> Grid<f64> {
    Grid::new([0.1, -0.2, 0.3], 0.05, shape).expect("valid")
}

fn refined(shape: [usize; 3], factor: f64, margin: f64) -> Grid<f64> {
    let surface = SurfaceResolution::Factor(factor);
    let found = surface.grid_and_octaves(&grid(shape), f64::NAN, Solve::Dense, margin);
    found.expect("fits").0
}

#[test]
fn a_refined_grid_fills_the_same_box_with_cubes_at_least_as_fine() {
    for shape in [[128, 64, 32], [338, 120, 151], [60, 48, 36], [97, 97, 97]] {
        let coarse = grid(shape);
        for factor in [1.0, 1.2, 1.5, 2.0, 3.0] {
            let fine = refined(shape, factor, 0.0);
            let ratio = coarse.spacing() / fine.spacing();
            assert!(ratio >= factor * (1.0 - 1e-9), "{shape:?} {factor} {ratio}");
            assert_eq!(fine.lower(), coarse.lower());
            for (a, b) in fine.upper().into_iter().zip(coarse.upper()) {
                assert!((a - b).abs() < 1e-12, "{shape:?} {factor}");
            }
        }
    }
}

#[test]
fn a_grid_that_may_end_beyond_the_box_has_cells_as_asked_for_and_comes_of_its_own_ratio() {
    for shape in [[128, 64, 32], [338, 120, 151], [63, 256, 90], [12, 97, 45]] {
        let coarse = grid(shape);
        for factor in [1.0, 1.25, 1.5, 1.85, 2.0, 3.0, 3.3] {
            let fine = refined(shape, factor, 10.0);
            let ratio = coarse.spacing() / fine.spacing();
            let range = factor * (1.0 - 1e-9)..1.2 * factor;
            assert!(range.contains(&ratio), "{shape:?} {factor} {ratio}");
            assert_eq!(fine.lower(), coarse.lower());
            for (a, b) in fine.shape().into_iter().zip(shape) {
                let (side, box_side) = (a as f64 / ratio, b as f64);
                let range = box_side - 1e-9..1.15 * box_side;
                assert!(range.contains(&side), "{shape:?} {factor} {side}");
            }
            let again = refined(shape, ratio, 10.0);
            assert_eq!(again.shape(), fine.shape(), "{factor}");
        }
    }
}

#[test]
fn coarse_cells_leave_room_between_samples_and_walls() {
    for (factor, margin) in [(0.5, 4.0), (0.3, 6.5), (0.1, 5.0), (0.9, 4.0), (0.5, 20.0)] {
        let fine = grid([100, 61, 47]);
        let coarse = refined(fine.shape(), factor, margin);
        let ratio = fine.spacing() / coarse.spacing();
        assert!((factor..1.2 * factor).contains(&ratio), "{ratio}");
        for a in 0..3 {
            let below = (fine.lower()[a] - coarse.lower()[a]) / coarse.spacing();
            let above = (coarse.upper()[a] - fine.upper()[a]) / coarse.spacing();
            assert!((below - below.round()).abs() < 1e-9);
            assert!(below.min(above) + margin * ratio >= 4.0 - 1e-9, "{factor}");
            assert!(below + margin * ratio < 5.0f64.max(1.0 + margin * ratio));
        }
    }
}

#[test]
fn lengths_suit_a_fourier_transform_where_the_box_allows() {
    assert_eq!(refined([128; 3], 1.3, 0.0).shape(), [168; 3]);
    assert_eq!(refined([338, 120, 151], 2.0, 0.0).shape(), [676, 240, 302]);
    assert_eq!(refined([256, 63, 90], 1.5, 10.0).shape(), [384, 96, 135]);
}

#[test]
fn automatic_cells_follow_the_samples_as_far_as_is_affordable() {
    let cells = |shape, sample_spacing: f64, solve| {
        let (auto, size) = (
            SurfaceResolution::Auto,
            0.05 * sample_spacing / CELLS_PER_SPACING,
        );
        let found = auto.grid_and_octaves(&grid(shape), size, solve, 20.0);
        found.expect("fits").0.shape()
    };
    let cube = [40; 3];
    for (sample_spacing, expected) in [
        (9.0, 9),
        (2.5, 18),
        (1.3, 35),
        (1.2, 40),
        (0.97, 45),
        (0.9, 50),
        (0.7, 60),
        (0.5, 90),
        (0.35, 135),
        (1e-9, 160),
    ] {
        assert_eq!(cells(cube, sample_spacing, Solve::Dense), [expected; 3]);
    }
    assert_eq!(cells(cube, f64::NAN, Solve::Dense), cube);
    // At most 2²⁵ cells, or twice as fine by a sparse solve.
    for (shape, dense, sparse) in [
        ([100; 3], [300; 3], [300; 3]),
        ([150; 3], [300; 3], [300; 3]),
        ([200; 3], [300; 3], [400; 3]),
        ([338, 120, 151], [560, 200, 252], [700, 252, 320]),
    ] {
        assert_eq!(cells(shape, 0.1, Solve::Dense), dense);
        assert_eq!(cells(shape, 0.1, Solve::Auto), sparse);
    }
}

#[test]
fn cells_of_a_sparse_solve_can_be_halved_and_hardly_shrink() {
    let of = |shape, factor, solve, margin| {
        let surface = SurfaceResolution::Factor(factor);
        let found = surface.grid_and_octaves(&grid(shape), f64::NAN, solve, margin);
        let (fine, octaves) = found.expect("fits");
        assert!(fine.shape().iter().all(|n| n % (1 << octaves) == 0));
        (fine.shape(), octaves)
    };
    let fish = [338, 120, 151];
    for margin in [0.0, 10.0] {
        assert_eq!(of([128; 3], 2.0, Solve::Auto, margin), ([256; 3], 0));
        assert_eq!(of([128; 3], 4.0, Solve::Auto, margin), ([512; 3], 2));
        assert_eq!(of([128; 3], 4.0, Solve::Dense, margin), ([512; 3], 0));
        assert_eq!(of([128; 3], 1.0, Solve::Sparse, margin), ([128; 3], 1));
    }
    assert_eq!(of([125; 3], 3.0, Solve::Auto, 0.0), ([376; 3], 2));
    assert_eq!(of([125; 3], 3.0, Solve::Auto, 10.0), ([384; 3], 2));
    assert_eq!(of(fish, 3.0, Solve::Auto, 0.0), ([1014, 360, 453], 0));
    assert_eq!(of(fish, 3.0, Solve::Auto, 10.0), ([1024, 384, 480], 2));
}

#[test]
fn more_cells_than_can_be_indexed_are_an_error() {
    let of = |shape, spacing| {
        let surface = SurfaceResolution::Spacing(spacing);
        surface.grid_and_octaves(&grid(shape), f64::NAN, Solve::Dense, 0.0)
    };
    assert!(matches!(of([600; 3], 1e-3), Err(Error::Grid(_))));
    assert!(matches!(of([8; 3], 1e-300), Err(Error::Surface(_))));
}
