use super::{Random, brute_force, soup, sphere, torus};
use crate::distance::Error;
use crate::distance::bvh::{Bvh, LANES, NearestTriangles};
use crate::distance::lattice::{Band, NO_TRIANGLE, Scratch, forward};
use crate::distance::triangle::closest_point;
use crate::vector::to_f64;
use crate::{Field, Grid, Mesh, Real};

/// Signs at random: the stage must take them as they are.
fn signs<T: Real>(grid: Grid<T>, seed: u64) -> Field<T> {
    let mut random = Random::new(seed);
    let values = (0..grid.cells()).map(|_| T::of(random.signed())).collect();
    Field::new(grid, values).expect("as many values as cells")
}

fn solve<T: Real>(mesh: &Mesh<T>, chi: &Field<T>, band: Band) -> (Field<T>, Vec<u32>) {
    let mut phi = Field::zeros(*chi.grid());
    let mut closest = Vec::new();
    let mut scratch = Scratch::default();
    forward(
        mesh,
        chi,
        T::of(0.1),
        band,
        &mut scratch,
        &mut phi,
        &mut closest,
    )
    .expect("a mesh");
    (phi, closest)
}

/// Distance and face of every `step`-th cell against all triangles.
fn assert_exact<T: Real>(mesh: &Mesh<T>, grid: Grid<T>, step: usize, tolerance: f64) {
    let chi = signs(grid, 5);
    let (phi, closest) = solve(mesh, &chi, Band::Full);
    for index in (0..grid.cells()).step_by(step) {
        let q = grid.center_f64(grid.cell(index));
        let (_, found) = brute_force(mesh, q);
        let d = phi.values()[index].f64().abs();
        assert!(
            (d - found.distance).abs() <= tolerance * found.distance,
            "{} at {q:?}: {d:e}, not {found:?}, {:e}",
            T::NAME,
            (d - found.distance).abs() / found.distance
        );
        let named = closest_point(q, mesh.corners(closest[index] as usize).map(to_f64)).distance;
        assert!(
            (named - found.distance).abs() <= 1e-12 * found.distance,
            "{q:?}: {named:e} {found:?}"
        );
        assert_eq!(
            phi.values()[index] < T::zero(),
            chi.values()[index] < T::of(0.1)
        );
    }
}

/// Boxes of odd sizes, off the mesh, and with cells from far smaller to far larger than the triangles.
fn grids<T: Real>() -> [Grid<T>; 4] {
    let grid = |lower: [f64; 3], h: f64, shape| {
        Grid::new(lower.map(T::of), T::of(h), shape).expect("valid")
    };
    [
        grid([-1.3, -1.2, -1.1], 0.1, [26, 23, 19]),
        grid([0.1, 0.2, -0.3], 0.004, [17, 33, 5]),
        grid([-9.0, -8.0, 3.0], 0.9, [20, 19, 18]),
        grid([-0.05, -0.02, -0.03], 1e-4, [9, 16, 40]),
    ]
}

#[test]
fn distance_is_that_of_all_triangles_tried() {
    for (seed, triangles) in [(1, 1), (2, 2), (3, 9), (4, 40), (5, 400), (6, 3000)] {
        for (k, grid) in grids::<f64>().into_iter().enumerate() {
            assert_exact(
                &soup(triangles, seed),
                grid,
                37 + 4 * k + triangles / 10,
                1e-12,
            );
        }
        for (k, grid) in grids::<f32>().into_iter().enumerate() {
            assert_exact(
                &soup(triangles, seed),
                grid,
                37 + 4 * k + triangles / 10,
                1e-6,
            );
        }
    }
}

#[test]
fn distance_to_a_fine_closed_surface_is_that_of_all_triangles_tried() {
    let grid = |h: f64, shape| Grid::new([-1.05; 3], h, shape).expect("valid");
    assert_exact(
        &torus::<f64>(120, 43),
        grid(0.035, [60, 61, 59]),
        997,
        1e-12,
    );
    assert_exact(
        &sphere::<f64>(30, 1.0),
        grid(0.035, [60, 61, 59]),
        997,
        1e-12,
    );
}

#[test]
fn distance_far_from_the_origin_loses_nothing() {
    let mut random = Random::new(3);
    let base = [1e6, -3e5, 2e6];
    let vertices = (0..300).map(|_| random.near(base, 1.0)).collect();
    let faces = (0..100).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let mesh = Mesh::new(vertices, faces).expect("finite");
    let grid = Grid::new(base.map(|x| x - 1.2), 0.1, [24, 24, 24]).expect("valid");
    assert_exact(&mesh, grid, 17, 1e-12);
}

#[test]
fn triangles_beyond_the_range_of_single_precision_are_measured() {
    let triangle = |at: [f64; 3]| {
        let edges = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.0, 0.1, 0.01]];
        edges.map(|e| [at[0] + e[0], at[1] + e[1], at[2] + e[2]])
    };
    let faces = vec![[0, 1, 2], [3, 4, 5]];
    let grid = Grid::new([-1.0; 3], 0.1, [9, 18, 7]).expect("valid");
    for far in [1e13, 1e18, 1e25, 1e100] {
        for near in [[0.1, 0.2, 0.3], [-far, far, far]] {
            let vertices = [triangle(near), triangle([far, -far, 0.0])].concat();
            let mesh = Mesh::new(vertices, faces.clone()).expect("finite");
            assert_exact(&mesh, grid, 7, 1e-12);
        }
    }
}

#[test]
fn band_is_exact_within_its_width_and_constant_beyond() {
    for (mesh, cells) in [
        (soup::<f64>(30, 8), 1.5),
        (torus(120, 43), 3.0),
        (torus(120, 43), 0.4),
    ] {
        let grid = Grid::new([-1.3, -1.2, -1.0], 0.04, [65, 60, 50]).expect("valid");
        let chi = signs(grid, 9);
        let width = cells * grid.spacing();
        let (full, _) = solve(&mesh, &chi, Band::Full);
        let (band, closest) = solve(&mesh, &chi, Band::Within(width));
        let mut within = 0;
        for (index, &d) in full.values().iter().enumerate() {
            if d.abs() <= width {
                within += 1;
                // Which of two triangles with a common edge is named may depend on the band.
                assert!((band.values()[index] - d).abs() <= 1e-14, "{d}");
                assert_ne!(closest[index], NO_TRIANGLE);
            } else {
                assert_eq!(band.values()[index], width * d.signum());
                assert_eq!(closest[index], NO_TRIANGLE);
            }
        }
        assert!(within > 100 && within < grid.cells() / 2, "{within} cells");
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mesh = torus::<f32>(150, 50);
    let grid = Grid::new([-1.0, -1.0, -0.4], 0.03, [67, 66, 27]).expect("valid");
    let chi = signs(grid, 2);
    crate::testing::assert_same_bits(|| {
        (
            solve(&mesh, &chi, Band::Full),
            solve(&mesh, &chi, Band::Within(0.06)),
        )
    });
}

#[test]
fn face_does_not_depend_on_what_single_precision_leaves_over() {
    let mesh = sphere::<f32>(6, 0.7);
    let grid = Grid::new([-1.0; 3], 0.125, [16; 3]).expect("a grid");
    let (_, closest) = solve(&mesh, &signs(grid, 5), Band::Full);
    let mut bvh = Bvh::default();
    bvh.rebuild(&mesh).expect("a mesh");
    for index in (0..grid.cells()).step_by(7) {
        let points = grid.center_f64(grid.cell(index)).map(|x| [x; LANES]);
        let (mut found, mut backwards) = (NearestTriangles::NOTHING, NearestTriangles::NOTHING);
        for place in 0..bvh.len() as u32 {
            found.try_triangle(&bvh.frame_of(&mesh, place), place, &points);
            let place = bvh.len() as u32 - 1 - place;
            backwards.try_triangle(&bvh.frame_of(&mesh, place), place, &points);
        }
        assert_eq!(found.triangle, backwards.triangle);
        assert_eq!(bvh.face(found.triangle[0]), closest[index], "cell {index}");
    }
}

#[test]
fn center_of_a_sphere_where_all_triangles_are_closest_stays_cheap_and_exact() {
    let mesh = sphere::<f64>(40, 1.0);
    let grid = Grid::new([-1.1; 3], 2.2 / 63.0, [63; 3]).expect("valid");
    // The middle cell of an odd grid is the center of the sphere itself.
    let (phi, _) = solve(&mesh, &signs(grid, 1), Band::Full);
    for cell in [
        [31, 31, 31],
        [31, 31, 32],
        [30, 31, 32],
        [33, 29, 30],
        [24, 32, 35],
    ] {
        let (_, found) = brute_force(&mesh, grid.center_f64(cell));
        assert!(
            (phi.at(cell).abs() - found.distance).abs() < 1e-12 * found.distance,
            "{cell:?}"
        );
    }
}

#[test]
fn mesh_without_any_area_has_a_distance() {
    let line = Mesh::new(
        vec![[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]],
        vec![[0, 1, 2], [1, 1, 1]],
    );
    let point = Mesh::new(vec![[0.3, 0.4, 0.5]], vec![[0, 0, 0]; 9]);
    for mesh in [line, point] {
        assert_exact(
            &mesh.expect("finite"),
            Grid::new([-1.0; 3], 0.2, [18, 19, 20]).expect("valid"),
            7,
            1e-12,
        );
    }
}

#[test]
fn cell_on_the_surface_keeps_the_sign_of_its_side() {
    let grid = Grid::new([-1.0f32; 3], 0.5, [4; 3]).expect("valid");
    let q = grid.center([1, 2, 1]);
    let mesh =
        Mesh::new(vec![q, [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]], vec![[0, 1, 2]]).expect("finite");
    let mut chi = Field::zeros(grid);
    chi.values_mut().fill(-1.0);
    let (phi, _) = solve(&mesh, &chi, Band::Full);
    assert_eq!(phi.at([1, 2, 1]), -f32::MIN_POSITIVE);
    chi.values_mut().fill(0.1);
    let (phi, _) = solve(&mesh, &chi, Band::Full);
    assert_eq!(phi.at([1, 2, 1]), 0.0);
}

#[test]
fn second_call_uses_the_memory_of_the_first() {
    let mesh = torus::<f32>(60, 20);
    let chi = signs(Grid::new([-1.0f32; 3], 0.05, [40; 3]).expect("valid"), 3);
    let mut phi = Field::zeros(*chi.grid());
    let (mut closest, mut scratch) = (Vec::new(), Scratch::default());
    let mut run = || {
        forward(
            &mesh,
            &chi,
            0.0,
            Band::Full,
            &mut scratch,
            &mut phi,
            &mut closest,
        )
        .expect("a mesh");
        (phi.values().as_ptr(), closest.as_ptr(), scratch.capacity())
    };
    let first = run();
    assert_eq!(first, run());
}

#[test]
fn bad_input_is_refused_with_a_reason() {
    let chi = signs(Grid::new([-1.0f64; 3], 0.5, [4; 3]).expect("valid"), 3);
    let refused = |vertices: Vec<[f64; 3]>, faces, band| {
        let mesh = Mesh::new(vertices, faces).expect("finite");
        let mut phi = Field::zeros(*chi.grid());
        forward(
            &mesh,
            &chi,
            0.0,
            band,
            &mut Scratch::default(),
            &mut phi,
            &mut Vec::new(),
        )
        .expect_err("refused")
    };
    assert_eq!(refused(vec![[0.0; 3]], vec![], Band::Full), Error::Empty);
    let tiny = vec![[0.0; 3], [1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]];
    assert!(matches!(
        refused(tiny, vec![[0, 1, 2]], Band::Full),
        Error::Range { .. }
    ));
    assert!(matches!(
        refused(vec![[1e200; 3]], vec![[0, 0, 0]], Band::Full),
        Error::Range { .. }
    ));
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(vec![[1.0; 3]], vec![[0, 0, 0]], Band::Within(width));
        assert!(matches!(error, Error::Band { .. }), "{error}");
    }
}
